from __future__ import annotations

import itertools
import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from modegraph.errors import ModegraphError
from modegraph.plan.objectives import objective


@pytest.mark.parametrize(
    ("minimize", "cost"),
    [
        ("switches", 1),
        ("time", 2.5),
        ("energy", 7.0),
        ({"time": 2, "switches": 0.5}, 5.5),
        ({"energy": 0, "time": 1}, 2.5),
    ],
)
def test_cost_of_one_switch(minimize: Any, cost: float) -> None:
    assert objective(minimize).cost(2.5, 7.0) == (0, Fraction(cost))


@pytest.mark.parametrize("energy", [None, math.inf])
def test_a_missing_energy_bound_is_an_infinity_unless_it_has_no_weight(energy: float | None) -> None:
    assert objective("energy").cost(2.5, energy)[0] == 1
    assert objective({"time": 1, "energy": 0}).cost(2.5, energy) == (0, Fraction(2.5))


@pytest.mark.parametrize(
    "minimize",
    ["speed", None, 3, {}, {"margin": 1}, {"time": -1}, {"time": math.nan}, {"time": True}, {"time": "1"}],
)
def test_other_objectives_are_errors(minimize: Any) -> None:
    with pytest.raises(ModegraphError):
        objective(minimize)


def test_distance_is_that_between_references_of_one_size() -> None:
    wanted = objective("distance")
    assert wanted.cost(2.5, 7.0, np.array([0.0, 0.0]), np.array([3.0, 4.0])) == (0, Fraction(5))
    assert wanted.cost(2.5, 7.0, np.array([0.0]), np.array([3.0, 4.0])) == (0, Fraction(0))
    assert wanted.cost(2.5, 7.0, None, np.array([3.0])) == (0, Fraction(0))


def test_many_short_steps_are_no_shorter_than_one_long() -> None:
    """Floats of a third and a sixth add up to less than those of the whole, or to more."""
    wanted = objective("distance", size=1.0)
    whole = wanted.cost(1.0, None, np.array([0.0]), np.array([0.7]))[1]
    ends = np.linspace(0.0, 0.7, 8)
    steps = sum(wanted.cost(1.0, None, np.array([a]), np.array([b]))[1] for a, b in itertools.pairwise(ends))
    assert whole <= steps <= whole + Fraction(1e-8)
