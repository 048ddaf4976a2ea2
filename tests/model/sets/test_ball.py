"""Balls: exact membership in the Euclidean norm."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from modegraph.errors import ModegraphError
from modegraph.model.sets import Ball

finite = st.floats(-100, 100)


def test_keeps_what_it_was_given():
    ball = Ball([1, 2], 3)
    assert ball.c.tolist() == [1.0, 2.0]
    assert ball.radius == 3.0
    assert ball.dim == 2


def test_three_four_five_touches():
    assert Ball([0, 0], 5).contains([3, 4])
    assert not Ball([0, 0], math.nextafter(5, 0)).contains([3, 4])
    assert not Ball([0, 0], 5).contains([3, math.nextafter(4, 5)])


@given(finite, finite, finite, finite, st.floats(0, 100))
def test_membership_is_rational_arithmetic(x, y, a, b, radius):
    truth = (Fraction(x) - Fraction(a)) ** 2 + (Fraction(y) - Fraction(b)) ** 2 <= Fraction(radius) ** 2
    assert Ball([a, b], radius).contains([x, y]) == truth


@given(finite, st.floats(0, 100))
def test_bounding_box_is_outward(c, radius):
    lo, hi = Ball([c], radius).bounding_box()
    assert Fraction(lo[0]) <= Fraction(c) - Fraction(radius)
    assert Fraction(hi[0]) >= Fraction(c) + Fraction(radius)
    assert hi[0] - lo[0] <= 2 * radius + 4 * math.ulp(abs(c) + radius)


def test_samples_fill_the_ball():
    ball = Ball([1, 2, 3], 0.5)
    points = ball.sample(400, seed=3)
    assert points.shape == (400, 3)
    assert all(ball.contains(x) for x in points)
    assert np.linalg.norm(points - ball.c, axis=1).max() > 0.47
    assert np.array_equal(points, ball.sample(400, seed=3))


def test_radius_zero_is_a_point():
    ball = Ball([0.1, 0.2], 0)
    assert ball.contains([0.1, 0.2])
    assert (ball.sample(3) == ball.c).all()


@pytest.mark.parametrize(
    "c, radius, words",
    [
        ([0], -1, "negative"),
        ([0], float("nan"), "nan"),
        ([float("inf")], 1, "inf"),
        ([0, 0], [1, 2], "one number"),
    ],
)
def test_bad_balls(c, radius, words):
    with pytest.raises(ModegraphError, match="Ball") as error:
        Ball(c, radius)
    assert words in str(error.value)
