"""Rational arithmetic: solved systems, definiteness, outward rounding."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from modegraph.model.sets import exact

small = st.integers(-5, 5).map(Fraction)
finite = st.floats(allow_nan=False, allow_infinity=False)


def square(n):
    return st.lists(st.lists(small, min_size=n, max_size=n), min_size=n, max_size=n)


@given(square(3), st.lists(small, min_size=3, max_size=3))
def test_solve_solves_or_says_singular(rows, right):
    solution = exact.solve(rows, [[b] for b in right])
    determinant = round(np.linalg.det(np.array([[float(v) for v in row] for row in rows])))
    assert (solution is None) == (determinant == 0)
    if solution is not None:
        assert exact.times(rows, [x for (x,) in solution]) == right


@given(square(3))
def test_normal_is_orthogonal(rows):
    normal = exact.normal_to(rows[:2])
    if normal is None:
        assert np.linalg.matrix_rank(np.array(rows[:2], dtype=float)) < 2
    else:
        assert any(normal)
        assert exact.times(rows[:2], normal) == [0, 0]


@given(square(3))
def test_gram_matrices_are_semidefinite(rows):
    gram = [[exact.dot(a, b) for b in rows] for a in rows]
    assert exact.is_positive_semidefinite(gram)
    assert exact.is_positive_definite(gram) == (exact.inverse(rows) is not None)


def test_semidefinite_needs_the_row_of_a_zero_pivot_to_vanish():
    assert not exact.is_positive_semidefinite([[Fraction(0), Fraction(1)], [Fraction(1), Fraction(5)]])
    assert exact.is_positive_semidefinite([[Fraction(0), Fraction(0)], [Fraction(0), Fraction(5)]])


@pytest.mark.parametrize("eps", [Fraction(1, 2**200), Fraction(0), -Fraction(1, 2**200)])
def test_definiteness_has_no_tolerance(eps):
    rows = [[Fraction(1), Fraction(1)], [Fraction(1), 1 + eps]]
    assert exact.is_positive_semidefinite(rows) == (eps >= 0)
    assert exact.is_positive_definite(rows) == (eps > 0)


@given(st.fractions())
def test_rounding_goes_outward_by_at_most_one_double(value):
    up, down = exact.round_up(value), exact.round_down(value)
    assert Fraction(down) <= value <= Fraction(up)
    assert up == down or up == math.nextafter(down, math.inf)


@given(finite)
def test_doubles_are_not_moved(value):
    assert exact.round_up(Fraction(value)) == value == exact.round_down(Fraction(value))


def test_rounding_beyond_the_doubles():
    assert exact.round_up(Fraction(10) ** 400) == math.inf
    assert exact.round_down(Fraction(10) ** 400) == np.finfo(float).max
    assert exact.round_up(-(Fraction(10) ** 400)) == -np.finfo(float).max


@given(st.fractions(min_value=0))
def test_square_root_is_an_upper_bound_and_tight(value):
    root = exact.sqrt_up(value)
    assert root**2 >= value
    assert (root * (1 - Fraction(1, 2**60))) ** 2 <= value


@given(st.fractions(min_value=0))
def test_square_roots_of_squares_are_exact(value):
    assert exact.sqrt_up(value**2) == value
