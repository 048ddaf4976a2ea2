"""One unit of work: one mode under one reference against all its targets (method, section 2)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from modegraph.certify.approach import approach_of
from modegraph.certify.counterexamples.trajectory import (
    FLOAT_STEPS,
    Equilibrium,
    PointRun,
    Scene,
    candidate_starts,
    enclose_equilibrium,
    followed_in_floats,
    moved_inside,
    scene_of,
    trapped_in,
)
from modegraph.certify.decision import decide
from modegraph.certify.findings import Findings
from modegraph.certify.legal import width_over_time
from modegraph.certify.proof import SwitchProof, certified_check, certified_switch
from modegraph.certify.question import Goal, Question, TargetSpec
from modegraph.certify.reason import Outcome, Reason, point
from modegraph.certify.switching.zero_time import InZeroTime
from modegraph.certify.targets.region import Region
from modegraph.certify.targets.sublevel import target_region
from modegraph.certify.verdict import Approach, Floats, Status, Verdict, Witness
from modegraph.deadline import Deadline
from modegraph.errors import ModegraphError
from modegraph.guarded import guarded
from modegraph.model.closed_loop import close_loop, mode_start
from modegraph.model.mode import Mode
from modegraph.model.sets import is_subset
from modegraph.model.target import Target
from modegraph.reach.compiled import CompiledMode, compile_mode, compile_reset
from modegraph.reach.cover.degrees import start_order, tail_order
from modegraph.reach.failure import Failure, Mechanism
from modegraph.reach.tail.base import Tail
from modegraph.reach.tail.box import TailSearch

POINT_STEPS = 3000
"""Longest validated trajectory tried as a counterexample, in steps."""
LONGEST_RUN = 200.0
"""The same in seconds, for a mode without horizon."""


@dataclass(frozen=True)
class UnitResult:
    """Verdicts parallel to the targets, and that of Assumption 1."""

    verdicts: list[Verdict]
    check: Verdict


def certify_unit(
    mode: Mode,
    p: Floats | None,
    targets: Sequence[TargetSpec],
    *,
    horizon: float | None,
    deadline: Deadline,
    progress: Callable[[str], None] | None = None,
    switches_only: bool = False,
    until: float = np.inf,
) -> UnitResult:
    """Decide condition (C) for every target, and Assumption 1, from the flowpipe of one mode.

    Parameters
    ----------
    horizon : seconds a switch may take; None: until a tail is certified or the deadline.
    deadline : after which what is not decided is UNDECIDED.
    switches_only : look for proofs of switches alone, not for that of Assumption 1 nor for counterexamples
        (but for equilibria, which cost nothing).
    until : seconds after which no proof of a switch is looked for, for a quick answer.
    """
    compiled = compile_mode(mode, p)
    tick = progress or (lambda text: None)
    return _Unit(mode, p, compiled, targets, horizon, deadline, tick, switches_only, until).run()


def goal_of(spec: TargetSpec, plant: int) -> Goal:
    """A target as the exploration sees it, for a source with ``plant`` plant states."""
    if isinstance(spec.mode, Target):
        spec.mode.settle(plant)
        return Goal(target_region(spec.mode.set), None)
    target = mode_start(spec.mode, spec.p)
    reset = None
    if target.dim > plant:
        reset = compile_reset(close_loop(spec.mode, spec.p))
    return Goal(target_region(target), reset)


class _Unit:
    def __init__(
        self,
        mode: Mode,
        p: Floats | None,
        compiled: CompiledMode,
        targets: Sequence[TargetSpec],
        horizon: float | None,
        deadline: Deadline,
        tick: Callable[[str], None],
        switches_only: bool,
        until: float,
    ) -> None:
        self.until = until
        self.mode, self.p, self.compiled, self.switches_only = mode, p, compiled, switches_only
        self.targets, self.horizon, self.deadline, self.tick = targets, horizon, deadline, tick
        self.verdicts: dict[int, Verdict] = {}
        self.goals: dict[int, Goal] = {}
        self.runs: list[PointRun] = []
        self.check: Verdict | None = None

    def run(self) -> UnitResult:
        for k, spec in enumerate(self.targets):
            try:
                self.goals[k] = goal_of(spec, self.compiled.plant)
            except ModegraphError as error:
                reason = Reason(Outcome.UNUSABLE_TARGET, text=str(error))
                self.verdicts[k] = Verdict(Status.UNDECIDED, (reason,), horizon=self.horizon)
        try:
            self._prove()
        except ModegraphError as error:
            # A limit of the engine, not of the model: that was checked when the mode was compiled.
            why = (Reason(Outcome.ENGINE_LIMIT, text=str(error)),)
            if self.check is None:
                self.check = Verdict(Status.UNDECIDED, why)
            for k in range(len(self.targets)):
                self.verdicts.setdefault(k, Verdict(Status.UNDECIDED, why, horizon=self.horizon))
        assert self.check is not None
        return UnitResult([self.verdicts[k] for k in range(len(self.targets))], self.check)

    # -- proofs ----------------------------------------------------------------------------------

    def _prove(self) -> None:
        compiled = self.compiled
        guarded("the switches in zero time", self._switches_in_zero_time, _nothing)
        scene = scene_of(self.mode, self.compiled)
        left = [k for k in self.goals if k not in self.verdicts]
        guarded("the search for equilibria", lambda: self._trap_all(scene, left), _nothing)
        wanted = [k for k in self.goals if k not in self.verdicts]
        question = Question(compiled, dict(self.goals), self.horizon, self.deadline, self.tick, self.until)
        found = decide(question, compiled.whole(), wanted, safety=not self.switches_only)
        for k in wanted:
            if k in found.proofs:
                self.verdicts[k] = self._switch(k, found.proofs[k])
        if found.safety is not None:
            self.check = certified_check(found.safety)
        if not self.switches_only:
            guarded("the search for counterexamples", lambda: self._refute(scene, found), _nothing)
        for k in wanted:
            if k not in self.verdicts:
                self.verdicts[k] = self._undecided(found, k)
        if self.check is None:
            self.check = self._unchecked(found)
        followed = [flow for flow in (found.flow, found.last) if flow is not None]
        widths = width_over_time(followed if len({*followed}) == len(followed) else followed[:1])
        self.check = replace(self.check, widths=widths)
        for k in wanted:
            self.verdicts[k] = replace(self.verdicts[k], widths=widths)
            if self.verdicts[k].status is not Status.CERTIFIED:
                closest, unproved = self._missed(found, k), found.unproved
                self.verdicts[k] = replace(self.verdicts[k], closest=closest, unproved=unproved)

    def _switches_in_zero_time(self) -> None:
        """S_i inside S_j, decided exactly, with the constraints proved at t = 0."""
        compiled = self.compiled
        if compiled.start.dim != compiled.plant:
            return
        candidates = [
            k for k, goal in self.goals.items()
            if goal.region.dim == compiled.plant and is_subset(compiled.one_start, goal.region.set)
        ]  # fmt: skip
        if not candidates:
            return
        flow = compiled.flow(compiled.whole(), start_order(compiled.linear))
        if flow.failure is not None or not (flow.faces_at(0.0, flow.set_at(0), 0) <= 0.0).all():
            return
        for k in candidates:
            evidence = InZeroTime(compiled.one_start, flow, self.goals[k].region)
            self.verdicts[k] = self._switch(k, SwitchProof((evidence,)))

    def _switch(self, k: int, proof: SwitchProof) -> Verdict:
        closest = approach_of(proof.nearest, self.goals[k].region, self._names(k))
        return certified_switch(proof, self.horizon, closest)

    def _names(self, k: int) -> Sequence[str]:
        """States over which target k is a set."""
        target = self.targets[k].mode
        return self.compiled.loop.names if isinstance(target, Target) else target.state_names

    # -- counterexamples -------------------------------------------------------------------------

    def _trap_all(self, scene: Scene, left: list[int]) -> None:
        """Equilibria under constant disturbances: one serves all targets, and it costs almost nothing."""
        if len(scene.fields) != 1 or scene.reset is not None:
            return
        d = scene.constants()
        guess = np.asarray(scene.start.center, float)
        for w in scene.disturbances():
            if not left:
                return
            left = self._trap(scene, enclose_equilibrium(scene, guess, w, d), left)

    def _refute(self, scene: Scene, found: Findings) -> None:
        """Try to refute what is left by validated trajectories."""
        left = [k for k in self.goals if k not in self.verdicts]
        if not left and self.check is not None:
            return
        d = scene.constants()
        starts = candidate_starts(scene, self._hints(found, left))[:4]
        runs = [(x0, w) for w in scene.disturbances() for x0 in starts]
        end = LONGEST_RUN if self.horizon is None else self.horizon
        regions = {k: self.goals[k].region for k in left}
        outside, broken = followed_in_floats(scene, runs, d, list(regions.values()), end, safety=self.check is None)
        never = dict(zip(regions, outside, strict=True))
        for r, (x0, w) in enumerate(runs):
            if (not left and self.check is not None) or self.deadline.is_over:
                return
            if broken[r] or any(never[k][r] for k in left):
                left = self._try_run(PointRun(scene, x0, w, d, longest_step=end / FLOAT_STEPS), left)

    def _hints(self, found: Findings, left: Sequence[int]) -> list[Floats]:
        """Worst starts met by the exploration, then extreme points of the start set."""
        chart = found.flow.piece.chart if found.flow is not None else None
        hints: list[Floats] = []
        if chart is None:
            return hints
        for k in left:
            missed = found.missed.get(k)
            if missed is not None and len(missed.start) >= chart.free:
                hints.append(chart.centre + chart.axes @ missed.start[: chart.free])
        for v in range(chart.free):
            hints += [chart.centre + chart.axes[:, v], chart.centre - chart.axes[:, v]]
        return hints[:6]

    def _trap(self, scene: Scene, equilibrium: Equilibrium | None, left: list[int]) -> list[int]:
        if equilibrium is None:
            return left
        x0 = 0.5 * (equilibrium.lo + equilibrium.hi)
        for k in list(left):
            if trapped_in(scene, equilibrium, self.goals[k].region):
                w = equilibrium.w if len(equilibrium.w) else None
                names = dict(zip(scene.unknowns, equilibrium.d.tolist(), strict=True))
                witness = Witness(x0, w, names, 0.0, "trapped", self.p, self.targets[k].p)
                reason = Reason(Outcome.TRAPPED_AT_EQUILIBRIUM, x0=point(x0), w=point(w), mode=self.mode.name)
                self.verdicts[k] = Verdict(Status.REFUTED, (reason,), witness=witness, horizon=None)
                left.remove(k)
        return left

    def _try_run(self, run: PointRun, left: list[int]) -> list[int]:
        tail: Tail | None = None
        search: TailSearch | None = None
        last = run.flow.fields[-1]
        order = tail_order(last.linear)
        end = LONGEST_RUN if self.horizon is None else self.horizon
        checkpoint = 30
        while run.violation is None and run.flow.time < end and len(run.flow.steps) < POINT_STEPS:
            if self.deadline.is_over:
                break
            before = len(run.flow.steps)
            run.extend(end, checkpoint)
            if len(run.flow.steps) == before:
                break
            if len(run.flow.steps) < checkpoint:
                continue
            checkpoint = 2 * checkpoint
            if not any(run.apart_until(self.goals[k].region) >= run.flow.time for k in left):
                if self.check is not None:
                    break
                continue
            if run.flow.time >= last.start:
                search = search or TailSearch(
                    last, run.flow.piece.chart, run.w, np.zeros(len(run.w)), self.compiled.loop.names, order
                )
                outcome = search.attempt([run.flow])
                if isinstance(outcome, Tail) and any(self._outside(self.goals[k].region, outcome) for k in left):
                    tail = outcome
                    break
        return self._judge(run, tail, left)

    def _judge(self, run: PointRun, tail: Tail | None, left: list[int]) -> list[int]:
        who = {"x0": point(run.x0), "w": point(run.w) if len(run.w) else None}
        if self.check is None and run.violation is not None:
            witness = run.witness("violates", run.violation, self.p, None)
            reason = Reason(Outcome.VIOLATES, **who, time=run.violation, before_entry=False)
            self.check = Verdict(Status.REFUTED, (reason,), witness=witness)
        for k in list(left):
            region = self.goals[k].region
            apart = run.apart_until(region)
            at = self.targets[k].p
            verdict: Verdict | None = None
            if run.violation is not None and (run.violation == 0.0 or apart >= run.violation):
                witness = run.witness("violates", run.violation, self.p, at)
                reason = Reason(Outcome.VIOLATES, **who, time=run.violation, before_entry=True)
                verdict = Verdict(Status.REFUTED, (reason,), witness=witness)
            elif tail is not None and apart >= run.flow.time and self._outside(region, tail):
                witness = run.witness("trapped", tail.start, self.p, at)
                reason = Reason(Outcome.TRAPPED, **who, time=tail.start)
                verdict = Verdict(Status.REFUTED, (reason,), witness=witness)
            elif self.horizon is not None and run.violation is None and apart >= self.horizon:
                witness = run.witness("horizon", self.horizon, self.p, at)
                reason = Reason(Outcome.HORIZON, **who, horizon=self.horizon)
                verdict = Verdict(Status.REFUTED, (reason,), witness=witness, horizon=self.horizon)
            if verdict is not None:
                self.verdicts[k] = verdict
                left.remove(k)
        return left

    def _outside(self, region: Region, tail: Tail) -> bool:
        n = region.dim
        if n != self.compiled.plant:
            return False
        lo, hi = tail.lo[:n], tail.hi[:n]
        with np.errstate(invalid="ignore"):
            return bool(np.isfinite(lo).all() and np.isfinite(hi).all() and region.separated(lo[None], hi[None])[0])

    # -- what is left ----------------------------------------------------------------------------

    def _undecided(self, found: Findings, k: int) -> Verdict:
        missed = found.missed.get(k)
        why: list[Reason] = []
        margin = None
        if missed is not None and np.isfinite(missed.gauge):
            margin = 1.0 - missed.gauge
            why.append(Reason(Outcome.NO_COMMON_TIME, gauge=missed.gauge, time=missed.time))
        why += self._in_the_way(found)
        if not why:
            missed_at_start = missed is not None and found.safe_until == 0.0
            why.append(Reason(Outcome.START_NOT_PROVED if missed_at_start else Outcome.NOTHING_FOUND))
        return Verdict(Status.UNDECIDED, tuple(why), margin=margin, horizon=self.horizon)

    def _in_the_way(self, found: Findings) -> list[Reason]:
        """What ended the proofs of all goals and of the check."""
        why = [] if found.unproved is None else [found.unproved.reason]
        why += [] if found.failure is None else [found.failure]
        return why + ([Reason(Outcome.BUDGET_ENDED)] if self.deadline.met else [])

    def _missed(self, found: Findings, k: int) -> Approach | None:
        """How near the starts come to target k, and the worst of them."""
        missed = found.missed.get(k)
        if missed is None:
            return None
        closest = approach_of(missed.nearest, self.goals[k].region, self._names(k))
        chart = found.flow.piece.chart if found.flow is not None else None
        if closest is None or chart is None or len(missed.start) < chart.free:
            return closest
        start = moved_inside(self.compiled.one_start, chart.centre + chart.axes @ missed.start[: chart.free])
        origin: Literal["sampled", "middle"] = "sampled" if missed.sampled else "middle"
        return closest if start is None else replace(closest, start=start, origin=origin)

    def _unchecked(self, found: Findings) -> Verdict:
        why = self._in_the_way(found)
        if found.no_tail or not why:
            missing = found.no_tail or (Failure(Mechanism.NOT_FOLLOWED),)
            funnel = missing[1] if len(missing) > 1 else None
            why.insert(0, Reason(Outcome.NOT_FOR_EVER, until=found.safe_until, why=missing[0], funnel=funnel))
        return Verdict(Status.UNDECIDED, tuple(why), until=found.safe_until)


def _nothing(error: Exception) -> None:
    """What was decided before the engine stopped stays decided."""
