"""Disturbances at, below and above the breaking size, resonance, unknown constants, limit cycles."""

from __future__ import annotations

import numpy as np

import modegraph as mg
from tests.traps.question import assert_certified, assert_not_certified, assert_not_refuted, flow, goal


def pushed(size: float) -> mg.Mode:
    return flow("push", lambda x, w: w - x, mg.Box([0.9], [1.0]), disturbance=mg.Box([-size], [size]))


def test_the_breaking_size():
    # With w = size the state rests at size: just above .5 it stays out, at .5 it only tends to the edge.
    assert_not_certified(pushed(0.51), goal([-0.5], [0.5]), 8.0)
    assert_not_certified(pushed(0.5), goal([-0.5], [0.5]), 8.0)
    assert_certified(pushed(0.48), goal([-0.5], [0.5]), 8.0)


def test_a_resonant_disturbance_is_worse_than_every_constant_one():
    # x'' = w - x - .2 x', |w| <= .1: constants lift x to .173, a square wave in resonance to .607 by t = 30.
    def mode(limit: float) -> mg.Mode:
        return flow(
            "swing",
            lambda x, w: np.array([x[1], w[0] - x[0] - 0.2 * x[1], 1.0 + 0.0 * x[2]]),
            mg.Box([-0.01, -0.01, 0.0], [0.01, 0.01, 0.0]),
            disturbance=mg.Box([-0.1], [0.1]),
            constraints=lambda x: {"amplitude": abs(x[0]) <= limit},
        )

    after = goal([-5.0, -5.0, 29.9], [5.0, 5.0, 30.5])
    assert_not_certified(mode(0.55), after, 31.0)
    assert_certified(mode(0.72), after, 31.0)


def test_a_disturbance_through_a_state_dependent_matrix():
    # x' = (w - 1) x: |w| <= 1.1 can make it grow; freezing the factor x at the start would not notice.
    def mode(size: float) -> mg.Mode:
        return flow("gain", lambda x, w: (w - 1.0) * x, mg.Box([0.9], [1.0]), disturbance=mg.Box([-size], [size]))

    assert_not_certified(mode(1.1), goal([-0.5], [0.5]), 8.0)
    assert_certified(mode(0.5), goal([-0.5], [0.5]), 8.0)


def test_a_disturbance_that_grows_with_the_state():
    # The push .4 (1 + x^2) w reaches .8 at x = 1 but .5 at x = .5: x = .5 is held by w = 1 exactly.
    def mode(size: float) -> mg.Mode:
        return flow(
            "grow",
            lambda x, w: -x + size * (1 + x**2) * w,
            mg.Box([0.8], [1.0]),
            disturbance=mg.Box([-1.0], [1.0]),
        )

    assert_not_certified(mode(0.41), goal([-0.5], [0.5]), 10.0)
    assert_certified(mode(0.3), goal([-0.5], [0.5]), 12.0)


def test_a_disturbance_off_centre():
    # w in [.3, .5] with mean .4: x rests anywhere in [.3, .5].
    def mode(hi: float) -> mg.Mode:
        return flow("bias", lambda x, w: w - x, mg.Box([0.9], [1.0]), disturbance=mg.Box([0.3], [hi]))

    assert_not_certified(mode(0.5), goal([-0.45], [0.45]), 10.0)
    assert_certified(mode(0.43), goal([-0.45], [0.45]), 10.0)


def test_unknowns_are_correlated():
    # x1' = a, x2' = -a: x1 + x2 keeps its value (|.| <= .04) whatever a in [-1, 1] is.
    def mode(limit: float) -> mg.Mode:
        return flow(
            "pair",
            lambda x, d: np.array([d["a"], -d["a"], 1.0]),
            mg.Box([-0.02, -0.02, 0.0], [0.02, 0.02, 0.0]),
            unknowns={"a": (-1.0, 1.0)},
            constraints=lambda x: {"sum": abs(x[0] + x[1]) <= limit},
        )

    assert_not_certified(mode(0.039), goal([-9.0, -9.0, 1.0], [9.0, 9.0, 1.2]), 2.0)
    assert_certified(mode(0.0405), goal([-9.0, -9.0, 1.0], [9.0, 9.0, 1.2]), 2.0)


def test_one_value_of_an_unknown_never_arrives():
    # x' = a: a = 0 stays at 0. A union over pieces of the unknown would say yes.
    def mode(lo: float, hi: float) -> mg.Mode:
        return flow("rate", lambda x, d: d["a"] + 0.0 * x, mg.Box([0.0], [0.01]), unknowns={"a": (lo, hi)})

    assert_not_certified(mode(0.0, 1.0), goal([1.0], [1.2]), 20.0)
    assert_certified(mode(0.95, 1.05), goal([1.0], [1.2]), 20.0)


def test_unknowns_that_arrive_at_different_times_are_no_refutation():
    # a in [.5, 1] crosses [1, 1.2] at 1 / a: (C) is true, piece by piece of the unknown.
    mode = flow("rate", lambda x, d: d["a"] + 0.0 * x, mg.Box([0.0], [0.01]), unknowns={"a": (0.5, 1.0)})
    assert_not_refuted(mode, goal([1.0], [1.2]), 20.0)


def test_an_unknown_is_constant_and_a_disturbance_is_not():
    # x' = y, y' = -x + p: a constant p in +-.1 swings x by at most .2; a signal pumps it without bound.
    def mode(moving: bool) -> mg.Mode:
        start, limit = mg.Box([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]), 0.22
        bound = lambda x: {"x": abs(x[0]) <= limit}
        if moving:
            return flow(
                "swing",
                lambda x, w: np.array([x[1], w[0] - x[0], 1.0]),
                start,
                disturbance=mg.Box([-0.1], [0.1]),
                constraints=bound,
            )
        return flow(
            "swing",
            lambda x, d: np.array([x[1], d["p"] - x[0], 1.0]),
            start,
            unknowns={"p": (-0.1, 0.1)},
            constraints=bound,
        )

    after = goal([-9.0, -9.0, 9.0], [9.0, 9.0, 9.2])
    assert_not_certified(mode(True), after, 10.0)
    assert_certified(mode(False), after, 10.0)


def test_a_limit_cycle_around_the_target():
    # The radius tends to 1 from outside: a ball of .9 is never reached, one of 1.05 is.
    mode = flow(
        "cycle",
        lambda x: np.array([x[0] - x[1] - x[0] * (x @ x), x[0] + x[1] - x[1] * (x @ x)]),
        mg.Box([1.45, -0.05], [1.55, 0.05]),
    )
    assert_not_certified(mode, mg.Target("goal", mg.Ball([0.0, 0.0], 0.95)), 8.0)
    assert_certified(mode, mg.Target("goal", mg.Ball([0.0, 0.0], 1.05)), 8.0)


def test_van_der_pol_leaves_its_equilibrium():
    # The equilibrium inside the cycle repels; run backwards it attracts.
    def mode(direction: float) -> mg.Mode:
        return flow(
            "oscillator",
            lambda x: np.array([x[1], direction * (1.0 - x[0] ** 2) * x[1] - x[0]]),
            mg.Box([0.45, -0.05], [0.55, 0.05]),
        )

    target = mg.Target("goal", mg.Ball([0.0, 0.0], 0.25))
    assert_not_certified(mode(1.0), target, 8.0)
    assert_certified(mode(-1.0), target, 8.0)
