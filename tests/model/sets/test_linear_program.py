"""The exact simplex method against SciPy and on degenerate cases."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from modegraph.model.sets.linear_program import Outcome, maximise

numbers = st.integers(-4, 4)


def rows(m, n):
    return st.lists(st.lists(numbers, min_size=n, max_size=n), min_size=m, max_size=m)


def exact(values):
    return [Fraction(v) for v in values]


@settings(max_examples=150, deadline=None)
@given(rows(6, 3), st.lists(numbers, min_size=6, max_size=6), st.lists(numbers, min_size=3, max_size=3))
def test_agrees_with_highs(faces, bounds, objective):
    faces = [exact(row) for row in faces]
    result = maximise(exact(objective), faces, exact(bounds))
    empty = maximise(exact([0, 0, 0]), faces, exact(bounds)).outcome is Outcome.EMPTY
    other = linprog(-np.array(objective, float), np.array(faces, float), np.array(bounds, float), bounds=(None, None))
    if other.status == 0:
        assert result.outcome is Outcome.OPTIMAL
        assert float(result.value) == pytest.approx(-other.fun, abs=1e-7)
        point = result.point
        assert all(
            sum(a * x for a, x in zip(row, point, strict=True)) <= b for row, b in zip(faces, bounds, strict=True)
        )
        assert sum(c * x for c, x in zip(objective, point, strict=True)) == result.value
    elif other.status == 2:
        assert empty or result.outcome is Outcome.UNBOUNDED  # HiGHS presolve does not tell them apart
    elif other.status == 3:
        assert result.outcome is Outcome.UNBOUNDED


def test_no_tolerance():
    tiny = Fraction(1, 10**300)
    faces = [[Fraction(1)], [Fraction(-1)]]
    assert maximise([Fraction(0)], faces, [Fraction(0), tiny]).outcome is Outcome.OPTIMAL
    assert maximise([Fraction(0)], faces, [Fraction(0), -tiny]).outcome is Outcome.EMPTY
    assert maximise([Fraction(1)], faces, [tiny, Fraction(0)]).value == tiny


def test_redundant_equations_and_degenerate_corners():
    faces = [exact(row) for row in ([1, 0], [1, 0], [2, 0], [0, 1], [1, 1], [-1, -1])]
    result = maximise(exact([1, 1]), faces, exact([1, 1, 2, 1, 2, 5]))
    assert result.value == 2
    assert result.point == (1, 1)


def test_direction_that_no_face_limits():
    result = maximise(exact([0, 1]), [exact([1, 0]), exact([-1, 0])], exact([1, 1]))
    assert result.outcome is Outcome.UNBOUNDED
