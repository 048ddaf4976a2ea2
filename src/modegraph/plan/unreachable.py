"""Why there is no plan: what can be reached, and which undecided pairs stand in the way."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import TYPE_CHECKING

from modegraph.certify.verdict import Status
from modegraph.errors import Unreachable
from modegraph.plan.search import Problem, State

if TYPE_CHECKING:
    from modegraph.graph.modegraph import ModeGraph, Node

Step = tuple[State, int]
"""A state of the search and the number of switches so far (0 where they are not limited)."""


def unreachable(graph: ModeGraph, problem: Problem, start: str | None, goal: str) -> Unreachable:
    """The error for a problem without a path.

    ``helpful`` lists the undecided pairs on those chains that take the fewest of them (a pair that
    ``via`` makes a chain take twice counts twice). It is empty iff there would be no chain even if
    every undecided pair were certified.
    """
    moves = _Moves(graph, problem)
    fewest = moves.fewest_undecided()
    reached = {state[0][0] for (state, _), needed in fewest.items() if needed == 0}
    reachable = [name for name in graph.modes if name in reached]
    helpful = _helpful(graph, problem, moves, fewest)
    return Unreachable(_message(problem, start, goal, reachable, helpful), reachable=reachable, helpful=helpful)


class _Moves:
    """The switches a plan might take if undecided pairs were certified."""

    def __init__(self, graph: ModeGraph, problem: Problem) -> None:
        self.problem = problem
        self.certified: dict[Node, list[Node]] = {}
        self.undecided: dict[Node, list[Node]] = {}
        self.instant: set[tuple[Node, Node]] = set()
        for arc in (arc for arcs in problem.arcs.values() for arc in arcs if arc.target[0] not in problem.avoid):
            self.certified.setdefault(arc.source, []).append(arc.target)
            if arc.latest == 0:
                self.instant.add((arc.source, arc.target))
        for (source, target), v in graph.pair_verdicts().items():
            if v.status is Status.UNDECIDED and target[0] not in problem.avoid:
                self.undecided.setdefault(source, []).append(target)

    def starts(self) -> list[Step]:
        return [((node, 0), 0) for node in self.problem.starts]

    def after(self, step: Step) -> Iterator[tuple[Step, int]]:
        """Steps one switch on, with 1 for an undecided pair and 0 for a certified one."""
        (node, done), switches = step
        limit = self.problem.max_switches
        if limit is not None and switches >= limit:
            return
        via = self.problem.via
        for targets, undecided in ((self.certified, 0), (self.undecided, 1)):
            for target in targets.get(node, ()):
                counts = done < len(via) and via[done] == node[0] and (node, target) not in self.instant
                yield ((target, done + counts), 0 if limit is None else switches + 1), undecided

    def fewest_undecided(self) -> dict[Step, int]:
        """For each step that can be reached at all, how many undecided pairs it takes (0-1 search)."""
        best = dict.fromkeys(self.starts(), 0)
        queue = deque(best)
        while queue:
            step = queue.popleft()
            for following, undecided in self.after(step):
                needed = best[step] + undecided
                if needed < best.get(following, needed + 1):
                    best[following] = needed
                    (queue.append if undecided else queue.appendleft)(following)
        return best


def _helpful(graph: ModeGraph, problem: Problem, moves: _Moves, fewest: dict[Step, int]) -> list[tuple[str, str]]:
    ends = {step: needed for step, needed in fewest.items() if problem.accepts(step[0])}
    if not ends:
        return []
    least = min(ends.values())
    before: dict[Step, list[tuple[Step, int]]] = {}
    for step in fewest:
        for following, undecided in moves.after(step):
            if fewest[step] + undecided == fewest[following]:
                before.setdefault(following, []).append((step, undecided))
    pairs: set[tuple[str, str]] = set()
    queue = [step for step, needed in ends.items() if needed == least]
    seen = set(queue)
    while queue:
        step = queue.pop()
        for earlier, undecided in before.get(step, ()):
            if undecided:
                pairs.add((earlier[0][0][0], step[0][0][0]))
            if earlier not in seen:
                seen.add(earlier)
                queue.append(earlier)
    return [(i, j) for i in graph.modes for j in graph.modes if (i, j) in pairs]


def _message(
    problem: Problem, start: str | None, goal: str, reachable: list[str], helpful: list[tuple[str, str]]
) -> str:
    if not problem.starts:
        where = "any mode" if start is None else f"mode {start!r}"
        return f"no plan to {goal!r}: the state x0 is in no start set of {where}"
    conditions = []
    if problem.via:
        conditions.append("via " + ", ".join(problem.via))
    if problem.avoid:
        conditions.append("avoiding " + ", ".join(sorted(problem.avoid)))
    if problem.max_switches is not None:
        conditions.append(f"with at most {problem.max_switches} switches")
    origin = "x0" if start is None else repr(start)
    asked = "".join(f" {c}" for c in conditions)
    text = f"no chain of certified switches from {origin} to {goal!r}{asked}; reachable: {', '.join(reachable)}"
    if helpful:
        return text + "; undecided pairs that would help: " + ", ".join(f"{i} -> {j}" for i, j in helpful)
    return text + "; no undecided pair could help"
