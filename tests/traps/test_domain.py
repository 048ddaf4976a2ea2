"""Right-hand sides that end, jump or bend: poles, finite escape, cuts, `where`, kinks."""

from __future__ import annotations

import contextlib

import numpy as np

import modegraph as mg
from tests.traps.question import assert_certified, assert_not_certified, flow, goal


def refused_or_not_certified(source: mg.Mode, target: mg.Target, horizon: float) -> None:
    """A right-hand side without a unique solution may be refused by name; it may never be certified."""
    with contextlib.suppress(mg.ModegraphError):
        assert_not_certified(source, target, horizon)


def test_a_pole_on_the_way():
    # x' = 1 / (pole - x): the solution ends at the pole.
    def mode(pole: float) -> mg.Mode:
        return flow("pole", lambda x: 1.0 / (pole - x), mg.Box([0.0], [0.05]))

    refused_or_not_certified(mode(1.0), goal([2.0], [3.0]), 8.0)
    assert_certified(mode(3.2), goal([2.0], [3.0]), 8.0)


def test_finite_escape_that_comes_back_from_the_other_side():
    # tan(t) reappears below: a step over the pole would find it in [-2, -1].
    mode = flow("escape", lambda x: 1.0 + x**2, mg.Box([0.0], [0.1]))
    assert_not_certified(mode, goal([-2.0], [-1.0]), 4.0)
    assert_certified(mode, goal([1.0], [3.0]), 4.0)


def test_finite_escape_of_a_quadratic():
    # x' = x^2 from 1 escapes at t = 1; x = 1 / (1 - t) continues at -1 when t = 2.
    mode = flow("blow", lambda x: x * x, mg.Box([0.98], [1.02]))
    assert_not_certified(mode, goal([-1.3], [-0.7]), 3.0)
    assert_certified(mode, goal([1.9], [2.4]), 3.0)


def test_a_cancelled_pole_is_still_a_pole():
    # (x^2 - c^2) / (x - c) = x + c except at x = c, where the user's function has no value.
    def mode(c: float) -> mg.Mode:
        return flow("cancel", lambda x: (x**2 - c**2) / (x - c), mg.Box([0.0], [0.1]))

    refused_or_not_certified(mode(1.0), goal([2.0], [3.0]), 6.0)
    assert_certified(mode(4.0), goal([2.0], [3.0]), 6.0)


def test_a_cancelled_pole_in_a_matrix_inverse():
    # M(x) v solved with M(x) again: v, unless M(x) is singular on the way (at x = 1.5, det = x - 1.5).
    def mode(singular: float) -> mg.Mode:
        def dynamics(x: np.ndarray) -> np.ndarray:
            M = np.array([[x[0] - singular, 0.3], [0.0, 1.0]])
            return np.linalg.solve(M, M @ np.array([1.0, -x[1]]))

        return flow("inverse", dynamics, mg.Box([0.0, -0.1], [0.1, 0.1]))

    refused_or_not_certified(mode(1.5), goal([2.0, -0.5], [2.5, 0.5]), 5.0)
    assert_certified(mode(-1.5), goal([2.0, -0.5], [2.5, 0.5]), 5.0)


def test_the_end_of_a_square_root():
    # x' = -sqrt(x) reaches 0 in 2 s, where it stays; it never goes on to negative values.
    mode = flow("drain", lambda x: -np.sqrt(x), mg.Box([1.0], [1.1]))
    refused_or_not_certified(mode, goal([-1.0], [-0.1]), 5.0)
    assert_certified(mode, goal([0.04], [0.3]), 5.0)


def test_the_end_of_a_logarithm():
    # x' = log(x) - 2 runs into 0 in finite time.
    mode = flow("log", lambda x: np.log(x) - 2.0, mg.Box([1.0], [1.1]))
    refused_or_not_certified(mode, goal([-1.0], [-0.1]), 5.0)
    assert_certified(mode, goal([0.3], [0.7]), 5.0)


def bearing(at: float) -> mg.Mode:
    """A point on the unit circle, starting at angle ``at``, and the integral of its bearing."""
    c, s = float(np.cos(at)), float(np.sin(at))
    return flow(
        "bearing",
        lambda x: np.array([-x[1], x[0], np.arctan2(x[1], x[0])]),
        mg.Box([c - 0.001, s - 0.001, 0.0], [c + 0.001, s + 0.001, 0.0]),
    )


