"""X_i has to hold up to the switch, at every instant and at both sides of a jump, and not beyond."""

from __future__ import annotations

import numpy as np

import modegraph as mg
from tests.traps.question import assert_certified, assert_not_certified, flow, goal


def wave(ceiling: float) -> mg.Mode:
    """(x, y) = (t, sin t), |y0| <= .01, y bounded by ``ceiling``."""
    return flow(
        "wave",
        lambda x: np.array([1.0 + 0.0 * x[0], np.cos(x[0])]),
        mg.Box([0.0, -0.01], [0.0, 0.01]),
        constraints=lambda x: {"ceiling": x[1] <= ceiling},
    )


def test_leaving_and_coming_back_before_the_target():
    # sin passes .95 between t = 1.25 and 1.89; the target begins at 3.
    assert_not_certified(wave(0.95), goal([3.0, -1.0], [3.5, 1.0]), 6.0)
    assert_certified(wave(1.03), goal([3.0, -1.0], [3.5, 1.0]), 6.0)


def test_leaving_only_after_the_target():
    # .95 is passed between t = 1.22 and 1.29: beyond a target that begins at 1, before one at 1.3.
    assert_not_certified(wave(0.95), goal([1.3, -1.0], [1.5, 1.0]), 6.0)
    verdict = assert_certified(wave(0.95), goal([1.0, -1.0], [1.2, 1.0]), 6.0)
    assert verdict.time is not None
    assert verdict.time[1] <= 1.2
    assert mg.build([wave(0.95)], horizon=6.0).check("wave").status is not mg.Status.CERTIFIED


def spike_in_time(height: float) -> mg.Mode:
    """x' = -x from about .5; the bound dips by ``height`` for about a millisecond at t = .2345."""
    return flow(
        "spike",
        lambda x: -x,
        mg.Box([0.49], [0.5]),
        constraints=lambda x, t: {"dip": x[0] + height * np.exp(-(((t - 0.2345) * 1e3) ** 2)) <= 1.0},
    )


def test_a_constraint_spike_narrower_than_a_step_in_time():
    # x(.2345) is at least .387.
    assert_not_certified(spike_in_time(0.65), goal([-0.2], [0.2]), 3.0)
    assert_certified(spike_in_time(0.58), goal([-0.2], [0.2]), 3.0)


def test_a_constraint_spike_narrower_than_a_step_in_space():
    def mode(height: float) -> mg.Mode:
        return flow(
            "post",
            lambda x: np.ones(1),
            mg.Box([0.0], [0.01]),
            constraints=lambda x: {"post": height / (1 + 3e4 * (x[0] - 0.777) ** 2) <= 1.0},
        )

    assert_not_certified(mode(1.05), goal([1.0], [1.2]), 3.0)
    assert_certified(mode(0.95), goal([1.0], [1.2]), 3.0)


def kicked(width: float) -> mg.Mode:
    """x' = 1, y' = a kick of ``width`` seconds at t = .6180 that lifts y by sqrt(pi) = 1.7725."""
    plant = mg.System(lambda x, u: np.array([1.0 + 0.0 * x[0], u[0]]), states="x y", inputs="rate")
    return mg.Mode(
        "kick",
        plant,
        controller=lambda t: np.exp(-(((t - 0.618) / width) ** 2)) / width,
        reference=mg.setpoint([0.0]),
        start=mg.Box([0.0, -0.02], [0.01, 0.02]),
    )


def test_a_kick_shorter_than_a_step_in_the_dynamics():
    assert_not_certified(kicked(0.001), goal([1.0, -0.3], [1.2, 0.3]), 2.0, breaks=(0.614, 0.618, 0.622))
    assert_certified(kicked(0.02), goal([1.0, 1.7], [1.2, 1.85]), 2.0)


