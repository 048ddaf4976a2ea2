"""Parts of the unknowns that go on from one set, unknowns that are known exactly, starts of one point at a kink."""

from __future__ import annotations

import math

import numpy as np
import pytest

import modegraph as mg
from tests.soundness.answering import Answering
from tests.traps.question import ask, assert_certified, assert_not_certified, flow, goal


def spring(soft: float, stiff: float, push: float) -> mg.Mode:
    """A hardening spring of stiffness k in [.5, 4.5]; s from 4 beside it decays at a rate from soft to stiff."""
    slope = (stiff - soft) / 4.0
    return flow(
        "spring",
        lambda x, w, d: np.array(
            [x[1], w[0] - d["k"] * x[0] - x[1] - x[0] ** 3, w[1] - (soft + slope * (d["k"] - 0.5)) * x[2]]
        ),
        mg.Box([1.4, -0.1, 4.0], [1.6, 0.1, 4.0]),
        disturbance=mg.Box([-0.05, -push], [0.05, push]),
        unknowns={"k": (0.5, 4.5)},
    )


def below(level: float) -> mg.Target:
    return goal([-9.0, -9.0, -9.0], [9.0, 9.0, level])


def linear(rate: float, w: float, t: float) -> float:
    """s after t seconds."""
    return w / rate + (4.0 - w / rate) * math.exp(-rate * t)


def test_a_part_of_an_unknown_goes_on_with_its_own_range():
    # k = 4.5 under w1 = .055 decays at .07 only and is at 1.34 after 25 s; other parts are below 1.3 by 14 s.
    assert linear(0.07, 0.055, 25.0) > 1.34
    assert_not_certified(spring(0.32, 0.07, 0.055), below(1.3), 25.0)
    # With .26 even that end is at 1.3 after 5.3 s.
    assert linear(0.26, 0.05, 5.9) < 1.3
    assert_certified(spring(0.31, 0.26, 0.05), below(1.6), 12.0)


def test_two_parts_that_go_on_together_have_each_its_own_clock():
    # k = .5 under w1 = -.05 is at 1.4 after 3.162 s; the part that is enclosed with it is behind.
    first = math.log((4.0 + 0.05 / 0.31) / (1.4 + 0.05 / 0.31)) / 0.31
    assert linear(0.31, -0.05, first) == pytest.approx(1.4, abs=1e-12)
    verdict = assert_certified(spring(0.31, 0.26, 0.05), below(1.4), 12.0)
    assert verdict.time is not None
    assert verdict.time[0] <= first


@pytest.mark.parametrize("order", ["ab", "ba"])
def test_an_unknown_of_one_value_may_stand_anywhere(order: str):
    # b = .9 exactly; where it is named says nothing about the loop.
    ranges = {"a": (0.95, 1.95), "b": (0.9, 0.9)}
    mode = flow(
        "sum",
        lambda x, d: np.array([x[1], -(d["a"] + d["b"]) * x[0] - 0.5 * x[1] - x[0] ** 3]),
        mg.Box([0.7, -0.3], [1.3, 0.3]),
        unknowns={name: ranges[name] for name in order},
    )
    assert_certified(mode, mg.Target("goal", mg.Ball([0.0, 0.0], 0.15)), 40.0)


def kinked(p: float, friction: float) -> mg.Mode:
    """x'' = -1.1 max(x, 0) + 1.1 max(-x, 0) - friction x' - x^3: the kinks at 0 undo each other."""
    return flow(
        "kinked",
        lambda x: np.array(
            [x[1], 1.1 * (np.maximum(-x[0], 0.0) - np.maximum(x[0], 0.0)) - friction * x[1] - x[0] ** 3]
        ),
        mg.Box([p, -0.2], [p, 0.2]),
    )


def test_newton_stops_at_a_kink_without_a_slope():
    # The equilibrium lies on the kink, where one choice of slopes leaves no stiffness at all.
    assert_certified(kinked(0.55, 0.6), goal([-0.1, -0.1], [0.1, 0.1]), 10.0)


def settles() -> mg.Verdict:
    return ask(kinked(0.8, 0.7), goal([-0.1, -0.1], [0.1, 0.1]), 10.0)


def test_a_start_too_thin_to_be_halved_ends():
    # p is one double: half of it is itself, and a search that halves on never ends. So it is asked elsewhere.
    with Answering() as process:
        verdict = process.call(settles)
    assert verdict is not None, "no answer, many budgets after it was asked"
    assert verdict.status is mg.Status.CERTIFIED, verdict.reason
