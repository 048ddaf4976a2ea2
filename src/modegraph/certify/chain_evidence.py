"""What a chain of flows, followed as far as it goes, proves of its goals and of Assumption 1."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from modegraph.certify.course import Course
from modegraph.certify.findings import Findings, Waiting, ended
from modegraph.certify.lasting import BehindFlows, NothingToKeep
from modegraph.certify.legal import proved_instants, sampled_violation, unproved
from modegraph.certify.proof import SafetyProof, SwitchProof
from modegraph.certify.question import Goal, Question
from modegraph.certify.switching.base import Way
from modegraph.certify.switching.common_time import CommonTimes, Missed, Reach, find_crossings
from modegraph.certify.switching.funnel import Arrival, Sinking, Sunk
from modegraph.guarded import guarded
from modegraph.reach.flow.flow import Flow
from modegraph.reach.tail.base import Tail

FAR = 2.0
"""A flow that waits or is given up is not compared with targets it was never nearer to than this, at any look."""


@dataclass(frozen=True)
class Past:
    """The chains of flows around whose ends another flow begins.

    They end at instants of their own; the flow has the clock of the last, so that trajectories of the others are
    up to ``ahead`` seconds earlier than its clock says.
    """

    chains: Sequence[Sequence[Flow]]

    @property
    def flows(self) -> list[Flow]:
        return [flow for chain in self.chains for flow in chain]

    def ahead(self, begin: float) -> float:
        """Seconds, rounded up, for a flow that begins at ``begin``: not before any of the chains has ended."""
        ends = [chain[-1].time for chain in self.chains]
        if all(end == begin for end in ends):
            return 0.0
        return float(np.nextafter(begin - min(ends), np.inf))


NOTHING = Past(())


def findings_of(course: Course, wanted: Sequence[int], safety: bool, past: Past = NOTHING) -> Findings:
    """What a course shows of the goals; its first flow starts around the ends of the chains of the past."""
    flows, tail = course.flows, course.tail
    flow = flows[-1]
    found = Findings(flow=flows[0], last=flow, no_tail=course.no_tail)
    # The first flow that is not proved to its end, if there is one.
    short = next((f for f in flows if proved_instants(f) < len(f.steps)), flow)
    proved = proved_instants(short)
    found.failure = None if flow.failure is None else ended(flow.failure)
    if proved < len(short.steps):
        found.unproved = unproved(short, proved)
        found.broken = len(flows) == 1 and not past.chains and sampled_violation(flow)
    found.safe_until = float(short.times[proved]) if proved >= 0 else float(short.times[0])
    for j in wanted:
        gauge, when = course.nearest.get(j, (0.0, 0.0))
        if course.parked and gauge > FAR:
            found.missed[j] = Missed(gauge, when, True, flow.piece.middle)
            continue
        outcome = guarded(
            "the proof of a switch",
            partial(_proved, course, j, past),
            lambda error: Missed(np.inf, 0.0, False, flow.piece.middle),
        )
        if isinstance(outcome, Missed):
            found.missed[j] = outcome
        else:
            found.proofs[j] = outcome
    if safety and proved == len(short.steps) and flow.failure is None:
        closed = tail.tail() if isinstance(tail, Sinking) else tail
        found.safety = _safety(course.question, [*past.flows, *flows], closed)
    if course.parked and proved_instants(flow) == len(flow.steps):
        found.waits = [Waiting([*past.flows, *flows], course.following)]
    return found


def _proved(course: Course, j: int, past: Past) -> SwitchProof | Missed:
    return _Switch(course, j, past).outcome()


def _safety(question: Question, flows: Sequence[Flow], tail: Tail | None) -> SafetyProof | None:
    last = flows[-1].fields[-1]
    if tail is not None:
        return SafetyProof((BehindFlows(flows, tail),))
    if question.linear and not last.faces and flows[-1].time >= last.start:
        return SafetyProof((NothingToKeep(flows[-1]),))
    return None


class _Switch:
    """The proof of one switch from a chain of flows, or how near it comes."""

    def __init__(self, course: Course, j: int, past: Past) -> None:
        self.question: Question = course.question
        self.goal: Goal = self.question.goals[j]
        self.flows, self.past = course.flows, past
        self.sinking = course.tail if isinstance(course.tail, Sinking) else None
        seen = (self._reach(f).earliest(self.goal.region, self.question.compiled.plant) for f in past.flows)
        touched = tuple(t for t in seen if t is not None)
        self.way = Way(past.flows, touched, past.ahead(float(self.flows[0].times[0])))

    def _reach(self, flow: Flow) -> Reach:
        return Reach(flow, self.question.horizon, self.goal.reset)

    def outcome(self) -> SwitchProof | Missed:
        best: Missed | None = None
        for flow in self.flows:
            reach = self._reach(flow)
            touched = reach.earliest(self.goal.region, self.question.compiled.plant)
            found = find_crossings(reach, self.goal.region)
            if not isinstance(found, Missed):
                return SwitchProof((CommonTimes(flow, found, touched, way=self.way),))
            if best is None or found.gauge < best.gauge:
                whole = flow is self.flows[0] and not self.past.chains
                start = (*self.past.flows, *self.flows)[0].piece.middle
                best = found if whole else replace(found, start=start, sampled=False)
            if proved_instants(flow) < len(flow.steps):
                break
            if flow is not self.flows[-1]:
                self._passed(flow, touched)
        assert best is not None
        # The search goes on by the bounds of whole steps: starts and breakpoints may lack a proof in any flow.
        legal = all(proved_instants(f) == len(f.steps) for f in self.flows)
        if self.sinking is None or self.goal.reset is not None or not legal:
            return best
        return self._sunk(self.sinking, touched, best)

    def _passed(self, flow: Flow, touched: float | None) -> None:
        """All starts have gone on to the next flow."""
        when = () if touched is None else (self.way.sooner(touched),)
        self.way = Way([*self.way.flows, flow], (*self.way.touched, *when), self.way.ahead)

    def _sunk(self, sinking: Sinking, touched: float | None, best: Missed) -> SwitchProof | Missed:
        last = self.flows[-1]
        arrival = sinking.arrival(self.goal.region, self.question.end)
        if not isinstance(arrival, Arrival):
            closer = replace(arrival, start=best.start, hopeful=best.hopeful, sampled=best.sampled)
            return closer if arrival.gauge < best.gauge else best
        return SwitchProof((Sunk(last, sinking, arrival, touched, way=self.way),))
