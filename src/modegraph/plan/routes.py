"""Sequences of modes that may lead from a start to a goal, and references for all of them at once.

A route fixes the modes; its references are those for which each stop ends as near as can be to the centre
of the next start set: one small least-squares problem in gauges (design, decision 8: propose in floats).
"""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.relation import Relation
from modegraph.certify.verdict import Status

if TYPE_CHECKING:
    from modegraph.graph.modegraph import ModeGraph, Node

Floats = NDArray[np.float64]

MOST_ROUTES = 48
MOST_STOPS = 7
MOST_LEGS = 3
"""Times in a row that a mode which carries the state is taken."""
MOST_TRIED = 4000
"""Beginnings of routes looked at in one search."""
PULL = 1e-4
"""How strongly a reference is drawn to the middle of its class, where nothing else decides, for each gauge."""


@dataclass(frozen=True, eq=False)
class Route:
    """Stops (mode, member of a finite class; 0 for a continuous one).

    Two stops in a row in the same class of set-points are a walk: as many references between them as it takes.
    """

    graph: ModeGraph
    stops: tuple[Node, ...]

    def walks(self, k: int) -> bool:
        """Whether the link behind stop k is a walk."""
        return self.stops[k] == self.stops[k + 1] and _stays(self.graph, self.stops[k]) is True

    @cached_property
    def _blocks(self) -> list[slice]:
        """Where each stop's parameters stand in the vector of all of them."""
        sizes = [self.graph.regions[name].dim if name in self.graph.regions else 0 for name, _ in self.stops]
        ends = np.concatenate([[0], np.cumsum(sizes)]).tolist()
        return [slice(a, b) for a, b in itertools.pairwise(ends)]

    @cached_property
    def _misses(self) -> tuple[Floats, Floats]:
        """h and H: how far all links miss the next centre is h + H z, in gauges."""
        size = self._blocks[-1].stop
        h, H = [np.zeros(0)], [np.zeros((0, size))]
        for k, (source, target) in enumerate(itertools.pairwise(self.stops)):
            link = self.graph.links.get((source, target))
            if self.walks(k) or link is None or not isinstance(link.relation, Relation):
                continue
            y, Y, Z = link.relation.arrival
            rows = np.zeros((len(y), size))
            rows[:, self._blocks[k]] = Y
            rows[:, self._blocks[k + 1]] = -Z
            h.append(y)
            H.append(rows)
        return np.concatenate(h), np.concatenate(H)

    def references(self, fixed: Mapping[int, Floats], bounds: Mapping[int, tuple[Floats, Floats]]) -> list[Floats]:
        """References of all stops, (0,) of finite ones; ``fixed`` ones are kept, ``bounds`` narrow a class."""
        h, H = self._misses
        z = np.zeros(H.shape[1])
        lo, hi = np.zeros(len(z)), np.zeros(len(z))
        free = np.ones(len(z), bool)
        for k, ((name, _), block) in enumerate(zip(self.stops, self._blocks, strict=True)):
            if block.start == block.stop:
                continue
            region = self.graph.regions[name]
            lo[block], hi[block] = bounds.get(k, (region.lo, region.hi))
            if k in fixed:
                z[block] = fixed[k]
                free[block] = False
        z[free] = 0.5 * (lo + hi)[free]
        # What leaves its class is set to the nearest end, and the others are found again.
        for _ in range(len(self.stops)):
            if not free.any():
                break
            z[free] -= self._solver(free.tobytes(), lo, hi) @ (h + H @ z)
            outside = free & ((z < lo) | (z > hi))
            z = np.where(free, np.clip(z, lo, hi), z)
            if not outside.any():
                break
            free &= ~outside
        return [z[block] for block in self._blocks]

    @cached_property
    def _solvers(self) -> dict[tuple[bytes, bytes], Floats]:
        return {}

    def _solver(self, free: bytes, lo: Floats, hi: Floats) -> Floats:
        """The matrix that takes misses to what must be taken from the free parameters."""
        key = free, (hi - lo).tobytes()
        if key not in self._solvers:
            chosen = np.frombuffer(free, bool)
            H = self._misses[1][:, chosen]
            pull = np.diag(PULL / np.maximum(0.5 * (hi - lo)[chosen], 1e-12))
            self._solvers[key] = np.linalg.pinv(np.vstack([H, pull]))[:, : len(H)]
        return self._solvers[key]


