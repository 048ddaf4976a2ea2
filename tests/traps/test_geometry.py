"""Which points arrive: corners, tangents, closest approaches, balls in eight dimensions, the last ulp."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

import modegraph as mg
from tests.traps.question import (
    assert_certified,
    assert_not_certified,
    assert_not_refuted,
    flow,
    goal,
    polytope,
)


def test_the_centre_arrives_and_a_corner_does_not():
    # y never changes: starts with |y| > .5 stay out.
    def mode(width: float) -> mg.Mode:
        return flow("slide", lambda x: np.array([-x[0], 0.0 * x[1]]), mg.Box([0.5, -width], [1.0, width]))

    assert_not_certified(mode(0.51), goal([-0.1, -0.5], [0.1, 0.5]), 8.0)
    assert_certified(mode(0.49), goal([-0.1, -0.5], [0.1, 0.5]), 8.0)


def rotation(start: mg.Ball) -> mg.Mode:
    return flow("turn", lambda x: np.array([-x[1], x[0]]), start)


def test_a_tangential_touch():
    # The run from (1, 0) touches y = 1 at one instant: (C) is true of it, and no margin exists.
    assert_not_refuted(rotation(mg.Ball([1.0, 0.0], 0.0)), goal([-0.5, 1.0], [0.5, 2.0]), 3.0)
    # Starts of radius .99 turn below y = .995.
    assert_not_certified(rotation(mg.Ball([1.0, 0.0], 0.01)), goal([-0.5, 0.995], [0.5, 2.0]), 3.0)
    assert_certified(rotation(mg.Ball([1.0, 0.0], 0.01)), goal([-0.5, 0.97], [0.5, 2.0]), 3.0)


def test_the_closest_approach_is_in_mid_flight():
    # The path (t, (t - 1)^2 + d) passes the ball around (1, 0) between samples and before its own end.
    def flying(height: float) -> mg.Mode:
        plant = mg.System(lambda x, u: np.array([1.0 + 0.0 * x[0], u[0]]), states="x y", inputs="rate")
        return mg.Mode(
            "arc",
            plant,
            controller=lambda t: 2.0 * (t - 1.0),
            reference=mg.setpoint([0.0]),
            start=mg.Box([-0.005, 1.0 + height - 0.005], [0.005, 1.0 + height + 0.005]),
        )

    ball = mg.Target("goal", mg.Ball([1.0, 0.0], 0.1))
    assert_not_certified(flying(0.115), ball, 2.5)
    assert_certified(flying(0.085), ball, 2.5)


def test_a_ball_is_not_its_bounding_box_in_eight_dimensions():
    # A corner of the start box has norm 1.131 and needs .816 s (ln 2.263); its bounding box fits at once.
    box = flow("shrink", lambda x: -x, mg.Box([-0.4] * 8, [0.4] * 8))
    ball = mg.Target("goal", mg.Ball([0.0] * 8, 0.5))
    assert_not_certified(box, ball, 0.8)
    assert_certified(box, ball, 0.86)


def test_a_ball_of_starts_is_not_its_bounding_box_either():
    # ln 2 = .693 s; the corners of the box around the ball would need 1.73 s.
    ball = flow("shrink", lambda x: -x, mg.Ball([0.0] * 8, 1.0))
    target = mg.Target("goal", mg.Ball([0.0] * 8, 0.5))
    assert_not_certified(ball, target, 0.68)
    assert_certified(ball, target, 0.75)


def test_a_single_start_on_an_unstable_equilibrium():
    # x0 = 0 stays for ever; every other start arrives.
    def mode(lo: float) -> mg.Mode:
        return flow("leave", lambda x: x - x**3, mg.Box([lo], [0.1]))

    target = mg.Target("goal", polytope([0.5], [2.0]))
    assert_not_certified(mode(0.0), target, 30.0)
    assert_certified(mode(0.04), target, 12.0)


def test_pieces_must_all_get_through():
    # x' = x - x^3: the negative half goes to -1. A union over pieces would say yes.
    def mode(lo: float) -> mg.Mode:
        return flow("well", lambda x: x - x**3, mg.Box([lo], [1.0]))

    assert_not_certified(mode(-1.0), goal([0.9], [1.1]), 12.0)
    assert_certified(mode(0.2), goal([0.9], [1.1]), 12.0)


def test_a_box_hull_covers_what_the_set_does_not():
    # The diagonal set sweeps past the corner of the target: its hull overlaps, the set fits only turned.
    start = mg.Zonotope([1.0, 1.0], [[0.1, 0.02], [0.1, -0.02]])
    diagonal = mg.Target(
        "goal", mg.Polytope([[1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [-1.0, -1.0]], [0.03, 0.03, 1.0, 1.0])
    )
    wide = mg.Target(
        "goal", mg.Polytope([[1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [-1.0, -1.0]], [0.045, 0.045, 1.0, 1.0])
    )
    mode = flow("shear", lambda x: -0.5 * np.array([x[0] + x[1], x[0] + x[1]]), start)
    # x - y keeps its value, up to .04.
    assert_not_certified(mode, diagonal, 6.0)
    assert_certified(mode, wide, 6.0)


def still(start: mg.Box) -> mg.Mode:
    return flow("still", lambda x: 0.0 * x, start)


def test_one_unit_in_the_last_place():
    below = float(np.nextafter(1.0, 0.0))
    assert_not_certified(still(mg.Box([0.0], [1.0])), goal([0.0], [below]), 1.0)
    assert_certified(still(mg.Box([0.0], [1.0])), goal([0.0], [1.0]), 1.0)
    # .1 + .2 is not .3.
    assert_not_certified(still(mg.Box([0.0], [0.1 + 0.2])), goal([0.0], [0.3]), 1.0)


def test_one_ulp_in_a_ball():
    # In doubles .6^2 + .8^2 rounds to 1; the exact sum of squares of these two doubles exceeds it.
    assert 0.6 * 0.6 + 0.8 * 0.8 == 1.0
    assert Fraction(0.6) ** 2 + Fraction(0.8) ** 2 > 1
    mode = still(mg.Box([0.6, 0.8], [0.6, 0.8]))
    assert_not_certified(mode, mg.Target("goal", mg.Ball([0.0, 0.0], 1.0)), 1.0)
    assert_certified(mode, mg.Target("goal", mg.Ball([0.0, 0.0], 1.0 + 1e-15)), 1.0)


def test_an_empty_start_set_is_an_error_not_an_edge():
    empty = mg.Mode(
        "empty",
        mg.System(lambda x, u: u, states=1, inputs=1),
        controller=lambda x: -x,
        reference=mg.setpoint([0.0]),
        start=lambda r: mg.Polytope([[1.0], [-1.0]], [0.0, -1.0]),  # x <= 0 and x >= 1
    )
    with pytest.raises(mg.ModegraphError, match="empty"):
        mg.build([empty, goal([5.0], [6.0])], horizon=2.0)
    full = mg.Mode(
        "full",
        mg.System(lambda x, u: u, states=1, inputs=1),
        controller=lambda x: -x,
        reference=mg.setpoint([0.0]),
        start=lambda r: mg.Polytope([[1.0], [-1.0]], [2.0, -1.0]),  # 1 <= x <= 2
    )
    assert_certified(full, goal([-0.5], [0.5]), 3.0)
