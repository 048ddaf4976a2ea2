"""References a plan may choose in continuous classes: floats propose, R^ij decides.

First those of the routes from the start to the goal, and steps where a route walks within one class; where
they lead nowhere, a lattice of every class as well.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.relation import Relation
from modegraph.certify.targets.family import target_class
from modegraph.errors import ModegraphError
from modegraph.model.mode import Mode
from modegraph.model.sets import Box
from modegraph.plan.network import Network
from modegraph.plan.question import End
from modegraph.plan.routes import Route, Routes

if TYPE_CHECKING:
    from modegraph.graph.modegraph import ModeGraph, Node

Floats = NDArray[np.float64]

LATTICE = 27
"""References of every class that are tried where the routes lead nowhere."""
MOST_STEPS = 64
"""References on one walk."""
STRIDES = np.concatenate([[1.0], 0.98 * 2.0 ** -np.arange(0.0, 10.0, 0.5)])
"""Parts of what is left of a walk that are tried as one step, longest first."""
FINER = (1.0, 1.5, 2.0, 3.0)
"""A walk is also tried in so many times the fewest steps, of equal length: short steps are quick."""
MOST_WALKS, FEW_WALKS = 12, 3
"""Walks that are followed for one question: where there is no way without, and where there is."""
SHORT_WALK = 6.0
"""Gauges of a start set: a walk that may be worth it where there is a way without."""


class Proposals:
    """What plans of one graph are made of; kept from question to question."""

    def __init__(self, graph: ModeGraph) -> None:
        self.graph = graph
        self.routes = Routes(graph)
        self._centres: dict[str, tuple[Floats, Floats] | None] = {}

    def along_routes(
        self, network: Network, starts: Sequence[End], goals: Sequence[End], avoid: frozenset[str], via: Sequence[str]
    ) -> None:
        """Propose the references of all routes between the ends, and join them where they are certified."""
        chains: list[tuple[Route, list[Node]]] = []
        for start, goal in itertools.product(starts, goals):
            for route in self.routes.between(start.stop, goal.stop, avoid, via):
                chains.append((route, _nodes(network, route, start, goal)))
        network.connect(pair for _, nodes in chains for pair in itertools.pairwise(nodes))
        straight = False
        walks: dict[tuple[Node, Node], float] = {}
        for route, nodes in chains:
            links = list(itertools.pairwise(nodes))
            open_ = [k for k, link in enumerate(links) if link[0] != link[1] and not network.certified(*link)]
            straight = straight or not open_
            if all(route.walks(k) for k in open_):
                for k in open_:
                    walks[links[k]] = self._length(network, *links[k])
        # Where some route does without, only a short walk may be worth it.
        for a, b in sorted(walks, key=walks.__getitem__)[: FEW_WALKS if straight else MOST_WALKS]:
            if not straight or walks[a, b] <= SHORT_WALK:
                self._walk(network, a, b)

    def everywhere(self, network: Network) -> None:
        """Propose a lattice of every class, and join everything that is certified."""
        known = {name: list(network.of(name)) for name in self.graph.regions}
        for name, region in self.graph.regions.items():
            for p in lattice(region):
                network.propose(name, p)
            for a, b in itertools.islice(itertools.permutations(known[name], 2), MOST_WALKS):
                self._walk(network, a, b)
        nodes = network.nodes()
        network.connect((a, b) for a in nodes for b in nodes)

    def _length(self, network: Network, source: Node, target: Node) -> float:
        """How far it is between two references of one class, in gauges of its start sets."""
        relation = self.graph.references(source[0], source[0]).relations[0, 0]
        a, b = network.parameter(source), network.parameter(target)
        assert a is not None
        assert b is not None
        return float(np.abs(relation.arrival[2] @ (b - a)).max(initial=0.0))

    def _walk(self, network: Network, source: Node, target: Node) -> None:
        """Propose steps on the line between two references of one class."""
        name = source[0]
        a, b = network.parameter(source), network.parameter(target)
        assert a is not None
        assert b is not None
        fewest = self._steps(name, a, b)
        for factor in FINER if fewest else ():
            count = round(factor * fewest)
            line = a + np.linspace(0.0, 1.0, count + 1)[1:-1, None] * (b - a)
            nodes = [source, *(network.propose(name, p) for p in line), target]
            network.connect(itertools.pairwise(nodes))

    def _steps(self, name: str, a: Floats, b: Floats) -> int:
        """How many certified steps lead from a to b, as few as were found; 0: no way was found."""
        relation = self.graph.references(name, name).relations[0, 0]
        here = a
        for count in range(1, MOST_STEPS):
            ahead = here + STRIDES[:, None] * (b - here)
            ahead[0] = b
            good = np.flatnonzero(relation.certified(np.repeat(here[None], len(ahead), axis=0), ahead))
            if not len(good):
                return 0
            if good[0] == 0:
                # Steps of equal length may be fewer.
                while count > 1 and self._even(relation, a, b, count - 1):
                    count -= 1
                return count
            here = ahead[good[0]]
        return 0

    @staticmethod
    def _even(relation: Relation, a: Floats, b: Floats, count: int) -> bool:
        """Whether so many equal steps from a to b are all certified."""
        line = a + np.linspace(0.0, 1.0, count + 1)[:, None] * (b - a)
        line[-1] = b
        return bool(relation.certified(line[:-1], line[1:]).all())

    def image(self, name: str, place: Floats) -> Floats | None:
        """The reference of a class whose start set is centred nearest to a place (least squares, clipped)."""
        if name not in self._centres:
            mode = self.graph.modes[name]
            assert isinstance(mode, Mode)
            try:
                self._centres[name] = target_class(mode, None, len(place)).about
            except ModegraphError:
                self._centres[name] = None
        known = self._centres[name]
        if known is None:
            return None
        c0, C = known
        region = self.graph.regions[name]
        middle = np.asarray(region.center, float)
        p = middle + np.linalg.pinv(C) @ (place - c0 - C @ middle)
        return np.clip(p, region.lo, region.hi)


def _nodes(network: Network, route: Route, start: End, goal: End) -> list[Node]:
    """The nodes of a route, with what is known of its ends."""
    if len(route.stops) == 1:
        return _common(network, start, goal)
    last = len(route.stops) - 1
    fixed: dict[int, Floats] = {}
    bounds: dict[int, tuple[Floats, Floats]] = {}
    for k, end in ((0, start), (last, goal)):
        if end.p is not None:
            fixed[k] = end.p
        elif end.within is not None:
            bounds[k] = end.within.lo, end.within.hi
    found = route.references(fixed, bounds)
    regions: Mapping[str, Box] = network.graph.regions
    return [
        network.propose(stop[0], p) if stop[0] in regions else stop for stop, p in zip(route.stops, found, strict=True)
    ]


def _common(network: Network, start: End, goal: End) -> list[Node]:
    """Where a plan may begin and end at once."""
    name = start.stop[0]
    if name not in network.graph.regions:
        return [start.stop]
    boxes = [end.within for end in (start, goal) if end.within is not None]
    region = network.graph.regions[name]
    lo, hi = np.max([region.lo, *(b.lo for b in boxes)], axis=0), np.min([region.hi, *(b.hi for b in boxes)], axis=0)
    given = [end.p for end in (start, goal) if end.p is not None]
    found = given or ([0.5 * (lo + hi)] if (lo <= hi).all() else [])
    return [network.propose(name, p) for p in found if start.allows(p) and goal.allows(p)]


def lattice(region: Box) -> Floats:
    """A regular lattice (N, k) of about LATTICE points, corners and centre among them."""
    side = max(2, round(LATTICE ** (1.0 / region.dim)))
    axes = [np.linspace(lo, hi, side + (side + 1) % 2) for lo, hi in zip(region.lo, region.hi, strict=True)]
    if region.dim > 3:
        axes = [axis[[0, -1]] for axis in axes]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, region.dim)
    return np.clip(np.vstack([np.asarray(region.center)[None], points]), region.lo, region.hi)
