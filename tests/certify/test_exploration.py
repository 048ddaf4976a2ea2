"""Chains of flows: what they prove together, and what is said where they do not."""

from __future__ import annotations

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.exploration import Course, Exploration, Goal
from modegraph.certify.proof import SwitchProof
from modegraph.certify.switching.common_time import Missed
from modegraph.certify.switching.funnel import Sinking
from modegraph.certify.targets.region import Region
from modegraph.certify.unit import exploration_of
from modegraph.reach.compiled import CompiledMode, compile_mode
from modegraph.reach.failure import Mechanism
from modegraph.reach.flow.flow import Flow, Order
from modegraph.reach.tail.decay import SettledLoop
from modegraph.reach.tail.funnel import Funnel, FunnelBuilder

LIMIT = 0.5
TARGET = Region(mg.Ball([0.0], 0.01))


def falling(lo: float, hi: float) -> CompiledMode:
    """x' = -x from [lo, hi], with x <= LIMIT."""
    mode = mg.Mode(
        "m",
        mg.System(lambda x, u: np.array([u[0]]), states=1, inputs=1),
        controller=lambda x: -x[0],
        reference=mg.setpoint([0.0]),
        start=mg.Box([lo], [hi]),
        constraints=lambda x: {"top": x[0] <= LIMIT},
    )
    return compile_mode(mode, None)


def flow_of(c: CompiledMode, t0: float, end: float) -> Flow:
    flow = Flow(c.fields, c.whole(), c.w_centre, c.w_radius, Order(1, 0), names=c.loop.names, t0=t0)
    assert flow.run(end)
    return flow


def exploration(c: CompiledMode) -> Exploration:
    return exploration_of(c, {0: Goal(TARGET, None)}, None, np.inf, lambda text: None)


def chain(top: float) -> tuple[list[Flow], Sinking]:
    """A flow that begins with starts up to ``top``, one that goes on from its end, and a funnel around that."""
    later = falling(0.2, 0.4)
    flows = [flow_of(falling(0.4, top), 0.0, 0.5), flow_of(later, 0.5, 1.0)]
    loop = SettledLoop(later.fields[-1], later.w_centre, later.w_radius, np.zeros(0), np.zeros(0))
    funnel = FunnelBuilder(loop).build(np.linspace(-0.4, 0.4, 21)[:, None], np.ones(1), lambda ball: False)
    assert isinstance(funnel, Funnel)
    hit = funnel.enter(flows[1].bounds, *flows[1].state_set(len(flows[1].steps)))
    assert hit is not None
    return flows, Sinking(funnel, *hit, flows[1].time)


@pytest.mark.parametrize("top, proved", [(0.45, True), (0.6, False)])
def test_a_funnel_proves_a_switch_only_behind_flows_that_are_proved(top: float, proved: bool) -> None:
    flows, sinking = chain(top)
    found = exploration(falling(0.4, top))._crossing(flows, 0, sinking)
    assert isinstance(found, SwitchProof if proved else Missed)
    if isinstance(found, SwitchProof):
        assert found.latest >= 0.5 + np.log(0.2 / 0.01)


@pytest.mark.parametrize("top, proved", [(0.45, True), (0.6, False)])
def test_all_time_is_proved_only_behind_flows_that_are_proved(top: float, proved: bool) -> None:
    flows, sinking = chain(top)
    found = exploration(falling(0.4, top))._findings(flows, [], Course(sinking), True)
    assert (found.safety is not None) == proved
    assert bool(found.unproved) != proved
    assert proved or found.safe_until < 0.5


@pytest.mark.parametrize("rate, both", [(1e-7, True), (0.0, False)])
def test_why_there_is_no_funnel_is_said_once(rate: float, both: bool) -> None:
    # A rate of 1e-7 is enough to look for an invariant set, not for a funnel; a rate of 0 for neither.
    plant = mg.System(lambda x: np.array([-rate * x[0] - x[0] ** 3]), states=1, inputs="none")
    slow = mg.Mode(
        "slow", plant, controller=lambda x: 0.0, reference=mg.setpoint([0.0]), start=mg.Box([-0.05], [0.05])
    )  # fmt: skip
    check = mg.build([slow], budget=20.0).check("slow")
    (reason,) = check.why
    assert reason.outcome is mg.Outcome.NOT_FOR_EVER
    mechanisms = [reason.fields[name].mechanism for name in ("why", "funnel") if reason.fields[name] is not None]
    assert mechanisms.count(Mechanism.DOES_NOT_SETTLE) == 1
    assert (len(mechanisms) == 2) == both
    assert check.reason.count("the loop does not settle") == 1


def test_starts_on_both_sides_of_a_limit_are_cut_until_they_are_proved() -> None:
    plant = mg.System(lambda x, u: np.array([x[1], u[0] - 0.3 * np.sin(x[0])]), states="position speed", inputs="force")
    wide = mg.Mode(
        "wide", plant, controller=lambda x, r: np.clip(-9.0 * (x[:1] - r) - 6.0 * x[1:], -1.5, 1.5),
        reference=mg.setpoint([0.0]), start=mg.Ball([0.0, 0.0], 0.4), constraints=lambda x: {"speed": abs(x[1]) <= 1.5},
    )  # fmt: skip
    check = mg.build([wide], horizon=8.0).check("wide")
    assert check.status is mg.Status.CERTIFIED, check.reason
