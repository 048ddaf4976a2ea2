"""Boxes proved to lie in a sublevel set, or apart from it."""

import numpy as np
import pytest

from modegraph.model.sets.level_function import LevelFunction
from modegraph.model.sets.level_search import all_inside, all_outside

ANNULUS = LevelFunction(lambda x: (x[0] ** 2 + x[1] ** 2 - 1) ** 2, 0.04, 2)
"""The radius is within sqrt(.8) = .894 and sqrt(1.2) = 1.095."""


@pytest.mark.parametrize(
    "lo, hi, inside, outside",
    [
        ([0.9, -0.1], [1.08, 0.1], True, False),
        ([0.9, -0.1], [1.1, 0.1], False, False),
        ([0.62, 0.65], [0.77, 0.77], True, False),
        ([-0.63, -0.63], [0.63, 0.63], False, True),
        ([-0.63, -0.63], [0.64, 0.64], False, False),
        ([1.1, -5.0], [9.0, 5.0], False, True),
        ([0.0, 1.0], [0.0, 1.0], True, False),
        ([0.0, 0.5], [0.0, 0.5], False, True),
    ],
)
def test_what_is_proved_of_a_box(lo, hi, inside, outside):
    lo, hi = np.array(lo), np.array(hi)
    assert all_inside(ANNULUS, lo, hi) == inside
    assert all_outside(ANNULUS, lo, hi) == outside


@pytest.mark.parametrize("most, enough", [(10, False), (3000, True)])
def test_a_search_that_ends_too_early_proves_nothing(most, enough):
    # x y - x - y = (x - 1)(y - 1) - 1 is between -2 and 0 on the box, which its ranges on large cells do not show.
    box = np.zeros(2), np.full(2, 2.0)

    def product(level):
        return LevelFunction(lambda x: x[0] * x[1] - x[0] - x[1], level, 2)

    assert all_inside(product(0.1), *box, most) == enough
    assert all_outside(product(-2.1), *box, most) == enough
    assert not all_inside(product(-0.1), *box, most)
    assert not all_outside(product(-1.9), *box, most)
