"""One mode against its targets."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.question import TargetSpec
from modegraph.certify.unit import certify_unit
from modegraph.certify.verdict import Status, Verdict
from modegraph.deadline import Deadline

C, R, U = Status.CERTIFIED, Status.REFUTED, Status.UNDECIDED


def mode(start: Any, dynamics: Any = None, w: Any = None, **more: Any) -> mg.Mode:
    plant = mg.System(dynamics or (lambda x, u: np.array([u[0]])), states=start.dim, inputs=1, disturbance=w)
    more = {"controller": lambda x: -x[0], "reference": mg.setpoint([0.0])} | more
    return mg.Mode("m", plant, start=start, **more)


def unit(source: mg.Mode, *sets: Any, horizon: float | None = None) -> tuple[list[Verdict], Verdict]:
    targets = [TargetSpec(f"t{k}", None, mg.Target(f"t{k}", s)) for k, s in enumerate(sets)]
    result = certify_unit(source, source.reference.parameters()[0], targets, horizon=horizon, deadline=Deadline(20.0))
    return result.verdicts, result.check


def test_three_answers_in_target_order() -> None:
    verdicts, check = unit(
        mode(mg.Box([1.0], [2.0])), mg.Box([-0.5], [0.5]), mg.Box([-5.0], [5.0]), mg.Box([-2.0], [-1.0])
    )
    assert [v.status for v in verdicts[:2]] == [C, C]
    assert verdicts[2].status is not C
    assert verdicts[0].time is not None
    assert verdicts[0].time[0] <= np.log(2.0)
    assert verdicts[0].time[1] >= np.log(4.0)
    assert verdicts[1].time == (0.0, 0.0)
    assert check.status is C


@pytest.mark.parametrize("limit, good", [(1.999, False), (2.0, True), (2.5, True)])
def test_a_switch_in_zero_time_needs_the_constraints(limit: float, good: bool) -> None:
    source = mode(mg.Box([1.0], [2.0]), constraints=lambda x: {"top": x[0] <= limit})
    (verdict,), check = unit(source, mg.Box([0.0], [3.0]))
    assert not (verdict.status is C and not good)
    assert not (verdict.status is R and good)
    assert not (check.status is C and not good)
    assert not (check.status is R and good)


def test_the_horizon_is_inclusive_at_most() -> None:
    # 2 exp(-t) = 0.5 at t = log 4 exactly.
    for horizon, forbidden in ((np.log(4.0) * (1 - 1e-9), C), (np.log(4.0) * (1 + 1e-3), R)):
        (verdict,), _ = unit(mode(mg.Box([2.0], [2.0])), mg.Box([-0.5], [0.5]), horizon=horizon)
        assert verdict.status is not forbidden


def test_a_disturbance_keeps_it_out() -> None:
    source = mode(mg.Box([1.0], [2.0]), lambda x, u, w: np.array([u[0] + w[0]]), mg.Box([-0.2], [0.2]))
    verdicts, check = unit(source, mg.Box([-0.1], [0.1]), mg.Box([-0.3], [0.3]))
    assert verdicts[0].status is R
    assert verdicts[1].status is C
    assert check.status is C
    assert verdicts[0].witness is not None
    assert abs(verdicts[0].witness.w[0]) == 0.2


def test_a_pulse_in_time_is_seen() -> None:
    """A constraint broken for a moment, between widely spaced instants, is not certified."""
    source = mode(
        mg.Box([0.0], [0.0]), controller=lambda x, t: 0.0 * x[0],
        constraints=lambda x, t: {"pulse": x[0] + np.exp(-((t - 3.3) / 0.01) ** 2) <= 0.9},
    )  # fmt: skip
    (verdict,), check = unit(source, mg.Box([1.0], [2.0]), horizon=5.0)
    assert verdict.status is not C
    assert check.status is not C


@pytest.mark.parametrize("scale", [1e-150, 1e150])
def test_scales_do_not_change_the_answers(scale: float) -> None:
    verdicts, _ = unit(
        mode(mg.Box([scale], [2 * scale])),
        mg.Box([-0.5 * scale], [0.5 * scale]),
        mg.Box([-2.5 * scale], [-0.1 * scale]),
        horizon=4.0,
    )
    assert verdicts[0].status is not R
    assert verdicts[1].status is not C
