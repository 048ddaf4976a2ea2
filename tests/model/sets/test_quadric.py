"""Linear and quadratic functions among the parts of a sublevel set."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from modegraph.model.sets import is_subset
from modegraph.model.sets.level_function import LevelFunction
from modegraph.model.sets.quadric import ellipsoids, extent, quadratic


def polynomial(fn, dim=2):
    function = LevelFunction(fn, 0.0, dim)
    return quadratic(function, function.root.index)


def test_coefficients_are_exact():
    assert polynomial(lambda x: (x[0] - 0.5) ** 2 + 3 * x[0] * x[1] - x[1] + 0.25) == {
        (0, 0): 1, (0,): -1, (): Fraction(1, 2), (0, 1): 3, (1,): -1,
    }  # fmt: skip
    assert polynomial(lambda x: x[0] ** 2 * x[1]) is None
    assert polynomial(lambda x: np.sin(x[0])) is None


@pytest.mark.parametrize(
    "fn, bound, found",
    [
        (lambda x: 2 * x[1] - 1, 3, {1: (-np.inf, 2.0)}),
        (lambda x: -2 * x[1], 3, {1: (-1.5, np.inf)}),
        (lambda x: (x[0] - 1) ** 2 + 4 * x[1] ** 2, 4, {0: (-1.0, 3.0), 1: (-1.0, 1.0)}),
        (lambda x: x[0] ** 2, 4, {0: (-2.0, 2.0)}),
        (lambda x: x[0] ** 2 - x[1] ** 2, 4, {}),
        (lambda x: x[0] + x[1], 4, {}),
        (lambda x: x[0] ** 2, -1, {}),
    ],
)
def test_extents(fn, bound, found):
    assert extent(polynomial(fn), Fraction(bound)) == found


def test_extents_are_rounded_outward():
    ((lo, hi),) = extent(polynomial(lambda x: x[0] ** 2), Fraction(2)).values()
    assert Fraction(lo) ** 2 >= 2 <= Fraction(hi) ** 2
    assert hi <= np.nextafter(np.sqrt(2.0), 2.0)


def test_an_ellipsoid_lies_between_two_of_doubles():
    function = LevelFunction(lambda x: (x[0] - 0.1) ** 2 / 3 + x[0] * x[1] / 7 + x[1] ** 2, 0.7, 2)
    inner, outer = ellipsoids(function)
    assert is_subset(inner, outer)
    for angle in np.linspace(0.0, 6.0, 60):
        way = np.array([np.cos(angle), np.sin(angle)])
        length = 1 / np.sqrt(way @ np.linalg.inv(inner.shape) @ way)
        assert function.holds(inner.c + (1 - 1e-12) * length * way)
        length = 1 / np.sqrt(way @ np.linalg.inv(outer.shape) @ way)
        assert not function.holds(outer.c + (1 + 1e-12) * length * way)


def test_what_is_no_ellipsoid():
    for fn in (
        lambda x: x[0] ** 2,
        lambda x: np.maximum(x[0] ** 2 + x[1] ** 2, x[0]),
        lambda x: np.exp(x[0]) + x[1] ** 2,
    ):
        assert ellipsoids(LevelFunction(fn, 1.0, 2)) is None
    assert ellipsoids(LevelFunction(lambda x: x[0] ** 2 + x[1] ** 2, 0.0, 2)) is None
