"""Chains of flows: what they prove together, and what is said where they do not."""

from __future__ import annotations

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.chain_evidence import Past, findings_of
from modegraph.certify.course import Course
from modegraph.certify.question import Goal, Question
from modegraph.certify.switching.funnel import Sinking
from modegraph.certify.targets.region import Region
from modegraph.deadline import NEVER
from modegraph.reach.compiled import CompiledMode, compile_mode
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


def course(c: CompiledMode, flows: list[Flow], sinking: Sinking) -> Course:
    return Course(Question(c, {0: Goal(TARGET, None)}, None, NEVER), flows, park=False, common=False, tail=sinking)


def chain(top: float) -> tuple[list[Flow], Sinking]:
    """A flow that begins with starts up to ``top``, one that goes on from its end, and a funnel around that."""
    later = falling(0.2, 0.4)
    flows = [flow_of(falling(0.4, top), 0.0, 0.5), flow_of(later, 0.5, 1.0)]
    loop = SettledLoop(later.fields[-1], later.w_centre, later.w_radius, np.zeros(0), np.zeros(0))
    funnel = FunnelBuilder(loop).build(np.linspace(-0.4, 0.4, 21)[:, None], np.ones(1), lambda ball: False)
    assert isinstance(funnel, Funnel)
    hit = funnel.enter(flows[1].last_set)
    assert hit is not None
    return flows, Sinking(funnel, *hit, flows[1].time)


@pytest.mark.parametrize("top, proved", [(0.45, True), (0.6, False)])
def test_a_funnel_proves_a_switch_only_behind_flows_that_are_proved(top: float, proved: bool) -> None:
    flows, sinking = chain(top)
    found = findings_of(course(falling(0.4, top), flows, sinking), [0], False)
    assert (0 in found.proofs) == proved
    assert (0 in found.missed) != proved
    if proved:
        assert found.proofs[0].latest >= 0.5 + np.log(0.2 / 0.01)


@pytest.mark.parametrize("top, proved", [(0.45, True), (0.6, False)])
def test_all_time_is_proved_only_behind_flows_that_are_proved(top: float, proved: bool) -> None:
    flows, sinking = chain(top)
    found = findings_of(course(falling(0.4, top), flows, sinking), [], True)
    assert (found.safety is not None) == proved
    assert bool(found.unproved) != proved
    assert proved or found.safe_until < 0.5


@pytest.mark.parametrize("ends, begin, ahead", [([1.0], 1.0, 0.0), ([1.0, 1.0], 1.0, 0.0), ([0.4, 1.0], 1.0, 0.6)])
def test_chains_are_ahead_by_what_the_first_of_them_ended_earlier(
    ends: list[float], begin: float, ahead: float
) -> None:
    """Two chains as much as many: a trajectory of the first is ``begin`` - .4 s further than the common clock."""
    flows = [[flow_of(falling(0.1, 0.2), 0.0, 0.25), flow_of(falling(0.1, 0.2), 0.25, end)] for end in ends]
    found = Past(flows).ahead(begin)
    assert ahead <= found <= ahead + 1e-12
    assert (found > ahead) == (ahead > 0.0)


def test_the_earliest_entry_is_that_of_the_chain_that_is_ahead() -> None:
    """x' = -x: from .2 at its own second .4 the state is at .1 at .4 + log 2, though the common clock says 1.69."""
    early, late = flow_of(falling(0.2, 0.4), 0.0, 0.4), flow_of(falling(0.2, 0.4), 0.0, 1.0)
    common = flow_of(falling(0.2, 0.2), 1.0, 5.0)
    c = falling(0.2, 0.4)
    question = Question(c, {0: Goal(Region(mg.Box([-0.1], [0.1])), None)}, 5.0, NEVER)
    found = findings_of(Course(question, [common], park=False, common=True), [0], False, Past([[early], [late]]))
    assert 0.0 <= found.proofs[0].earliest <= 0.4 + np.log(2.0)
    assert found.proofs[0].latest >= 1.0 + np.log(2.0)


def test_what_was_passed_counts() -> None:
    """The slack of a constraint, and the first instant in the target, of the chains before the common flow too."""
    near, far = flow_of(falling(0.2, 0.45), 0.0, 1.0), flow_of(falling(0.2, 0.3), 0.0, 1.0)
    common = flow_of(falling(0.05, 0.2), 1.0, 5.0)
    question = Question(falling(0.2, 0.4), {0: Goal(Region(mg.Box([-0.12], [0.12])), None)}, 5.0, NEVER)
    for chains in ([[near], [far]], [[far], [near]]):
        course = Course(question, [common], park=False, common=True, tail=None)
        found = findings_of(course, [0], False, Past(chains))
        # .45 at the entry, where the limit is .5.
        assert found.proofs[0].slack["top"] <= 0.05
        # .2 exp(-t) = .12
        assert found.proofs[0].earliest <= np.log(0.2 / 0.12)
        assert found.proofs[0].latest > 1.0