def test_arctan2_across_its_cut():
    # From 170 to 190 degrees the bearing jumps from pi to -pi and its integral comes back to 0; a bearing
    # continued smoothly would collect 1.096.
    over = float(np.radians(190.0))
    where = [float(np.cos(over)), float(np.sin(over))]
    across = goal([where[0] - 0.1, where[1] - 0.05, 1.0], [where[0] + 0.1, where[1] + 0.05, 1.2])
    refused_or_not_certified(bearing(float(np.radians(170.0))), across, 1.0)


def test_arctan2_away_from_its_cut():
    # From 100 to 120 degrees: .349 * 1.92 = .670. From -10 to 10 degrees, through y = 0 with x > 0: 0.
    for begin, collected in ((100.0, 0.670), (-10.0, 0.0)):
        end = float(np.radians(begin + 20.0))
        c, s = float(np.cos(end)), float(np.sin(end))
        assert_certified(
            bearing(float(np.radians(begin))),
            goal([c - 0.02, s - 0.02, collected - 0.1], [c + 0.02, s + 0.02, collected + 0.1]),
            1.0,
        )


def test_a_discontinuous_where_has_a_sliding_mode():
    # Pushed up below 1 and down above it: the state never gets past 1.
    sliding = flow("slide", lambda x: np.where(x < 1.0, 1.0, -1.0) + 0.0 * x, mg.Box([0.0], [0.1]))
    refused_or_not_certified(sliding, goal([1.5], [3.0]), 6.0)


def test_a_where_that_is_continuous_is_a_kink():
    # x' = x below 1, 2x - 1 above: continuous, Lipschitz.
    kink = flow("kink", lambda x: np.where(x < 1.0, x, 2.0 * x - 1.0), mg.Box([0.5], [0.55]))
    assert_certified(kink, goal([1.8], [3.0]), 6.0)


def test_a_where_with_a_small_jump_is_still_discontinuous():
    # The branches miss each other by 1e-9 at x = 1 and the field pushes back there: 1 cannot be passed.
    gap = flow("gap", lambda x: np.where(x < 1.0, 1.0 - x, -1e-9 - (x - 1.0)), mg.Box([0.0], [0.1]))
    refused_or_not_certified(gap, goal([1.0 + 1e-6], [2.0]), 6.0)


def test_the_wrong_branch_of_an_absolute_value():
    # x' = .1 - |x|: -.1 is an unstable equilibrium; everything below it leaves to minus infinity.
    def mode(lo: float) -> mg.Mode:
        return flow("vee", lambda x: 0.1 - abs(x), mg.Box([lo], [0.5]))

    assert_not_certified(mode(-0.11), goal([0.05], [0.15]), 12.0)
    assert_certified(mode(-0.08), goal([0.05], [0.15]), 12.0)


def thrust(lo: float, hi: float, limit: float) -> mg.Mode:
    """An unstable cart x' = x + clip(-3 x, -limit, limit)."""
    return mg.Mode(
        "cart",
        mg.System(lambda x, u: x + u, states=1, inputs=1),
        controller=lambda x: np.clip(-3.0 * x, -limit, limit),
        reference=mg.setpoint([0.0]),
        start=mg.Box([lo], [hi]),
    )


def test_saturation_spoils_the_approach():
    # Beyond x = 1 the saturated input cannot hold the cart.
    assert_not_certified(thrust(0.5, 1.03, 1.0), goal([-0.1], [0.1]), 10.0)
    assert_certified(thrust(0.5, 0.95, 1.0), goal([-0.1], [0.1]), 10.0)


def test_saturation_lengthens_the_approach():
    # |u| <= 1: no input gets from 5 to rest near 0 in less than 2 sqrt(4.9) = 4.43 s.
    def mode() -> mg.Mode:
        return mg.Mode(
            "mass",
            mg.System(lambda x, u: np.array([x[1], u[0]]), states="x v", inputs="u"),
            controller=lambda x: np.minimum(np.maximum(-2.0 * x[0] - 4.0 * x[1], -1.0), 1.0),
            reference=mg.setpoint([0.0]),
            start=mg.Box([4.98, -0.02], [5.02, 0.02]),
        )

    assert_not_certified(mode(), goal([-0.1, -0.1], [0.1, 0.1]), 4.3)
    assert_certified(mode(), goal([-0.1, -0.1], [0.1, 0.1]), 25.0)
