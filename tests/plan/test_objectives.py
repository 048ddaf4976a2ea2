from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from modegraph.errors import ModegraphError
from modegraph.plan.objectives import objective
from tests.graph.fakes import certified


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
    assert objective(minimize).cost(certified(2.5, energy=7.0)) == (0, Fraction(cost))


@pytest.mark.parametrize("energy", [None, math.inf])
def test_a_missing_energy_bound_is_an_infinity_unless_it_has_no_weight(energy: float | None) -> None:
    verdict = certified(2.5, energy=energy)
    assert objective("energy").cost(verdict)[0] == 1
    assert objective({"time": 1, "energy": 0}).cost(verdict) == (0, Fraction(2.5))


@pytest.mark.parametrize(
    "minimize",
    ["speed", None, 3, {}, {"margin": 1}, {"time": -1}, {"time": math.nan}, {"time": True}, {"time": "1"}],
)
def test_other_objectives_are_errors(minimize: Any) -> None:
    with pytest.raises(ModegraphError):
        objective(minimize)


def test_distance_is_that_between_references_of_one_size() -> None:
    wanted = objective("distance")
    verdict = certified(2.5, energy=7.0)
    assert wanted.cost(verdict, np.array([0.0, 0.0]), np.array([3.0, 4.0])) == (0, Fraction(5))
    assert wanted.cost(verdict, np.array([0.0]), np.array([3.0, 4.0])) == (0, Fraction(0))
    assert wanted.cost(verdict, None, np.array([3.0])) == (0, Fraction(0))