def test_illegal_at_time_zero():
    # The start set is inside the target, so the switch takes no time; it still has to be inside X_i.
    def mode(limit: float) -> mg.Mode:
        return flow("still", lambda x: -x, mg.Box([-0.4], [0.5]), constraints=lambda x: {"x": x[0] <= limit})

    assert_not_certified(mode(0.49), goal([-1.0], [1.0]), 2.0)
    assert_certified(mode(0.51), goal([-1.0], [1.0]), 2.0)


def stepped(limit: float) -> mg.Mode:
    """The reference jumps from 0 to 1 at t = 1, and the force 2 (r - x) with it, to nearly 2."""
    return mg.Mode(
        "step",
        mg.System(lambda x, u: u, states=1, inputs="force"),
        controller=lambda x, r: 2 * (r - x),
        reference=mg.trajectory(lambda t: np.array([np.where(t < 1.0, 0.0, 1.0)]), 3.0, breakpoints=[1.0]),
        start=mg.Box([-0.01], [0.01]),
        constraints=lambda u: {"force": abs(u[0]) <= limit},
    )


def jump_at_one(t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return np.array([0.0 if t < 1.0 else 1.0]), np.zeros(1), np.zeros(1)


def test_a_reference_jump_violates_an_input_bound_for_an_instant():
    about = {"signal": jump_at_one, "breaks": (1.0,)}
    assert_not_certified(stepped(1.9), goal([0.8], [1.1]), 4.0, **about)
    assert_certified(stepped(2.04), goal([0.8], [1.1]), 4.0, **about)


def test_a_one_sided_input_at_a_breakpoint():
    # The feed-forward is 2 at t = 1 and falls by 1 in the next hundredth of a second.
    def burst(t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return np.array([0.5 if t < 1.0 else 1.0 + np.exp(-100 * (t - 1.0))]), np.zeros(1), np.zeros(1)

    def mode(limit: float) -> mg.Mode:
        return mg.Mode(
            "burst",
            mg.System(lambda x, u: u, states=1, inputs="rate"),
            controller=lambda r: r,
            reference=mg.trajectory(
                lambda t: np.array([np.where(t < 1.0, 0.5, 1.0 + np.exp(-100 * (t - 1.0)))]),
                4.0,
                breakpoints=[1.0],
            ),
            start=mg.Box([-0.01], [0.01]),
            constraints=lambda u: {"rate": u[0] <= limit},
        )

    about = {"signal": burst, "breaks": (1.0,)}
    assert_not_certified(mode(1.95), goal([1.4], [1.6]), 3.5, **about)
    assert_certified(mode(2.04), goal([1.4], [1.6]), 3.5, **about)


def test_an_input_bound_is_a_state_bound():
    # u = -4 x at x0 = .5: the input is over its bound only at the very start.
    def mode(limit: float) -> mg.Mode:
        return mg.Mode(
            "brake",
            mg.System(lambda x, u: u, states=1, inputs="u"),
            controller=lambda x: -4.0 * x[0],
            reference=mg.setpoint([0.0]),
            start=mg.Box([0.4], [0.5]),
            constraints=lambda u: {"u": abs(u[0]) <= limit},
        )

    assert_not_certified(mode(1.98), goal([-0.1], [0.1]), 3.0)
    assert_certified(mode(2.04), goal([-0.1], [0.1]), 3.0)


def saturated(speed: float) -> mg.Mode:
    """A point that leaves its saturation at full speed, each start at another time."""
    return flow(
        "saturated", lambda x: np.array([x[1], np.clip(-9.0 * x[0] - 6.0 * x[1], -2.0, 2.0)]),
        mg.Box([0.6, -0.1], [1.0, 0.1]), constraints=lambda x: {"speed": -x[1] <= speed},
    )  # fmt: skip


def test_the_fastest_instant_is_while_the_starts_pass_a_kink():
    # v' = 0 where 9 x + 6 v = 0, inside the band: the start (1, -.1) gets fastest, 1.00506.
    assert_not_certified(saturated(1.004), goal([-0.2, -0.2], [0.2, 0.2]), 4.0)
    assert_certified(saturated(1.1), goal([-0.2, -0.2], [0.2, 0.2]), 4.0)
