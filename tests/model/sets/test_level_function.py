"""The function of a sublevel set: its parts, its ranges, and exact membership."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from modegraph.errors import ModegraphError
from modegraph.model.sets.level_function import LevelFunction


def test_an_outer_maximum_is_split_into_parts():
    function = LevelFunction(lambda x: 1.0 + np.maximum(np.maximum(x[0], x[1] ** 2), 0.5 - x[0]), 2.0, 2)
    assert len(function.parts) == 3
    # At most 2, with 1 added outside; the constant of a part goes along.
    assert [part.bound(function.level) for part in function.parts] == [1, 1, Fraction(1, 2)]
    assert len(LevelFunction(lambda x: x[0] + x[1], 1.0, 2).parts) == 1


def test_a_root_is_compared_by_its_square():
    (part,) = LevelFunction(lambda x: np.sqrt(x[0] ** 2 + x[1] ** 2) - 1.0, 1.0, 2).parts
    assert part.root
    assert part.bound(Fraction(1)) == 4
    assert part.bound(Fraction(-2)) is None


def test_membership_is_exact_where_numbers_are_rational():
    ring = LevelFunction(lambda x: x[0] ** 2 + x[1] ** 2, 25.0, 2)
    assert ring.holds(np.array([3.0, 4.0]))
    assert not ring.holds(np.array([3.0, np.nextafter(4.0, 5.0)]))
    assert ring.holds(np.array([3.0, np.nextafter(4.0, 3.0)]))


def test_ranges_hold_the_values_and_tell_inside_from_outside():
    function = LevelFunction(lambda x: np.sin(3.0 * x[0]) * x[1], 0.5, 2)
    rng = np.random.default_rng(0)
    lo = rng.uniform(-1.0, 1.0, (20, 2))
    hi = lo + rng.uniform(0.0, 0.5, (20, 2))
    inside, outside = function.inside(lo, hi), function.outside(lo, hi)
    assert inside.any()
    assert outside.any()
    for k in range(20):
        values = function.values(rng.uniform(lo[k], hi[k], (200, 2)))
        assert not inside[k] or (values <= 0.5).all()
        assert not outside[k] or (values > 0.5).all()


def test_values_are_not_numbers_where_it_is_not_defined():
    values = LevelFunction(lambda x: np.log(x[0]), 0.0, 1).values(np.array([[1.0], [-1.0]]))
    assert values[0] == 0.0
    assert not values[1] <= 0.0


def test_wrong_functions_are_named():
    with pytest.raises(ModegraphError, match="Sublevel"):
        LevelFunction(lambda x: x, 1.0, 2)
