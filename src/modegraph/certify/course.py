"""Following a chain of flows until its goals are decided, or nothing more can be expected of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from modegraph.certify.findings import NoTail
from modegraph.certify.legal import proved_instants, set_size
from modegraph.certify.question import Question
from modegraph.certify.switching.funnel import Arrival, Funnels, Sinking
from modegraph.guarded import guarded
from modegraph.reach.cover import restart
from modegraph.reach.cover.degrees import tail_order
from modegraph.reach.failure import Failure, Mechanism, engine_stopped
from modegraph.reach.flow.flow import RESTART_FEEDBACK, Flow
from modegraph.reach.tail.base import Tail, TailFailure
from modegraph.reach.tail.box import TailSearch
from modegraph.reach.tail.decay import SettledLoop
from modegraph.reach.tail.funnel import NoFunnel

SETTLING = 4.0
"""Time constants of the slowest mode to wait, after a tail is found, before giving up on a target."""
TOO_MUCH_FEEDBACK = 0.5
"""Share of a remainder that comes from itself at which a flow is stopped, where others wait for it."""
WORTH_A_TAIL = 0.7
"""An invariant set is looked for again when the reach set is smaller by this factor."""
STALLED = 0.98
"""A gauge that shrinks by less than this from one look to the next does so no more."""
IDLE_LOOKS = 4
"""Such looks in a row until an invariant set is looked for, where a flow may be enclosed again before."""
FIRST_LOOK = 8
"""Steps until the goals are looked at; from then on a quarter more each time, and LATER_LOOK."""
LATER_LOOK = 4


@dataclass
class Course:
    """One chain of flows, followed as far as its goals need.

    Attributes
    ----------
    flows : the chain, extended in place
    tail : Tail, Sinking or None
        What closes the time axis, or else why there is nothing: ``no_tail``.
    parked : bool
        The last flow wants to be restarted; ``following`` is the flow that may go on alone, if there is one.
    nearest : goal to (gauge, seconds)
        The least gauge at the looks, and when that was.
    """

    question: Question
    flows: list[Flow]
    park: bool
    common: bool
    tail: Tail | Sinking | None = None
    no_tail: NoTail = ()
    parked: bool = False
    following: Flow | None = None
    nearest: dict[int, tuple[float, float]] = field(default_factory=dict)
    _decay: float = np.inf
    _tried: float = np.inf
    _funnels: Funnels | None = None

    def run(self, wanted: Sequence[int], safety: bool) -> Course:
        """Extend the flows until all is decided.

        With ``park`` it stops where the (first) flow wants to be restarted, else it restarts and goes on.
        With ``common`` parked flows are to go on together: one alone is not restarted.
        """
        question, end = self.question, self.question.end
        pending, previous = list(wanted), dict.fromkeys(wanted, np.inf)
        look, taken, idle = FIRST_LOOK, len(self.flows[-1].steps), 0
        while self.flows[-1].time < end and not question.deadline.is_over:
            flow = self.flows[-1]
            # Behind a step without a proof nothing can be used for a switch; the check has failed on this part.
            if not flow.advance(end) or not (flow.steps[-1].face_upper <= 0.0).all():
                break
            taken += 1
            if self._parks(flow, end):
                break
            flow = self.flows[-1]
            if taken < look and flow.time < end:
                continue
            look = int(taken * 1.25) + LATER_LOOK
            question.tick(f"t = {flow.time:.3g} s")
            now = {j: self._gauge(flow, j) for j in pending}
            self.nearest |= {j: min(self.nearest.get(j, (np.inf, 0.0)), (now[j], flow.time)) for j in pending}
            pending = [j for j in pending if not now[j] <= 1.0]
            stalled = all(now[j] > STALLED * previous[j] for j in pending)
            idle = idle + 1 if stalled else 0
            if not self._passes(flow, pending, idle, end):
                self._close(flow, pending)
            if not pending and (self.tail is not None or not safety):
                break
            if stalled and self._settled(flow) and not self._goes_on(flow, pending, end):
                break
            previous = {j: now[j] for j in pending}
        return self

    # -- restarts --------------------------------------------------------------------------------

    def _parks(self, flow: Flow, end: float) -> bool:
        """Whether the chain stops here to be restarted; where it is not to be parked it is restarted at once."""
        waits = self.park and self.common
        if waits and self.question.disturbed and flow.feedback > TOO_MUCH_FEEDBACK:
            self.parked = True
            return True
        if self.question.linear or not flow.wants_restart():
            return False
        if waits:
            self.parked = True
            return True
        first = len(self.flows) == 1 and flow.piece.chart.original
        return self._continued(again(self.question, [flow], first, self.common), end)

    def _continued(self, following: Flow | None, end: float) -> bool:
        """Go on with another flow if there is one; whether the chain is parked before it."""
        if following is None:
            return False
        if self.park:
            self.following, self.parked = following, True
            return True
        self.flows.append(following)
        return False

    def _goes_on(self, flow: Flow, pending: Sequence[int], end: float) -> bool:
        """Whether a chain that has settled outside of its goals is worth following on."""
        sunk = self._sink(flow, pending)
        if isinstance(sunk, Sinking) and any(self._arrives(sunk, j) for j in pending):
            self.tail = sunk
            return False
        if flow.frame is not None or self.question.compiled.framed_fields[0].frame is None:
            return False
        if self.park and self.common:
            self.parked = True
            return False
        following = again(self.question, [flow], False, self.common)
        return following is not None and not self._continued(following, end)

    # -- the end of time -------------------------------------------------------------------------

    def _passes(self, flow: Flow, pending: Sequence[int], idle: int, end: float) -> bool:
        """Whether it is too early for an invariant set: enclosed again, a flow would go on without it."""
        if not (self.park and pending and self.question.disturbed and flow.time < end):
            return False
        return idle < (IDLE_LOOKS if flow.feedback >= RESTART_FEEDBACK else 2)

    def _close(self, flow: Flow, pending: Sequence[int]) -> None:
        """Look for an invariant set around the end of the flow, where the set has got small enough."""
        question, size = self.question, set_size(flow)
        due = flow.time >= self._rest(flow, bool(pending) and question.disturbed)
        if self.tail is not None or not due or not size < WORTH_A_TAIL * self._tried:
            return
        self._tried = size
        compiled = question.compiled
        outcome = guarded(
            "the search for an invariant set",
            lambda: TailSearch(
                flow.fields[-1], flow.piece.chart, compiled.w_centre, compiled.w_radius, compiled.loop.names,
                tail_order(question.linear),
            ).attempt([flow]),
            _no_tail,
        )  # fmt: skip
        if isinstance(outcome, Tail) and outcome.is_legal:
            self.tail, self._decay = outcome, outcome.decay
            return
        missed = Failure(Mechanism.CONSTRAINT_IN_TAIL) if isinstance(outcome, Tail) else outcome
        self.no_tail = (missed,)
        sunk = self._sink(flow, pending) if not pending else None
        if isinstance(sunk, Sinking):
            self.tail, self._decay = sunk, sunk.tail().decay
        elif sunk is not None and sunk.mechanism is not missed.mechanism:
            # Not the same again with other numbers.
            self.no_tail = (missed, sunk)

    def _rest(self, flow: Flow, settling: bool) -> float:
        """From when an invariant set is looked for, seconds: ``settling``, not before the slowest mode has had time."""
        start = self.question.compiled.fields[-1].start
        if not settling or flow.time < start:
            return start
        slowest = -float(np.linalg.eigvals(flow.slope).real.max())
        return start + 1.0 / slowest if slowest > 0.0 else start

    def _settled(self, flow: Flow) -> bool:
        """Whether the slowest mode has had time since the time axis was closed."""
        if self.tail is None or not np.isfinite(self._decay):
            return False
        return flow.time > self.tail.start + SETTLING / self._decay

    def _sink(self, flow: Flow, pending: Sequence[int]) -> Sinking | NoFunnel | None:
        """A funnel that holds the end of a flow and leads into the pending targets if possible; None: not tried."""
        question, last = self.question, self.question.compiled.fields[-1]
        if question.linear or not (last.autonomous and np.isinf(last.end)):
            return None
        goals = [question.goals[j] for j in pending]
        compiled = question.compiled

        def work() -> Sinking | NoFunnel:
            if self._funnels is None:
                loop = SettledLoop(last, compiled.w_centre, compiled.w_radius, *flow.piece.unknown_ranges)
                self._funnels = Funnels(loop, question.deadline)
            return self._funnels.enter(flow, [goal.region for goal in goals if goal.reset is None])

        return guarded("the search for a funnel", work, _no_funnel)

    def _arrives(self, sinking: Sinking, j: int) -> bool:
        goal = self.question.goals[j]
        return goal.reset is None and isinstance(sinking.arrival(goal.region, self.question.end), Arrival)

    def _gauge(self, flow: Flow, j: int) -> float:
        """Of the end of a flow, in the target of goal j; inf where that takes more than a look."""
        goal = self.question.goals[j]
        if goal.reset is not None:
            return np.inf
        last = flow.last_set.project(goal.region.dim)
        return guarded(
            "a look at a target",
            lambda: goal.region.gauge(last),
            lambda error: np.inf,
        )


def _no_tail(error: Exception) -> Tail | TailFailure:
    mechanism, fields = engine_stopped(error)
    return TailFailure(mechanism, **fields)


def _no_funnel(error: Exception) -> Sinking | NoFunnel | None:
    mechanism, fields = engine_stopped(error)
    return NoFunnel(mechanism, **fields)


def again(question: Question, last: Sequence[Flow], first: bool, common: bool) -> Flow | None:
    """A flow around the ends of flows (`restart.again`) whose first step is proved to keep the constraints."""
    return restart.again(
        question.compiled, last, question.end, first=first, common=common,
        legal=lambda flow: proved_instants(flow) == len(flow.steps),
    )  # fmt: skip
