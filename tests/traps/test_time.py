"""When the set is reached: different starts, a short horizon, the wrong clock, a slow drift."""

from __future__ import annotations

import numpy as np

import modegraph as mg
from tests.traps.question import (
    ask,
    assert_certified,
    assert_not_certified,
    assert_not_refuted,
    flow,
    goal,
)


def conveyor(disturbance: mg.Box | None = None, start: mg.Box | None = None) -> mg.Mode:
    """x' = 1 + w."""
    if disturbance is None:
        return flow("belt", lambda x: np.ones(1), start or mg.Box([0.0], [1.0]))
    return flow("belt", lambda x, w: 1.0 + w, start or mg.Box([0.0], [0.0]), disturbance=disturbance)


def test_starts_that_arrive_at_different_times_get_through_piece_by_piece():
    # No common instant exists: the starts are spread over 1, the target is .5 wide.
    assert_certified(conveyor(), goal([10.0], [10.5]), 12.0)


def test_the_slowest_start_decides_about_the_horizon():
    # x0 = 0 needs 10 s.
    assert_not_certified(conveyor(), goal([10.0], [10.5]), 9.9)
    assert_certified(conveyor(), goal([10.0], [10.5]), 10.4)


def test_no_common_time_under_disturbance_is_not_a_refutation():
    # Every run crosses [10, 11], no instant serves all: (C) is true.
    assert_not_refuted(conveyor(mg.Box([-0.5], [0.5])), goal([10.0], [11.0]), 40.0)


def test_a_disturbance_that_just_leaves_a_common_time():
    # |w| <= .05: inside from 10 / .95 = 10.53 s, gone from 11 / 1.05 = 10.48 s. (C) is true all the same.
    assert_not_refuted(conveyor(mg.Box([-0.05], [0.05])), goal([10.0], [11.0]), 20.0)
    # |w| <= .045: inside between 10.471 s and 10.526 s.
    assert_certified(conveyor(mg.Box([-0.045], [0.045])), goal([10.0], [11.0]), 20.0)


def decay() -> mg.Mode:
    return flow("decay", lambda x: -x, mg.Box([1.0], [1.1]))


def test_a_horizon_just_too_short():
    # The start 1.1 needs ln 11 = 2.398 s.
    assert_not_certified(decay(), goal([-0.1], [0.1]), 2.35)
    assert_certified(decay(), goal([-0.1], [0.1]), 2.45)


def test_the_target_is_the_start_set_at_its_own_time_zero():
    # "track" follows r(t) = t from its own entry: its start set is around 0, wherever r is 3 s later.
    plant = mg.System(lambda x, u: u, states=1, inputs=1)

    def hold(at: float) -> mg.Mode:
        return mg.Mode(
            "hold",
            plant,
            controller=lambda x, r: 2 * (r - x),
            reference=mg.setpoint([at]),
            start=mg.Box([0.5], [0.6]),
        )

    track = mg.Mode(
        "track",
        plant,
        controller=lambda x, r: r.dot + 2 * (r - x),
        reference=mg.trajectory(lambda t: np.array([1.0 * t]), 5.0),
        start=lambda r: mg.Ball(r, 0.2),
    )
    assert_not_certified(hold(3.0), track, 8.0)
    assert_certified(hold(0.0), track, 8.0)


def test_a_slow_drift_is_no_tail():
    # y grows by .0001 a second and passes 1 after three hours: nothing seems to move in any window.
    drift = flow(
        "drift",
        lambda x: np.array([-x[0], 1e-4]),
        mg.Box([-0.1, 0.0], [0.1, 0.0]),
        constraints=lambda x: {"y": x[1] <= 1.0},
    )
    settling = flow(
        "settling",
        lambda x: np.array([-x[0], 0.5 * (0.9 - x[1])]),
        mg.Box([-0.1, 0.0], [0.1, 0.0]),
        constraints=lambda x: {"y": x[1] <= 1.0},
    )
    assert mg.build([drift], horizon=10.0).check("drift").status is not mg.Status.CERTIFIED
    assert mg.build([settling], horizon=10.0).check("settling").status is mg.Status.CERTIFIED


def test_a_tail_must_not_start_from_a_set_that_only_looks_smaller():
    # Weakly unstable spiral whose first coordinate shrinks for the first half turn.
    def spiral(growth: float) -> mg.Mode:
        return flow(
            "spiral",
            lambda x: np.array([growth * x[0] - x[1], x[0] + growth * x[1]]),
            mg.Box([0.4, -0.1], [0.5, 0.1]),
            constraints=lambda x: {"x": abs(x[0]) <= 1.0},
        )

    assert mg.build([spiral(0.02)], horizon=8.0).check("spiral").status is not mg.Status.CERTIFIED
    assert mg.build([spiral(-0.3)], horizon=12.0).check("spiral").status is mg.Status.CERTIFIED


def test_zero_time_counts_and_reports_zero():
    verdict = ask(decay(), goal([0.9], [1.2]), 5.0)
    assert verdict.status is mg.Status.CERTIFIED
    assert verdict.time == (0.0, 0.0)


def meets_a_kink() -> mg.Mode:
    """x' = -1 - max(x, 0) from x0 in [1, 2]: at the kink, which is the target, after log(1 + x0) seconds."""
    return flow("kink", lambda x: -1.0 - np.maximum(x, 0.0), mg.Box([1.0], [2.0]))


def test_starts_that_meet_a_kink_at_their_own_times_are_not_there_together():
    # x0 = 2 is at .05 after log(3 / 1.05) = 1.0498 s.
    assert_not_certified(meets_a_kink(), goal([-0.05], [0.05]), 1.04)
    assert_certified(meets_a_kink(), goal([-0.05], [0.05]), 1.15)
