"""What no plan made of the certified switches of a graph can beat, whatever references it chooses.

Every class is cut into boxes. A plan is relaxed: inside one box the reference may change for nothing, and a
walk within a class costs what its certified strides cost along a straight line. The cheapest way through the
boxes is then no dearer than any plan. For finite classes nothing is relaxed.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.least import Least, Strides, least, strides
from modegraph.certify.moments import at_state
from modegraph.certify.relation import Part, Relation
from modegraph.certify.targets.family import target_class
from modegraph.certify.verdict import Status
from modegraph.errors import ModegraphError
from modegraph.plan.objectives import Objective
from modegraph.plan.objectives import latest as latest_of
from modegraph.plan.question import End, Question

if TYPE_CHECKING:
    from modegraph.graph.modegraph import ModeGraph, Node

Floats = NDArray[np.float64]

SIDES = (24, 8, 4, 3, 2, 2)
"""Boxes along each side of a class of one, two, ... parameters."""


@dataclass(frozen=True)
class Cells:
    """Boxes lo, hi (B, k) of references of one node of the graph; k = 0 for a member of a finite class."""

    node: Node
    lo: Floats
    hi: Floats


class Relaxation:
    """Bounds of every switch and every walk between boxes of references; kept from question to question."""

    def __init__(self, graph: ModeGraph) -> None:
        self.graph = graph

    @cached_property
    def cells(self) -> list[Cells]:
        """The boxes of all continuous classes and the members of the finite ones."""
        nodes = [(name, 0) for name in self.graph.regions] + self.graph.nodes()
        return [self._cut(node) for node in nodes]

    def _cut(self, node: Node) -> Cells:
        region = self.graph.regions.get(node[0])
        if region is None:
            return Cells(node, np.zeros((1, 0)), np.zeros((1, 0)))
        k = region.dim
        side = SIDES[min(k, len(SIDES)) - 1]
        edges = [np.linspace(a, b, side + 1) for a, b in zip(region.lo, region.hi, strict=True)]
        corners = np.array(list(itertools.product(range(side), repeat=k)))
        lo = np.stack([edge[corners[:, v]] for v, edge in enumerate(edges)], axis=1)
        hi = np.stack([edge[corners[:, v] + 1] for v, edge in enumerate(edges)], axis=1)
        return Cells(node, lo, hi)

    @cached_property
    def _switches(self) -> dict[tuple[Node, Node], Least]:
        return {
            (a.node, b.node): found for a in self.cells for b in self.cells if (found := self.switch(a, b)) is not None
        }

    @cached_property
    def _strides(self) -> dict[Node, Strides | None]:
        found: dict[Node, Strides | None] = {}
        for name in self.graph.regions:
            link = self.graph.links.get(((name, 0), (name, 0)))
            found[name, 0] = strides(link.relation) if link and isinstance(link.relation, Relation) else None
        return found

    def _walks(self, node: Node) -> bool:
        """Whether a class of set-points has certified switches to itself."""
        link = self.graph.links.get((node, node))
        relation = None if link is None else link.relation
        return isinstance(relation, Relation) and bool(relation.parts) and relation.stays

    def switch(self, a: Cells, b: Cells) -> Least | None:
        """Bounds of the switches from boxes to boxes; None where none is certified, or walks stand for them."""
        link = self.graph.links.get((a.node, b.node))
        if link is not None:
            if not isinstance(link.relation, Relation) or (a.node == b.node and self._walks(a.node)):
                return None
            return least(link.relation, (a.lo, a.hi), (b.lo, b.hi))
        verdict = self.graph.pair_verdicts().get((a.node, b.node))
        if verdict is None or verdict.status is not Status.CERTIFIED:
            return None
        energy = np.inf if verdict.energy is None else verdict.energy
        margin = 0.0 if verdict.margin is None else verdict.margin
        numbers = (np.array([[v]]) for v in (1.0 - margin, latest_of(verdict), energy))
        return Least(*numbers)

    def bound(self, question: Question) -> float:
        """A lower bound of the cost of any plan; infinite where there can be none."""
        ends = [self._end(end) for end in (*question.starts, *question.goals)]
        boxes = [*self.cells, *(end for end in ends if end is not None)]
        known = len(self.cells)
        sizes = [len(c.lo) for c in boxes]
        firsts = np.concatenate([[0], np.cumsum(sizes)])
        total = int(firsts[-1])
        # Arriving with a reference, then leaving with one: two layers of the same boxes.
        costs = np.full((2 * total, 2 * total), np.inf)
        for i, a in enumerate(boxes):
            for j, b in enumerate(boxes):
                rows, columns = slice(firsts[i], firsts[i + 1]), slice(firsts[j], firsts[j + 1])
                leaving = slice(total + rows.start, total + rows.stop)
                if a.node == b.node:
                    behind = slice(total + columns.start, total + columns.stop)
                    costs[rows, behind] = self._walk(a, b, question.wanted)
                fresh = i >= known or j >= known
                found = self.switch(a, b) if fresh else self._switches.get((a.node, b.node))
                if found is not None and b.node[0] not in question.avoid:
                    costs[leaving, columns] = _price(found, a, b, question.wanted)
        begin, finish = np.zeros(total, bool), np.zeros(total, bool)
        for k, end in enumerate((*question.starts, *question.goals)):
            mine = self._places(end, ends[k], boxes, firsts, known + sum(e is not None for e in ends[:k]))
            if k < len(question.starts):
                begin[mine] |= self._may_hold(boxes, firsts, mine, question.state)
            else:
                finish[mine] = True
        far = _cheapest(costs, np.concatenate([begin, np.zeros(total, bool)]), question.wanted.bottleneck)
        best = float(far[total:][finish].min(initial=np.inf))
        if question.wanted.travelled:
            best = max(best, self._straight(boxes, begin, finish))
        if question.wanted.name == "switches" and math.isfinite(best):
            best = float(math.ceil(best - 1e-6))
        return best

    def _straight(self, boxes: list[Cells], begin: NDArray[np.bool_], finish: NDArray[np.bool_]) -> float:
        """No chain of references is shorter than the straight line, where all classes have the same parameters."""
        sizes = {cells.lo.shape[1] for cells in boxes}
        if len(sizes) > 1 or not begin.any() or not finish.any():
            return 0.0
        lo, hi = np.concatenate([c.lo for c in boxes]), np.concatenate([c.hi for c in boxes])
        a, b = (Cells(boxes[0].node, lo[chosen], hi[chosen]) for chosen in (begin, finish))
        return float(_apart(a, b).min())

    def _end(self, end: End) -> Cells | None:
        """A box for an end whose reference is given, or bounded; None where the cells of its mode will do."""
        if end.stop[0] not in self.graph.regions:
            return None
        if end.p is not None:
            return Cells(end.stop, end.p[None], end.p[None])
        if end.within is not None:
            lo, hi = np.asarray(end.within.lo, float), np.asarray(end.within.hi, float)
            return Cells(end.stop, lo[None], hi[None])
        return None

    @staticmethod
    def _places(end: End, own: Cells | None, boxes: list[Cells], firsts: NDArray[np.int64], at: int) -> list[int]:
        """Where an end may be among all boxes."""
        chosen = [at] if own is not None else [i for i, c in enumerate(boxes) if c.node == end.stop]
        return [k for i in chosen for k in range(int(firsts[i]), int(firsts[i + 1]))]

    def _may_hold(
        self, boxes: list[Cells], firsts: NDArray[np.int64], places: list[int], state: Floats | None
    ) -> NDArray[np.bool_]:
        """In which boxes there may be a reference under which a mode is entered from the state."""
        if state is None:
            return np.ones(len(places), bool)
        found = []
        for place in places:
            i = int(np.searchsorted(firsts, place, side="right")) - 1
            cells, k = boxes[i], place - int(firsts[i])
            name, member = cells.node
            p = None if name in self.graph.regions else self.graph.parameter((name, member))
            try:
                goal = target_class(self.graph.modes[name], p, len(state))
            except ModegraphError:
                found.append(True)
                continue
            relation = Relation(None, goal, (Part((at_state(state, goal),)),), None)
            nothing = np.zeros((1, 0))
            low = least(relation, (nothing, nothing), (cells.lo[k : k + 1], cells.hi[k : k + 1]))
            found.append(bool(np.isfinite(low.latest[0, 0])))
        return np.array(found, bool)

    def _walk(self, a: Cells, b: Cells, wanted: Objective) -> Floats:
        """Least cost of changing the reference within one class, by switches to itself."""
        if a.node[0] not in self.graph.regions:
            return np.zeros((1, 1))
        if not self._walks(a.node):
            # The cells of a class only touch each other; a given end may be the same as another.
            same = np.eye(len(a.lo), dtype=bool) if a is b else _apart(a, b) == 0.0
            return np.where(same, 0.0, np.inf)
        apart = _apart(a, b)
        if wanted.travelled:
            return apart
        how = self._strides[a.node]
        if wanted.bottleneck or how is None:
            return np.zeros(apart.shape)
        price = _weighed(wanted, how.latest, how.energy)
        return how.cost((a.lo, a.hi), (b.lo, b.hi), price)


def _apart(a: Cells, b: Cells) -> Floats:
    """Euclidean distances (Bi, Bj) between boxes of references."""
    gap = np.maximum(np.maximum(b.lo[None] - a.hi[:, None], a.lo[:, None] - b.hi[None]), 0.0)
    return np.asarray(np.sqrt((gap**2).sum(axis=2)) * (1.0 - 1e-12))


def _price(found: Least, a: Cells, b: Cells, wanted: Objective) -> Floats:
    """What one switch costs at least."""
    possible = np.isfinite(found.latest)
    if wanted.bottleneck:
        return np.where(possible, np.maximum(found.gauge, 0.0), np.inf)
    total = np.zeros(possible.shape)
    if wanted.travelled and a.lo.shape[1] == b.lo.shape[1]:
        total = total + _apart(a, b)
    return np.where(possible, total + _weighed(wanted, found.latest, found.energy), np.inf)


def _weighed(wanted: Objective, latest: Floats, energy: Floats) -> Floats:
    """The weighted sum of one switch and its bounds."""
    total = np.zeros(latest.shape)
    for what, amount in (("switches", np.ones(latest.shape)), ("time", latest), ("energy", energy)):
        if wanted.weights.get(what):
            total = total + float(wanted.weights[what]) * amount
    return total


def _cheapest(costs: Floats, begin: NDArray[np.bool_], bottleneck: bool) -> Floats:
    """Least sums - or least largest terms - from the nodes of ``begin`` (Dijkstra on a matrix)."""
    far = np.where(begin, 0.0, np.inf)
    left = np.ones(len(far), bool)
    while True:
        k = int(np.argmin(np.where(left, far, np.inf)))
        if not left[k] or not math.isfinite(far[k]):
            return far
        left[k] = False
        through = np.maximum(far[k], costs[k]) if bottleneck else far[k] + costs[k]
        np.minimum(far, through, out=far)
