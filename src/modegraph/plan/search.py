"""Best paths on nodes (mode, reference): Dijkstra and Yen with exact lexicographic costs.

A node fixes the reference, so coupled R^ij are exact: a path exists iff the composition of the
relations is not empty (method, section 3). A state of the search is a node together with how many
of the ``via`` visits are done.
"""

from __future__ import annotations

import heapq
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import count
from typing import NamedTuple

from modegraph.graph.modegraph import Node
from modegraph.plan.objectives import NO_COST, Cost

State = tuple[Node, int]


class Arc(NamedTuple):
    """One certified pair: the switch from ``source`` to ``target``."""

    source: Node
    target: Node
    cost: Cost
    latest: Fraction
    margin: float


class Key(NamedTuple):
    """How plans are ordered: the objective, then the ties of the contract, then the references."""

    cost: Cost
    switches: int
    latest: Fraction
    modes: tuple[int, ...]
    references: tuple[int, ...]


@dataclass(frozen=True)
class Problem:
    """A question to the graph, resolved to nodes.

    Attributes
    ----------
    order : mapping of node to (mode position, reference position)
    arcs : mapping of node to its outgoing arcs
    starts, goals : nodes
    via : mode names, in this order
    avoid : mode names that are never entered
    max_switches : int or None
    bottleneck : bool
        Maximise the smallest margin; costs are then zero.
    """

    order: Mapping[Node, tuple[int, int]]
    arcs: Mapping[Node, Sequence[Arc]]
    starts: tuple[Node, ...]
    goals: frozenset[Node]
    via: tuple[str, ...] = ()
    avoid: frozenset[str] = frozenset()
    max_switches: int | None = None
    bottleneck: bool = False

    def accepts(self, state: State) -> bool:
        """A goal with every ``via`` visited; the goal itself may be the last of them."""
        node, done = state
        if node not in self.goals:
            return False
        missing = self.via[done:]
        return not missing or missing == (node[0],)

    def after(self, state: State, arc: Arc) -> State:
        """The state behind an arc. A visit left in zero time does not count."""
        node, done = state
        counts = arc.latest > 0 and done < len(self.via) and self.via[done] == node[0]
        return arc.target, done + counts

    def leaving(self, state: State) -> Sequence[Arc]:
        """Arcs a plan may take: none once the goal is reached, none into ``avoid``."""
        if self.accepts(state):
            return ()
        return [arc for arc in self.arcs.get(state[0], ()) if arc.target[0] not in self.avoid]


@dataclass(frozen=True)
class Path:
    """States visited, the arcs between them and the key they add up to."""

    states: tuple[State, ...]
    arcs: tuple[Arc, ...]
    key: Key

    @property
    def margin(self) -> float | None:
        """The smallest margin on the way; None without a switch."""
        return min((arc.margin for arc in self.arcs), default=None)

    def rank(self, bottleneck: bool) -> tuple[float, Key]:
        """What plans are sorted by."""
        if not bottleneck:
            return 0.0, self.key
        return float("-inf") if self.margin is None else -self.margin, self.key


def start_path(problem: Problem, node: Node) -> Path:
    """The path that stays at a start node."""
    mode, reference = problem.order[node]
    return Path(((node, 0),), (), Key(NO_COST, 0, Fraction(0), (mode,), (reference,)))


def extended(problem: Problem, path: Path, arc: Arc) -> Path:
    """``path`` and one more switch."""
    key = path.key
    mode, reference = problem.order[arc.target]
    cost = key.cost[0] + arc.cost[0], key.cost[1] + arc.cost[1]
    return Path(
        (*path.states, problem.after(path.states[-1], arc)),
        (*path.arcs, arc),
        Key(
            cost,
            key.switches + 1,
            key.latest + arc.latest,
            (*key.modes, mode),
            (*key.references, reference),
        ),
    )


def best_paths(problem: Problem, k: int) -> list[Path]:
    """The ``k`` best accepted paths in which no state repeats (Yen's algorithm), best first."""
    found: list[Path] = []
    candidates: dict[tuple[State, ...], Path] = {}
    first = _best(problem, [start_path(problem, n) for n in problem.starts], frozenset(), frozenset())
    if first is not None:
        candidates[first.states] = first
    while candidates and len(found) < k:
        path = min(candidates.values(), key=lambda p: p.rank(problem.bottleneck))
        del candidates[path.states]
        found.append(path)
        if len(found) == k:
            break
        for spur in _spurs(problem, path, found):
            candidates.setdefault(spur.states, spur)
    return found


def _spurs(problem: Problem, path: Path, found: Sequence[Path]) -> list[Path]:
    """The best deviation from ``path`` at each of its states, and at the choice of the start."""
    spurs = []
    taken = {p.states[0][0] for p in found}
    spur = _best(
        problem,
        [start_path(problem, n) for n in problem.starts if n not in taken],
        frozenset(),
        frozenset(),
    )
    if spur is not None:
        spurs.append(spur)
    root = start_path(problem, path.states[0][0])
    for i, arc in enumerate(path.arcs):
        closed = frozenset(
            (root.states[-1], p.arcs[i]) for p in found if len(p.arcs) > i and p.states[: i + 1] == root.states
        )
        spur = _best(problem, [root], frozenset(root.states), closed)
        if spur is not None:
            spurs.append(spur)
        root = extended(problem, root, arc)
    return spurs


def _best(
    problem: Problem, roots: Sequence[Path], visited: frozenset[State], closed: frozenset[tuple[State, Arc]]
) -> Path | None:
    """The best accepted continuation of ``roots`` that avoids ``visited`` states and ``closed`` steps."""
    if not problem.bottleneck:
        return _dijkstra(problem, roots, visited, closed, float("-inf"))
    # First the largest margin that still admits a path, then the ties among the arcs that reach it:
    # comparing (margin, ties) label by label would drop prefixes that win after a later bottleneck.
    levels = sorted({arc.margin for arcs in problem.arcs.values() for arc in arcs})
    best = _dijkstra(problem, roots, visited, closed, float("-inf"))
    if best is None or best.margin is None:
        return best
    floor = min((arc.margin for root in roots for arc in root.arcs), default=float("inf"))
    levels = [m for m in levels if best.margin < m <= floor]
    low, high = 0, len(levels)
    while low < high:
        middle = (low + high) // 2
        path = _dijkstra(problem, roots, visited, closed, levels[middle])
        if path is None:
            high = middle
        else:
            best, low = path, middle + 1
    return best


def _dijkstra(
    problem: Problem,
    roots: Sequence[Path],
    visited: frozenset[State],
    closed: frozenset[tuple[State, Arc]],
    least_margin: float,
) -> Path | None:
    ticket = count()
    heap = [(root.key, next(ticket), root) for root in roots]
    heapq.heapify(heap)
    settled: set[tuple[State, int]] = set()
    while heap:
        key, _, path = heapq.heappop(heap)
        state = path.states[-1]
        label = (state, key.switches if problem.max_switches is not None else 0)
        if label in settled:
            continue
        settled.add(label)
        if problem.accepts(state):
            return path
        if problem.max_switches is not None and key.switches >= problem.max_switches:
            continue
        for arc in problem.leaving(state):
            if arc.margin < least_margin or (state, arc) in closed or problem.after(state, arc) in visited:
                continue
            longer = extended(problem, path, arc)
            heapq.heappush(heap, (longer.key, next(ticket), longer))
    return None
