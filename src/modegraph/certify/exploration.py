"""Flowpipes of the parts of one start set, cut as far as the questions need."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.evidence import lasting, sampled_violation, set_size, slack_until, unproved
from modegraph.certify.findings import Findings, NoTail, better, ended, filled, merge
from modegraph.certify.proof import SafetyProof, SwitchProof, least_slack
from modegraph.certify.switching.common_time import Missed, Reach, find_crossings, proved_instants, widest_variable
from modegraph.certify.switching.funnel import Arrival, Funnels, Sinking
from modegraph.certify.targets.region import Region
from modegraph.cores import in_parallel
from modegraph.enclosure.monomials import monomial_count
from modegraph.expression.tape import Tape
from modegraph.reach.cover.cuts import nonlinear_variable, parts_of_refused
from modegraph.reach.cover.restart import WIDE_GAP, filled_share, restarted
from modegraph.reach.failure import Failure, Mechanism
from modegraph.reach.field import Field
from modegraph.reach.flow.flow import RESTART_FEEDBACK, RESTART_STEPS, Flow, Order
from modegraph.reach.parallelotope import mode_gap
from modegraph.reach.start.piece import Piece
from modegraph.reach.tail.box import Tail, TailSearch
from modegraph.reach.tail.decay import SettledLoop
from modegraph.reach.tail.funnel import NoFunnel

Floats = NDArray[np.float64]

LADDER = ((4, 3), (5, 4))
"""Degrees of p and of the Jacobian flow: first try, and second try where the first breaks down."""
MOST_MONOMIALS = 1300
MOST_GENERATOR_MONOMIALS = 100
MOST_PARTS = 48
DEEPEST_CUT = 7
SETTLING = 4.0
"""Time constants of the slowest mode to wait, after a tail is found, before giving up on a target."""
TOO_MUCH_FEEDBACK = 0.5
FAR = 2.0
"""A flow that waits or is given up is not compared with targets it was never nearer to than this, at any look."""
WORTH_A_TAIL = 0.7
"""An invariant set is looked for again when the reach set is smaller by this factor."""
STALLED = 0.98
"""A gauge that shrinks by less than this from one look to the next does so no more."""
IDLE_LOOKS = 4
"""Such looks in a row until an invariant set is looked for, where a flow may be enclosed again before."""
LOOKS = 400
"""Steps within the horizon, at least, for a linear loop, where they cost little; else half of that."""
LONGEST = 1000.0
"""Seconds of flow after which a mode without horizon and without a tail is given up."""


@dataclass
class Course:
    """How far a chain of flows was followed.

    ``tail``, or why there is none (``no_tail``); whether the (first) flow wants to be restarted (``parked``);
    the least gauge of each target at the looks, and when that was (``nearest``).
    """

    tail: Tail | Sinking | None = None
    no_tail: NoTail = ()
    parked: bool = False
    nearest: dict[int, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class Goal:
    """One target as the exploration sees it."""

    region: Region
    reset: Tape | None


class Exploration:
    """Parts, orders and budgets of one (mode, reference)."""

    def __init__(
        self,
        fields: Sequence[Field],
        framed: Callable[[], Sequence[Field]],
        goals: Mapping[int, Goal],
        *,
        plant: int,
        w: tuple[Floats, Floats],
        names: Sequence[str],
        reset: Tape | None,
        horizon: float | None,
        stops: Sequence[float],
        deadline: float,
        tick: Callable[[str], None],
        until: float = np.inf,
    ) -> None:
        """``framed`` makes the fields in the frame of the modes; ``until``: seconds after which nothing is
        looked at, the steps being those of the horizon."""
        self.until = until
        self.fields, self.goals, self.plant = fields, goals, plant
        self._make_framed, self._one_at_a_time = framed, Lock()
        self._framed: Sequence[Field] | None = None
        self.w_centre, self.w_radius = w
        self.names, self.reset, self.horizon, self.stops = names, reset, horizon, stops
        self.deadline, self.tick = deadline, tick
        self.parts = 0
        self.continued: dict[Flow, Flow] = {}
        self.chains: dict[Flow, Findings] = {}
        self.linear = all(f.linear for f in fields)
        self.common = all(f.autonomous for f in fields)
        """Parked flows are to go on together, one alone is not looked at. Possible where time does not matter:
        they go on from the latest of their instants, and their trajectories are there earlier."""
        self.refused = False
        """A flow was not parked because its remainder fed itself too much."""
        self._funnels: dict[tuple[float, ...], Funnels] = {}

    @property
    def framed(self) -> Sequence[Field]:
        """The fields in the frame of the modes: few loops ever need them."""
        with self._one_at_a_time:
            if self._framed is None:
                self._framed = self._make_framed()
            return self._framed

    def funnels(self, piece: Piece) -> Funnels | None:
        """Funnels for the unknowns of a piece; None where the loop never stops depending on time."""
        last = self.fields[-1]
        if not (last.autonomous and np.isinf(last.end)):
            return None
        lo, hi = piece.unknown_ranges
        key = (*lo.tolist(), *hi.tolist())
        if key not in self._funnels:
            self._funnels[key] = Funnels(SettledLoop(last, self.w_centre, self.w_radius, lo, hi))
        return self._funnels[key]

    # -- orders ----------------------------------------------------------------------------------

    def order(self, piece: Piece, effort: int) -> Order:
        """Degrees for a piece: linear loops need 1; more effort, higher degree, as memory allows."""
        m = piece.variables
        if self.linear or m == 0:
            return Order(1, 0)
        degree, jacobian = LADDER[effort]
        while degree > 3 and monomial_count((1,) * m, degree) > MOST_MONOMIALS:
            degree -= 1
        while jacobian > 1 and monomial_count((1,) * m, jacobian) > MOST_GENERATOR_MONOMIALS:
            jacobian -= 1
        return Order(degree, min(jacobian, degree - 1))

    # -- one part --------------------------------------------------------------------------------

    def try_alone(self, found: Findings) -> None:
        """Go on with a parked flow until it is decided or wants another restart; undo the parking where
        that breaks down: its part of the starts is too large then."""
        flow = found.parked[0]
        part = self.follow([self.continued[flow]], [[flow]], found, park=True)
        assert part.last is not None
        if part.failure or part.unproved or part.last.feedback > TOO_MUCH_FEEDBACK:
            found.unpark(part.failure or part.unproved or filled(part.last))
            return
        self.chains[flow] = part

    def follow(self, flows: list[Flow], before: Sequence[Sequence[Flow]], found: Findings, park: bool) -> Findings:
        """What flows show that go on from the ends of the chains before them, of what ``found`` waits for."""
        wanted = list(found.waiting)
        safety = found.waiting_safety is not None
        course = self._advance(flows, wanted, safety, self.end(), park=park)
        part = self._findings(flows, wanted, course, safety, before=before)
        if course.parked and proved_instants(flows[-1]) == len(flows[-1].steps):
            part.parked = [*(flow for chain in before for flow in chain), *flows]
        return part

    def explore(self, piece: Piece, wanted: Sequence[int], safety: bool, effort: int = 0) -> Findings:
        """Decide the wanted goals (and the check) on one part, cutting it where that helps."""
        self.parts += 1
        found = self._run(piece, wanted, safety, effort)
        if found.parked and not self.common:
            self.try_alone(found)
        left = [j for j in wanted if j not in found.proofs and j not in found.waiting]
        again, check_again = self._worth_refining(found, left, safety)
        done = not again and not check_again
        if done or time.monotonic() > self.deadline or self.parts >= MOST_PARTS:
            return found
        cut_short = bool(found.failure or found.unproved)
        # A part whose remainder feeds itself is cut: smaller ones need no high degrees.
        finer = cut_short and not (found.refused and piece.depth > 0)
        if finer and effort + 1 < len(LADDER) and self.order(piece, effort + 1) != self.order(piece, effort):
            second = self.explore(piece, again, check_again, effort + 1)
            return merge(found, [second], again, check_again)
        if piece.depth >= DEEPEST_CUT or piece.variables == 0:
            return found
        flow = found.flow
        assert flow is not None
        # No pieces: this one is proved to hold no start, though only now that it is cut.
        if found.refused:
            pieces = parts_of_refused(flow, DEEPEST_CUT)
        elif cut_short:
            pieces = piece.split(nonlinear_variable(flow))
        else:
            pieces = piece.split(widest_variable(flow.bounds, flow.set_at(0)[0]))
        children: list[Findings] = []
        effort = 0 if found.refused else effort
        tasks = [partial(self.explore, child, again, check_again, effort) for child in pieces]
        for child in in_parallel(tasks):
            children.append(child)
            lost = not child.empty and not better(child, found, again, check_again)
            if lost and piece.chart.sublevel is None and flow.astride is None:
                # Smaller starts get no further: the disturbance, not the size of the start, is in the way.
                # At a kink a cut leaves a part astride of it, which may get no further yet.
                return found
        return merge(found, children, again, check_again)

    def _worth_refining(self, found: Findings, left: Sequence[int], safety: bool) -> tuple[list[int], bool]:
        """Goals for which smaller parts may succeed, and whether the check may."""
        hopeful = {j for j in left if found.missed[j].hopeful}
        if found.broken:
            return sorted(hopeful), False
        cut_short = bool(found.failure or found.unproved)
        if cut_short:
            hopeful |= set(left)
        return sorted(hopeful), safety and found.safety is None and cut_short

    def _run(self, piece: Piece, wanted: Sequence[int], safety: bool, effort: int) -> Findings:
        order = self.order(piece, effort)
        flow = Flow(
            self.fields, piece, self.w_centre, self.w_radius, order,
            names=self.names, reset=self.reset, stops=self.stops, longest_step=self._longest_step(),
        )  # fmt: skip
        course = self._advance([flow], wanted, safety, self.end(), park=True)
        found = self._findings([flow], wanted, course, safety)
        if course.parked and proved_instants(flow) == len(flow.steps):
            if self.common and flow.feedback > TOO_MUCH_FEEDBACK:
                self.refused = found.refused = True
                found.failure = filled(flow)
                return found
            found.parked = [flow]
            found.waiting = {j: [] for j in wanted if j not in found.proofs}
            if safety and found.safety is None:
                found.waiting_safety = []
        return found

    def end(self) -> float:
        """Instant at which a flow is given up, seconds."""
        return min(self.until, LONGEST if self.horizon is None else self.horizon)

    def _advance(self, flows: list[Flow], wanted: Sequence[int], safety: bool, end: float, park: bool) -> Course:
        """Extend a chain of flows until everything is decided or nothing more can be expected.

        With ``park`` it stops where the (first) flow wants to be restarted, else it restarts and goes on.
        """
        flow = flows[-1]
        course = Course()
        decay = np.inf
        previous = dict.fromkeys(wanted, np.inf)
        pending = list(wanted)
        checkpoint = 8
        tried = np.inf
        idle = 0
        disturbed = not self.linear and bool(self.w_radius.any())
        taken = len(flow.steps)
        while flow.time < end and time.monotonic() < self.deadline:
            if not flow.advance(end):
                break
            if not (flow.steps[-1].face_upper <= 0.0).all():
                # Nothing later can be used for a switch; the check has failed on this part.
                break
            taken += 1
            if park and self.common and disturbed and flow.feedback > TOO_MUCH_FEEDBACK:
                return replace(course, parked=True)
            if not self.linear and flow.wants_restart():
                if park and self.common:
                    return replace(course, parked=True)
                following = self.again([flow], end, first=len(flows) == 1 and flow.piece.chart.original)
                if following is not None:
                    if park:
                        self.continued[flow] = following
                        return replace(course, parked=True)
                    flows.append(following)
                    flow = following
            if taken < checkpoint and flow.time < end:
                continue
            checkpoint = int(taken * 1.25) + 4
            self.tick(f"t = {flow.time:.3g} s")
            now = {j: self._gauge_now(flow, j) for j in pending}
            course.nearest |= {j: min(course.nearest.get(j, (np.inf, 0.0)), (now[j], flow.time)) for j in pending}
            pending = [j for j in pending if not now[j] <= 1.0]
            stalled = all(now[j] > STALLED * previous[j] for j in pending)
            idle = idle + 1 if stalled else 0
            # Enclosed again, a flow would go on without what was found.
            patience = IDLE_LOOKS if flow.feedback >= RESTART_FEEDBACK else 2
            passing = park and pending and disturbed and idle < patience and flow.time < end
            size = set_size(flow)
            due = flow.time >= self._rest(flow, bool(pending) and disturbed)
            if course.tail is None and due and not passing and size < WORTH_A_TAIL * tried:
                search = TailSearch(
                    flow.fields[-1], flow.piece.chart, self.w_centre, self.w_radius, self.names, self._tail_order()
                )
                outcome = search.attempt([flow])
                if isinstance(outcome, Tail) and (outcome.face_upper <= 0.0).all():
                    course.tail, decay = outcome, outcome.decay
                else:
                    missed = Failure(Mechanism.CONSTRAINT_IN_TAIL) if isinstance(outcome, Tail) else outcome
                    course.no_tail = (missed,)
                    sunk = self._sink(flow, pending) if not pending else None
                    if isinstance(sunk, Sinking):
                        course.tail, decay = sunk, sunk.tail().decay
                    elif sunk is not None and sunk.mechanism is not missed.mechanism:
                        # Not the same again with other numbers.
                        course.no_tail = (missed, sunk)
                tried = size
            if not pending and (course.tail is not None or not safety):
                break
            settled = (
                course.tail is not None and np.isfinite(decay) and flow.time > course.tail.start + SETTLING / decay
            )
            if settled and stalled:
                sinking = self._sink(flow, pending)
                if isinstance(sinking, Sinking) and any(self._arrives(sinking, j) for j in pending):
                    course.tail = sinking
                    break
                if flow.frame is not None or self.framed[0].frame is None:
                    break
                if park and self.common:
                    return replace(course, parked=True)
                following = self.again([flow], end)
                if following is None:
                    break
                if park:
                    self.continued[flow] = following
                    return replace(course, parked=True)
                flows.append(following)
                flow = following
            previous = {j: now[j] for j in pending}
        return course

    def _rest(self, flow: Flow, settling: bool) -> float:
        """From when an invariant set is looked for, seconds: ``settling``, not before the slowest mode has had time."""
        start = self.fields[-1].start
        if not settling or flow.time < start:
            return start
        slowest = -float(np.linalg.eigvals(flow.slope).real.max())
        return start + 1.0 / slowest if slowest > 0.0 else start

    def again(self, last: Sequence[Flow], end: float, first: bool = False) -> Flow | None:
        """Restart around the ends of flows: in the coordinates of the plant, then in the frame of the modes.

        The first holds out longer while the set is large, the second is tighter in the end, and at
        once where fast and slow modes are far apart (measured on the arm: 5 against 16). None where
        the restart breaks down at once.
        """
        flow = last[0]
        framed = not first or mode_gap(flow.slope) > WIDE_GAP
        compact = self.common and (flow.generation == 0 or filled_share(flow) > 1.0)
        following = restarted(last, self.framed if framed else self.fields, compact=compact)
        started = following is not None and following.time < end and following.advance(end)
        if following is not None and started and proved_instants(following) == len(following.steps):
            return following
        flow.next_restart = len(flow.steps) + RESTART_STEPS
        return None

    def _sink(self, flow: Flow, pending: Sequence[int]) -> Sinking | NoFunnel | None:
        """A funnel that holds the end of a flow and leads into the pending targets if possible; None: not tried."""
        funnels = self.funnels(flow.piece)
        if funnels is None or self.linear:
            return None
        return funnels.enter(flow, [self.goals[j].region for j in pending if self.goals[j].reset is None])

    def _arrives(self, sinking: Sinking, j: int) -> bool:
        goal = self.goals[j]
        return goal.reset is None and isinstance(sinking.arrival(goal.region, self.end()), Arrival)

    def _longest_step(self) -> float:
        """A crossing is looked for at the ends of steps only: enough of them within the horizon."""
        return np.inf if self.horizon is None else self.horizon / (LOOKS if self.linear else LOOKS / 2)

    def _tail_order(self) -> Order:
        return Order(1, 0) if self.linear else Order(3, 2)

    def _gauge_now(self, flow: Flow, j: int) -> float:
        goal = self.goals[j]
        if goal.reset is not None:
            return np.inf
        p, G = flow.state_set(len(flow.steps))
        n = goal.region.dim
        return float(goal.region.gauges(flow.bounds, p[None, :n], [G[:, :n]])[0])

    def _findings(
        self,
        flows: Sequence[Flow],
        wanted: Sequence[int],
        course: Course,
        safety: bool,
        before: Sequence[Sequence[Flow]] = (),
    ) -> Findings:
        """What a chain of flows shows; each but the first starts around the end of the one before.

        The first starts around the ends of the chains ``before``, if there are any.
        """
        flow = flows[-1]
        found = Findings(flow=flows[0], last=flow, no_tail=course.no_tail)
        tail = course.tail
        # The first flow that is not proved to its end, if there is one.
        short = next((f for f in flows if proved_instants(f) < len(f.steps)), flow)
        proved = proved_instants(short)
        found.failure = None if flow.failure is None else ended(flow.failure)
        if proved < len(short.steps):
            found.unproved = unproved(short, proved)
            found.broken = len(flows) == 1 and not before and sampled_violation(flow)
        found.safe_until = float(short.times[proved]) if proved >= 0 else float(short.times[0])
        for j in wanted:
            gauge, when = course.nearest.get(j, (0.0, 0.0))
            if course.parked and gauge > FAR:
                found.missed[j] = Missed(gauge, when, True, flow.piece.middle)
                continue
            outcome = self._crossing(flows, j, tail if isinstance(tail, Sinking) else None, before)
            if isinstance(outcome, Missed):
                found.missed[j] = outcome
            else:
                found.proofs[j] = outcome
        if safety and proved == len(short.steps) and flow.failure is None:
            found.safety = self._safety(flows, tail.tail() if isinstance(tail, Sinking) else tail, before)
        return found

    def _crossing(
        self, flows: Sequence[Flow], j: int, sinking: Sinking | None, before: Sequence[Sequence[Flow]] = ()
    ) -> SwitchProof | Missed:
        goal = self.goals[j]
        best: Missed | None = None
        past = [flow for chain in before for flow in chain]
        slack = [slack_until(f, len(f.steps)) for f in past]
        seen = [Reach(f, self.horizon, goal.reset).earliest(goal.region, self.plant) for f in past]
        earliest = min((t for t in seen if t is not None), default=None)
        # Chains end at instants of their own; their common flow has the clock of the last, the others are ahead of it.
        ends = [chain[-1].time for chain in before]
        begin = float(flows[0].times[0])
        ahead = 0.0 if all(end == begin for end in ends) else float(np.nextafter(begin - min(ends), np.inf))
        for flow in flows:
            reach = Reach(flow, self.horizon, goal.reset)
            touched = reach.earliest(goal.region, self.plant)
            if touched is not None:
                touched = max(0.0, float(np.nextafter(touched - ahead, -np.inf)))
                earliest = touched if earliest is None else min(earliest, touched)
            outcome = find_crossings(reach, goal.region)
            if not isinstance(outcome, Missed):
                first = max(0.0, float(np.nextafter(min(c.time for c in outcome) - ahead, -np.inf)))
                latest = max(c.instant for c in outcome)
                return SwitchProof(
                    earliest=float(first if earliest is None else min(earliest, first)),
                    latest=max(c.time for c in outcome),
                    margin=min(1.0 - c.best for c in outcome),
                    window=min(c.window for c in outcome),
                    energy=max(c.energy for c in outcome),
                    slack=least_slack([*slack, slack_until(flow, latest)]),
                    parts=len(outcome),
                    nearest=max(outcome, key=lambda c: c.best).nearest,
                )
            if best is None or outcome.gauge < best.gauge:
                first = flow is flows[0] and not before
                best = outcome if first else replace(outcome, start=(*past, *flows)[0].piece.middle, sampled=False)
            if proved_instants(flow) < len(flow.steps):
                break
            slack.append(slack_until(flow, len(flow.steps)))
        assert best is not None
        last = flows[-1]
        # The search goes on by the bounds of whole steps: starts and breakpoints may lack a proof in any flow.
        if sinking is None or goal.reset is not None or any(proved_instants(f) < len(f.steps) for f in flows):
            return best
        arrival = sinking.arrival(goal.region, self.end())
        if isinstance(arrival, Missed):
            closer = replace(arrival, start=best.start, hopeful=best.hopeful, sampled=best.sampled)
            return closer if arrival.gauge < best.gauge else best
        arrived = float(np.nextafter(sinking.start + arrival.seconds, np.inf))
        spent = float(last.seen_bounds.upper(last.steps[-1].energy) + last.steps[-1].energy_radius)
        return SwitchProof(
            earliest=max(0.0, float(np.nextafter(sinking.start - ahead, -np.inf))) if earliest is None else earliest,
            latest=arrived,
            margin=1.0 - arrival.best,
            window=np.inf,
            energy=float(np.nextafter(spent + arrival.energy, np.inf)),
            slack=least_slack([*slack, sinking.slack()]),
            parts=1,
            nearest=arrival.nearest,
            sinks=True,
        )

    def _safety(
        self, flows: Sequence[Flow], tail: Tail | None, before: Sequence[Sequence[Flow]] = ()
    ) -> SafetyProof | None:
        flow = flows[-1]
        last = flow.fields[-1]
        if tail is None:
            if self.linear and not last.faces and flow.time >= last.start:
                # A linear loop has a solution for all time, and there is nothing else to prove.
                return SafetyProof({}, flow.time, np.full(last.outputs, np.inf))
            return None
        return lasting([*(flow for chain in before for flow in chain), *flows], tail)
