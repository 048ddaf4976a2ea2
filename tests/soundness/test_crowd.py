"""The judge of many runs itself: numbers that are wrong on purpose have to be found out, right ones not."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import modegraph as mg
from tests.soundness.crowd import Crowd, checked, contradicted, crowd
from tests.soundness.parted import parts_together

UNTIL = 4.0
TIME = (math.log(5.0), math.log(10.0))  # x' = u = -x from [.5, 1] into |x| <= .1
ENERGY = 0.5 * (1.0 - 0.01)
GOAL = mg.Box([-0.1], [0.1])
ROOMS = {"top": lambda x, u: 1.2 - x[0]}


@pytest.fixture(scope="module")
def runs() -> Crowd:
    plant = mg.System(lambda x, u: u + 0.0 * x, states="x", inputs="u")
    mode = mg.Mode("decay", plant, controller=lambda x: -x, reference=mg.setpoint([0.0]), start=mg.Box([0.5], [1.0]))
    return crowd(mode, UNTIL, np.random.default_rng(0))


def faults(
    runs: Crowd,
    time: tuple[float, float] = TIME,
    margin: float = 1.0 - 10.0 * math.exp(-UNTIL) - 0.03,
    room: float = 0.2,
    energy: float = ENERGY,
    window: float = math.inf,
) -> list[str]:
    verdict = mg.Verdict(mg.Status.CERTIFIED, "", time=time, margin=margin, slack={"top": room})
    return contradicted(runs, GOAL, verdict, (energy, window), ROOMS)


def test_right_numbers_pass(runs: Crowd):
    assert not faults(runs)
    assert not checked(runs, mg.Verdict(mg.Status.CERTIFIED, "", slack={"top": 0.2}), ROOMS)


@pytest.mark.parametrize(
    ("wrong", "word"),
    [
        ({"time": (TIME[0], TIME[1] - 0.02)}, "outside"),
        ({"time": (TIME[0] + 0.01, TIME[1])}, "inside at"),
        ({"margin": 0.9}, "margin"),
        ({"room": 0.21}, "room"),
        ({"energy": 0.99 * ENERGY}, "spends"),
    ],
)
def test_a_wrong_number_is_found(runs: Crowd, wrong: dict[str, Any], word: str):
    assert any(word in text for text in faults(runs, **wrong))


def test_a_stay_that_is_too_short():
    # x' = 1 passes [1, 1.5] in half a second.
    plant = mg.System(lambda x, u: u + 0.0 * x, states="x", inputs="u")
    mode = mg.Mode("pass", plant, controller=lambda x: 1.0, reference=mg.setpoint([0.0]), start=mg.Box([0.0], [0.1]))
    runs = crowd(mode, 3.0, np.random.default_rng(0))
    verdict = mg.Verdict(mg.Status.CERTIFIED, "", time=(0.9, 1.2))
    assert not contradicted(runs, mg.Box([1.0], [1.5]), verdict, (1.0, 0.4), {})
    assert contradicted(runs, mg.Box([1.0], [1.5]), verdict, (1.0, 0.6), {})


def test_a_check_that_is_broken(runs: Crowd):
    assert checked(runs, mg.Verdict(mg.Status.CERTIFIED, ""), {"top": lambda x, u: 0.9 - x[0]})
    assert not checked(runs, mg.Verdict(mg.Status.UNDECIDED, "", until=0.0), {"top": lambda x, u: 1.1 - x[0]})


def test_the_linear_state_of_a_family_has_its_closed_form():
    # Of constant pushes at the extreme unknowns: the slowest of all runs is that of the formula.
    instance = parts_together(0)
    runs = crowd(instance.mode, instance.horizon, np.random.default_rng(0))
    start = instance.mode.start
    assert isinstance(start, mg.Box)
    spring = instance.mode.system.dynamics.__self__
    for k in (300, 900, -1):
        assert runs.x[k, 2].max() == pytest.approx(spring.late(float(start.hi[2]), float(runs.t[k])), rel=1e-6)
