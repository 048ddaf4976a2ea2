"""``ModeGraph.explain``: what the proofs have shown of one switch, and a search for changes that would give it."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from numbers import Real
from typing import TYPE_CHECKING, Any

from modegraph.certify.counterexamples.witnessed import witnessed
from modegraph.certify.verdict import Approach, Status, Unproved, Verdict
from modegraph.deadline import Deadline
from modegraph.errors import ModegraphError
from modegraph.explain.explanation import Blocking, Explanation, explanation_text
from modegraph.explain.pair import Pair
from modegraph.explain.repairs import LATE, RepairSearch, attempt
from modegraph.model.mode import Mode

if TYPE_CHECKING:
    from modegraph.graph.modegraph import ModeGraph


WITNESS_SECONDS = 5.0
"""For following the trajectory of a counterexample, which takes much less as a rule, whatever time is allowed."""


def explained(graph: ModeGraph, i: str, j: str, verdict: Verdict, r_i: Any, r_j: Any, seconds: float) -> Explanation:
    """The explanation of a verdict; whatever is known when the time is over, or at an interrupt, is told."""
    if isinstance(seconds, bool) or not isinstance(seconds, Real) or not 0 <= seconds < math.inf:
        raise ModegraphError(f"explain: seconds must be a finite number >= 0, not {seconds!r}")
    told = Explanation(i, j, verdict)
    case = graph.deciding(i, j, r_i, r_j)
    if case is not None:
        told = _Explainer(graph, told, *case, time.monotonic() + float(seconds)).run()
    several = graph.has_choice(i) or graph.has_choice(j)
    return replace(told, text=explanation_text(told, several))


class _Explainer:
    """Fills in an explanation, the cheapest first."""

    def __init__(self, graph: ModeGraph, told: Explanation, r_i: Any, r_j: Any, verdict: Verdict, end: float) -> None:
        source, target = graph.modes[told.source], graph.modes[told.target]
        assert isinstance(source, Mode)
        self.pair = Pair.of(tuple(graph.modes.values()), source, target, r_i, r_j, graph.horizon)
        self.classes = any(name in graph.regions for name in (told.source, told.target))
        self.told = replace(told, r_i=r_i, r_j=r_j)
        self.verdict, self.end = verdict, end
        self.unproved: Unproved | None = verdict.unproved

    def run(self) -> Explanation:
        try:
            self._approach()
            if self.verdict.status is not Status.CERTIFIED:
                self._repair()
        except KeyboardInterrupt:
            self._note("interrupted before all was tried")
        return self.told

    # -- what stands in the way ------------------------------------------------------------------

    def _approach(self) -> None:
        reach = self.verdict.closest
        if reach is None and self.verdict.status is Status.CERTIFIED and not self._is_over:
            again = attempt(lambda: self.pair.proved(self.end))
            reach = again.closest if again.status is Status.CERTIFIED else None
        self._reached(reach)
        witness = self.verdict.witness
        if witness is None:
            return
        self.told = replace(self.told, worst_start=witness.x0, worst_start_is="counterexample")
        try:
            closest, breach = witnessed(
                self.pair.source, self.pair.r_i, witness, self.pair.spec,
                horizon=self.pair.source.horizon, deadline=Deadline(WITNESS_SECONDS),
            )  # fmt: skip
        except ModegraphError:
            return
        if closest is not None:
            self.told = replace(self.told, closest=closest, block=_face(closest))
        if breach is not None:
            self.told = replace(self.told, block=_constraint(breach))

    def _reached(self, reach: Approach | None) -> None:
        """Note how near the reach set comes; a counterexample says more of where it starts and what it misses."""
        if reach is None:
            return
        self.told = replace(self.told, reach=reach)
        if self.told.worst_start_is != "counterexample":
            origin = reach.origin if reach.origin != "witness" else "counterexample"
            self.told = replace(self.told, closest=reach, worst_start=reach.start, worst_start_is=origin)
        if self.told.block is None:
            self.told = replace(self.told, block=_face(reach))

    # -- what would help -------------------------------------------------------------------------

    def _repair(self) -> None:
        if self._is_over:
            self._note("no repair was tried: no time was allowed")
            return
        search = RepairSearch(self.pair, self.end)
        try:
            if self.told.reach is None:
                again = search.as_it_is(self.classes)
                if again.status is Status.CERTIFIED:
                    return
                self.unproved = self.unproved or again.unproved
                self._reached(again.closest)
            self._blame()
            search.reach = self.told.reach
            search.gauge = None if self.told.closest is None else self.told.closest.gauge
            if self._is_late:
                search.longer()
            search.larger()
            search.smaller()
        finally:
            self.told = replace(self.told, repairs=tuple(search.found), notes=(*self.told.notes, *search.notes))
        for repair in search.found:
            if repair.kind == "horizon" and self.pair.source.horizon is not None:
                now = self.pair.source.horizon
                self.told = replace(
                    self.told, block=Blocking("horizon", f"the horizon of {now:g} s", repair.value - now, "s")
                )

    def _blame(self) -> None:
        """Whether it is the constraint that could not be proved: then the switch is there without it."""
        if self.unproved is None or self.verdict.status is Status.REFUTED:
            return
        now = time.monotonic()
        free = attempt(lambda: self.pair.unconstrained().proved(now + 0.25 * max(0.0, self.end - now)))
        if free.status is Status.CERTIFIED:
            self.told = replace(self.told, block=_constraint(self.unproved))

    @property
    def _is_late(self) -> bool:
        """Whether the approach is closest near the end of the horizon."""
        near, horizon = self.told.closest, self.pair.source.horizon
        witness = self.verdict.witness
        if horizon is None or near is None or (witness is not None and witness.kind != "horizon"):
            return False
        return near.time >= LATE * horizon

    @property
    def _is_over(self) -> bool:
        return time.monotonic() >= self.end

    def _note(self, text: str) -> None:
        self.told = replace(self.told, notes=(*self.told.notes, text))


def _face(a: Approach) -> Blocking:
    return Blocking("face", a.face, a.missing, a.unit, a.time)


def _constraint(u: Unproved) -> Blocking:
    return Blocking("constraint", f"constraint {u.constraint!r}", u.by, "", u.time)
