"""Assumption 1 is shown only by flows that are proved to their ends and tails that keep the constraints."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.lasting import BehindFlows, NothingToKeep
from modegraph.reach.compiled import CompiledMode, compile_mode
from modegraph.reach.flow.flow import Flow, Order
from modegraph.reach.tail.box import Tail


def compiled(limit: float | None, dynamics: Any = lambda x, u: u - x, lo: float = 0.5, hi: float = 1.0) -> CompiledMode:
    mode = mg.Mode(
        "m", mg.System(dynamics, states=1, inputs=1), controller=lambda x: 0.0, reference=mg.setpoint([0.0]),
        output=lambda x: x, start=mg.Box([lo], [hi]),
        constraints=None if limit is None else lambda x: {"top": x[0] <= limit},
    )  # fmt: skip
    return compile_mode(mode, None)


def flow(c: CompiledMode, end: float = 1.0) -> Flow:
    found = c.flow(c.whole(), Order(1, 0) if c.linear else Order(4, 3))
    assert found.run(end)
    return found


TAIL = Tail(1.0, np.array([-0.25]), np.array([0.5]), np.array([-1.0]), np.array([1.0]), 1.0)


def test_the_slack_is_the_least_of_the_flows_and_of_the_tail() -> None:
    one, other = flow(compiled(2.0)), flow(compiled(2.0, lo=0.9))
    found = BehindFlows([one, other], TAIL)
    assert found.slack == {"top": 0.25}
    assert found.start == 1.0
    assert BehindFlows([one], replace(TAIL, face_upper=np.array([-9.0]))).slack["top"] == pytest.approx(1.0, abs=1e-3)
    assert found.tracking[0] >= max(0.5, *(s.tracking[0] for s in one.steps))


def test_the_slack_of_what_was_passed_first_counts() -> None:
    """The first flow begins at 1.9, where the limit is 2; the tail has more room, and so has what follows."""
    flows = [flow(compiled(2.0, hi=1.9)), flow(compiled(2.0))]
    for order in (flows, flows[::-1]):
        found = BehindFlows(order, replace(TAIL, face_upper=np.array([-9.0])))
        assert found.slack["top"] == pytest.approx(0.1, abs=1e-3)


@pytest.mark.parametrize("order", [0, 1])
def test_a_flow_that_breaks_a_constraint_leads_to_no_tail(order: int) -> None:
    flows = [flow(compiled(2.0)), flow(compiled(0.75))]
    with pytest.raises(ValueError, match="not proved"):
        BehindFlows(flows if order else flows[::-1], TAIL)
    BehindFlows([flows[0]], TAIL)


@pytest.mark.parametrize("upper", [1e-300, np.nan, np.inf])
def test_a_tail_keeps_its_constraints(upper: float) -> None:
    with pytest.raises(ValueError, match="tail"):
        BehindFlows([flow(compiled(2.0))], replace(TAIL, face_upper=np.array([upper])))


def test_a_linear_loop_without_constraints_needs_no_tail() -> None:
    found = NothingToKeep(flow(compiled(None)))
    assert (found.slack, found.start) == ({}, 1.0)
    with pytest.raises(ValueError):
        NothingToKeep(flow(compiled(2.0)))
    with pytest.raises(ValueError):
        NothingToKeep(flow(compiled(None, lambda x, u: u - x - x**3)))