def _stays(graph: ModeGraph, stop: Node) -> bool | None:
    """Whether a continuous class ends where it starts; None where it has no certified switch to itself."""
    link = graph.links.get((stop, stop))
    if stop[0] not in graph.regions or link is None or not isinstance(link.relation, Relation):
        return None
    return link.relation.stays if link.relation.parts else None


class Routes:
    """The routes of a graph, found once for every start and goal."""

    def __init__(self, graph: ModeGraph) -> None:
        self.graph = graph
        self._found: dict[tuple[Node, Node, frozenset[str], tuple[str, ...]], list[Route]] = {}

    @cached_property
    def _after(self) -> dict[Node, list[Node]]:
        """Stops that may follow a stop."""
        pairs = {(s.source, s.target) for s in self.graph.switches}
        after: dict[Node, list[Node]] = {}
        for (source, target), link in self.graph.links.items():
            if (source[0], target[0]) in pairs and isinstance(link.relation, Relation) and link.relation.parts:
                after.setdefault(source, []).append(target)
        for (source, target), v in self.graph.pair_verdicts().items():
            if v.status is Status.CERTIFIED:
                after.setdefault(source, []).append(target)
        return after

    def between(self, start: Node, goal: Node, avoid: frozenset[str], via: Sequence[str]) -> list[Route]:
        """Routes, the shortest first; the modes of ``via`` are among their stops."""
        key = start, goal, avoid, tuple(via)
        if key not in self._found:
            self._found[key] = [Route(self.graph, stops) for stops in self._stops(start, goal, avoid, via)]
        return self._found[key]

    def _stops(self, start: Node, goal: Node, avoid: frozenset[str], via: Sequence[str]) -> list[tuple[Node, ...]]:
        """No stop twice, except that one may be walked at, and a mode that carries the state may be taken again."""
        far = self._distances(goal)
        found: list[tuple[Node, ...]] = []
        queue: deque[tuple[Node, ...]] = deque([(start,)])
        tried = 0
        while queue and len(found) < MOST_ROUTES and tried < MOST_TRIED:
            stops = queue.popleft()
            tried += 1
            walked = any(a == b and self._may_walk(a) for a, b in itertools.pairwise(stops))
            if stops[-1] == goal and (len(stops) > 1 or start == goal):
                if set(via) <= {name for name, _ in stops}:
                    found.append(stops)
                if start != goal:
                    if self._may_walk(goal) and not walked:
                        queue.append((*stops, goal))
                    continue
            if len(stops) >= MOST_STOPS:
                continue
            for target in self._after.get(stops[-1], ()):
                if target[0] in avoid or target not in far:
                    continue
                again = target == stops[-1] and (
                    not walked if self._may_walk(target) else self._carries(target) and stops.count(target) < MOST_LEGS
                )
                closes = target == goal == start and len(stops) > 1 and target != stops[-1]
                if again or closes or target not in stops:
                    queue.append((*stops, target))
        return found

    def _may_walk(self, stop: Node) -> bool:
        return stop in self._after.get(stop, ()) and _stays(self.graph, stop) is True

    def _carries(self, stop: Node) -> bool:
        return stop in self._after.get(stop, ()) and _stays(self.graph, stop) is False

    def _distances(self, goal: Node) -> set[Node]:
        """Stops from which the goal may be reached."""
        before: dict[Node, list[Node]] = {}
        for source, targets in self._after.items():
            for target in targets:
                before.setdefault(target, []).append(source)
        known, queue = {goal}, deque([goal])
        while queue:
            for source in before.get(queue.popleft(), ()):
                if source not in known:
                    known.add(source)
                    queue.append(source)
        return known
