"""Floats of a settled loop, against formulas."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.reach.float_loop import FloatLoop
from tests.reach.tail.test_decay import settled


def float_loop(field: Any, n: int, w: mg.Box | None = None, unknowns: Any = None) -> FloatLoop:
    loop = settled(field, n, w, unknowns)
    return FloatLoop(loop.fld, loop.w_centre, loop.w_radius, loop.unknown_lo, loop.unknown_hi)


def spring(x: Any, w: Any, d: Any) -> Any:
    return np.array([x[1], -d["k"] * np.sin(x[0]) - (1.0 + w[1]) * x[1] + 2.0 * w[0]])


SPRING = float_loop(spring, 2, mg.Box([-0.5, 0.0], [1.5, 2.0]), {"k": (2.0, 4.0)})
"""Central: w = (.5, 1), k = 3."""


def test_the_jacobian_is_that_of_the_central_disturbance_and_unknowns() -> None:
    np.testing.assert_allclose(SPRING.jacobian(np.array([0.3, 1.0])), [[0.0, 1.0], [-3.0 * np.cos(0.3), -2.0]])


def test_the_disturbance_matrix_has_a_column_for_each_disturbance() -> None:
    np.testing.assert_allclose(SPRING.disturbance_matrix(np.array([0.3, 0.7])), [[0.0, 0.0], [2.0, -0.7]])


def test_jacobians_are_taken_at_corners() -> None:
    found = SPRING.jacobians(np.tile([0.0, 1.0], (40, 1)))
    assert found.shape == (40, 2, 2)
    assert {tuple(row) for row in np.round(found[:, 1], 12)} == {(-k, -v) for k in (2.0, 4.0) for v in (1.0, 3.0)}


def test_points_where_the_jacobian_is_not_defined_are_left_out() -> None:
    loop = float_loop(lambda x: np.array([-1.0 / (x[0] - 3.0)]), 1)
    np.testing.assert_allclose(loop.jacobians(np.array([[3.0], [5.0]])), [[[0.25]]])
    assert loop.equilibrium(np.array([3.0]), [0]) is None


def test_the_equilibrium_balances_the_central_disturbance() -> None:
    found = SPRING.equilibrium(np.array([0.2, 0.5]), [0, 1])
    assert found is not None
    np.testing.assert_allclose(found, [np.arcsin(1.0 / 3.0), 0.0], atol=1e-12)


def test_states_that_do_not_count_keep_their_values() -> None:
    # The second state grows for ever, and the first does not read it.
    loop = float_loop(lambda x: np.array([np.exp(-x[0]) - 0.5, 1.0]), 2)
    start = np.array([0.0, 7.0])
    found = loop.equilibrium(start, [0])
    assert found == pytest.approx([np.log(2.0), 7.0])
    assert (start == [0.0, 7.0]).all()
