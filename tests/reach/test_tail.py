"""All time is claimed only where the loop exists for all time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.unit import compile_mode
from modegraph.reach.tail import relevant_states


def mode(dynamics: Callable[..., Any], start: mg.Box, controller: Callable[..., Any] | None = None) -> mg.Mode:
    plant = mg.System(dynamics, states=start.dim, inputs=1)
    return mg.Mode(
        "m",
        plant,
        controller=controller or (lambda x: 0.0 * x[0]),
        reference=mg.setpoint([0.0]),
        start=start,
        constraints=lambda x: {"first": x[0] <= 2.0},
    )


def check(source: mg.Mode) -> mg.Verdict:
    return mg.build([source], budget=20.0).check("m")


CLOCK = mg.Box([0.5, 0.0, -10.0], [1.0, 0.1, -9.9])
"""The third state is a clock with x3' = 1 that nothing bounded reads: it is 0 at about t = 10 s."""


@pytest.mark.parametrize(
    "rate",
    [
        lambda x: 1.0 / x[2],
        lambda x: np.log(-x[2]),
        lambda x: np.sqrt(-x[2]),
        lambda x: x[0] * x[2] / x[2],
    ],
    ids=["reciprocal", "logarithm", "square root", "cancelled"],
)
def test_a_state_that_feeds_nothing_may_still_leave_a_domain(rate: Callable[[Any], Any]) -> None:
    source = mode(lambda x, u: np.array([u[0] - x[0], rate(x), 1.0]), CLOCK)
    assert check(source).status is not mg.Status.CERTIFIED


def test_a_pole_where_no_state_is_relevant() -> None:
    plant = mg.System(lambda x, u: np.array([u[0] + 1.0 / x[1], 1.0]), states=2, inputs=1)
    source = mg.Mode(
        "m",
        plant,
        controller=lambda x: 0.0 * x[0],
        reference=mg.setpoint([0.0]),
        start=mg.Box([0, -10], [0.1, -9.9]),
    )
    assert check(source).status is not mg.Status.CERTIFIED


def test_a_cancelled_pole_in_a_drifting_state() -> None:
    source = mode(lambda x, u: np.array([u[0] - x[0] * x[1] / x[1], 1.0]), mg.Box([0.5, -10.0], [1.0, -9.9]))
    assert check(source).status is not mg.Status.CERTIFIED


def test_a_cancelled_pole_in_time() -> None:
    source = mode(
        lambda x, u: np.array([u[0]]),
        mg.Box([0.5], [1.0]),
        controller=lambda x, t: -(x[0] * (t - 10.0)) / (t - 10.0),
    )
    assert check(source).status is not mg.Status.CERTIFIED


@pytest.mark.parametrize("rate", [lambda x: x[0], lambda x: np.sin(x[2]) * x[0], lambda x: 1.0 / (2.0 + x[0])])
def test_a_drifting_state_that_is_defined_everywhere_is_no_obstacle(rate: Callable[[Any], Any]) -> None:
    source = mode(lambda x, u: np.array([u[0] - x[0], rate(x), 1.0]), CLOCK)
    assert check(source).status is mg.Status.CERTIFIED


def test_only_states_that_matter_are_relevant() -> None:
    source = mode(lambda x, u: np.array([u[0] - x[0], x[0], 1.0]), CLOCK)
    assert relevant_states(compile_mode(source, None).fields[-1]) == [0]
