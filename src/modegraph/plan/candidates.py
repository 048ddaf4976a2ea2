"""References a plan may choose in continuous classes: floats propose, R^ij decides.

Every reference proposed becomes a node of the search, joined to the others by certified pairs only.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.target_class import TargetClass, target_class
from modegraph.errors import ModegraphError
from modegraph.model.sets import Box

if TYPE_CHECKING:
    from modegraph.graph.modegraph import ModeGraph

Floats = NDArray[np.float64]

LATTICE = 27
"""References of every class that are always among the candidates."""
MOST_STEPS = 64
"""Candidates on one line between two places."""
MOST_PLACES = 8
STRIDES = 0.98 * 2.0 ** -np.arange(0.0, 10.0, 0.5)
"""Parts of a line tried as one step, longest first."""


def propose(
    graph: ModeGraph, start: str | None, goal: str, r_start: Any, r_goal: Any, x0: Floats | None
) -> None:
    """Name candidates in every continuous class of the graph: a lattice, those whose start set is centred
    at the places of the question and of the finite modes, and steps along the lines between these.
    """
    centres = _Centres(graph)
    for name, r in ((start, r_start), (goal, r_goal)):
        if name is not None and name in graph.regions and r is not None:
            graph.indices(name, r)
    places = centres.places(start, goal, r_start, r_goal, x0)
    for name, region in graph.regions.items():
        for p in lattice(region):
            graph.indices(name, p)
        images = [image for place in places if (image := centres.image(name, place)) is not None]
        for image in images:
            graph.indices(name, image)
        for a, b in itertools.combinations(images, 2):
            for p in _steps(graph, name, a, b):
                graph.indices(name, p)


def lattice(region: Box) -> Floats:
    """A regular lattice (N, k) of about LATTICE points, corners and centre among them."""
    side = max(2, round(LATTICE ** (1.0 / region.dim)))
    axes = [np.linspace(lo, hi, side + (side + 1) % 2) for lo, hi in zip(region.lo, region.hi, strict=True)]
    if region.dim > 3:
        axes = [axis[[0, -1]] for axis in axes]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, region.dim)
    return np.clip(np.vstack([np.asarray(region.center)[None], points]), region.lo, region.hi)


def _steps(graph: ModeGraph, name: str, a: Floats, b: Floats) -> Floats:
    """References on the line from a to b, so far apart that changing to the next is certified where that is found."""
    if np.array_equal(a, b):
        return np.zeros((0, len(a)))
    refs = graph.references(name, name)
    ahead = a + STRIDES[:, None] * (b - a)
    fine = np.flatnonzero(refs.statuses(np.repeat(a[None], len(ahead), axis=0), ahead) == 1)
    stride = float(STRIDES[fine[0]]) if len(fine) else 0.25
    count = min(MOST_STEPS, int(np.ceil(1.0 / stride)))
    return a + np.linspace(0.0, 1.0, count + 1)[1:-1, None] * (b - a)


class _Centres:
    """Where the start sets of modes are centred, and which reference of a class centres its own at a place."""

    def __init__(self, graph: ModeGraph) -> None:
        self.graph = graph
        self._classes: dict[str, TargetClass | None] = {}

    def places(self, start: str | None, goal: str, r_start: Any, r_goal: Any, x0: Floats | None) -> list[Floats]:
        """States that matter: those of the question first, then of the finite modes."""
        found = [] if x0 is None else [x0]
        for name, r in ((start, r_start), (goal, r_goal)):
            if name is not None:
                place = self.place(name, r)
                found += [] if place is None else [place]
        others = [self.place(name, None) for name in self.graph.modes if name not in self.graph.regions]
        found += [place for place in others if place is not None]
        unique = list({place.tobytes(): place for place in found}.values())
        return unique[:MOST_PLACES]

    def place(self, name: str, r: Any) -> Floats | None:
        """The centre of the start set; None for a class without a reference, where that matters."""
        if name in self.graph.regions:
            goal = self._class(name)
            if goal is None:
                return None
            fixed = goal.affine is not None and not goal.affine[1].any()
            if r is None and not fixed:
                return None
            p = np.asarray(self.graph.regions[name].center if r is None else np.atleast_1d(r), float)
            return np.array(goal.at(p[None])[0][0])
        goal = self._class(name)
        return None if goal is None else np.array(goal.at(np.zeros((1, 0)))[0][0])

    def image(self, name: str, place: Floats) -> Floats | None:
        """The reference of a class whose start set is centred nearest to a place (least squares, clipped)."""
        goal = self._class(name)
        if goal is None or goal.affine is None or len(place) != goal.dim:
            return None
        c0, C = goal.affine
        region = self.graph.regions[name]
        p = np.linalg.lstsq(C, place - c0, rcond=None)[0]
        return np.clip(p, region.lo, region.hi)

    def _class(self, name: str) -> TargetClass | None:
        if name not in self._classes:
            mode = self.graph.modes[name]
            p = None if name in self.graph.regions else self.graph.parameter((name, 0))
            try:
                self._classes[name] = target_class(mode, p, self.graph.dimension)
            except ModegraphError:
                self._classes[name] = None
        return self._classes[name]
