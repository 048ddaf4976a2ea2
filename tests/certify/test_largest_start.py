"""The largest proved start set, against closed forms: never above, and near them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.errors import ModegraphError


def contracting(**more: Any) -> mg.Mode:
    plant = mg.System(lambda x, u: u, states=2, inputs=2)
    more = {"constraints": lambda x: {"sum": x[0] + x[1] <= 1.0}} | more
    return mg.Mode(
        "home", plant, controller=lambda x: -x, reference=mg.setpoint([0.0]), start=mg.Ball([0, 0], 0.1), **more
    )


def oscillating(limit: float) -> mg.Mode:
    # x1 is largest after the start: the largest initial speed with |x1| <= limit is limit * e.
    plant = mg.System(lambda x, u: np.array([x[1], u[0]]), states=2, inputs=1)
    return mg.Mode(
        "spring",
        plant,
        controller=lambda x: -x[0] - 2 * x[1],
        reference=mg.setpoint([0.0]),
        start=mg.Ball([0, 0], 0.1),
        constraints=lambda x: {"position": abs(x[0]) <= limit},
    )


SHAPES = [
    (mg.Ball([0, 0], 2.0), np.sqrt(0.5) / 2.0),
    (mg.Box([-1, -1], [1, 1]), 0.5),
    (mg.Box([-1, 0], [1, 0]), 1.0),
    (mg.Ellipsoid([0, 0], [[4.0, 0.0], [0.0, 1.0]]), 1 / np.sqrt(5.0)),
    (mg.Zonotope([0, 0], [[1.0, 0.5], [0.0, 0.5]]), 0.5),
    (mg.Polytope([[1, 0], [-1, 0], [0, 1], [0, -1]], [1, 1, 1, 1]), 0.5),
    (mg.Sublevel(lambda x: x @ x, 0.01), 10 * np.sqrt(0.5)),
    (mg.Ball([-1, -1], 1.0), 3 / np.sqrt(2.0)),
]


@pytest.mark.parametrize("shape, true", SHAPES, ids=lambda s: type(s).__name__)
def test_the_closed_form_is_reached_and_never_exceeded(shape: mg.Box, true: float) -> None:
    found = mg.largest_start(contracting(), shape)
    assert 0.98 * true <= found <= true


def test_a_limit_that_is_met_in_mid_flight() -> None:
    # From (0, v): x1 = v t exp(-t), at most v / e.
    found = mg.largest_start(oscillating(1.0), mg.Box([0, -1], [0, 1]))
    assert 0.98 * np.e <= found <= np.e


def test_a_nonlinear_loop_stays_below_the_boundary_of_attraction() -> None:
    # x' = -x + x^3 escapes from |x| > 1.
    plant = mg.System(lambda x: -x + x**3, states=1, inputs=0)
    hold = mg.Mode(
        "hold", plant, controller=lambda x: np.zeros(0), reference=mg.setpoint([0.0]), start=mg.Ball([0.0], 0.1),
        constraints=lambda x: {"x": abs(x[0]) <= 2.0},
    )  # fmt: skip
    found = mg.largest_start(hold, mg.Ball([0.0], 1.0))
    assert 0.5 <= found < 1.0


def test_a_shape_that_is_no_ellipsoid_is_safe() -> None:
    found = mg.largest_start(contracting(), mg.Sublevel(lambda x: x[0] ** 2 + x[1] ** 4, 1.0))
    angle = np.linspace(0, 1, 2001)
    true = 1.0 / (np.sqrt(1 - angle**4) + angle).max()
    assert 0.7 * true <= found <= true


def test_none_is_zero() -> None:
    assert mg.largest_start(contracting(), mg.Ball([2.0, 0.0], 1.0)) == 0.0


def test_no_limit_ends_the_search() -> None:
    assert mg.largest_start(contracting(constraints=None), mg.Ball([0, 0], 1.0)) == 2.0**20


def test_the_start_of_the_mode_and_the_mode_itself_are_left_alone() -> None:
    mode = contracting()
    before = mode.start
    mg.largest_start(mode, mg.Ball([0, 0], 1.0))
    assert mode.start is before


def test_the_reference_counts() -> None:
    plant = mg.System(lambda x, u: u, states=1, inputs=1)
    mode = mg.Mode(
        "go", plant, controller=lambda x, r: r - x, reference=mg.setpoint(mg.Points([[0.0], [0.9]])),
        start=mg.Ball([0.0], 0.1), constraints=lambda x: {"x": x[0] <= 0.5},
    )  # fmt: skip
    assert mg.largest_start(mode, mg.Ball([0.0], 1.0), [0.0]) == pytest.approx(0.5, rel=0.02)
    assert mg.largest_start(mode, mg.Ball([0.0], 1.0), r=0.9) == 0.0


@pytest.mark.parametrize(
    "shape, match",
    [
        (mg.Ball([0, 0, 0], 1.0), "home.*3 coordinates"),
        (3.0, "shape must be a set"),
        (mg.Polytope([[1, 0]], [1.0]), "not bounded"),
        (mg.Sublevel(lambda x: x[0] + x[1], 1.0), "not bounded.*box"),
        (mg.Sublevel(lambda x: x @ x, -1.0), "empty"),
    ],
)
def test_errors_name_the_mode(shape: Any, match: str) -> None:
    with pytest.raises(ModegraphError, match=match):
        mg.largest_start(contracting(), shape)


def test_only_modes() -> None:
    with pytest.raises(ModegraphError, match="must be a Mode"):
        mg.largest_start(mg.Ball([0], 1), mg.Ball([0], 1))  # type: ignore[arg-type]
