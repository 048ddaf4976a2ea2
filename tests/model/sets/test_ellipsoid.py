"""Ellipsoids: definiteness is checked exactly, membership too."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from modegraph.errors import ModegraphError
from modegraph.model.sets import Ball, Ellipsoid

finite = st.floats(-10, 10)


def test_axes():
    ellipsoid = Ellipsoid([1, 0], np.diag([4, 9]))
    assert ellipsoid.contains([3, 0])
    assert ellipsoid.contains([1, -3])
    assert not ellipsoid.contains([math.nextafter(3, 4), 0])
    assert not ellipsoid.contains([3, 5e-324])
    lo, hi = ellipsoid.bounding_box()
    assert lo.tolist() == [-1.0, -3.0]
    assert hi.tolist() == [3.0, 3.0]


@given(finite, finite, st.integers(1, 8))
def test_round_ellipsoid_is_a_ball(x, y, radius):
    assert Ellipsoid([0, 0], np.diag([radius**2] * 2)).contains([x, y]) == Ball([0, 0], radius).contains([x, y])


def test_skew_samples_and_box():
    ellipsoid = Ellipsoid([0, 1], [[2, 1.5], [1.5, 2]])
    points = ellipsoid.sample(300, seed=1)
    lo, hi = ellipsoid.bounding_box()
    assert all(ellipsoid.contains(x) for x in points)
    assert ((lo <= points) & (points <= hi)).all()
    assert hi[0] == pytest.approx(math.sqrt(2), abs=1e-15)
    assert hi[0] ** 2 >= 2


def test_very_flat_is_fine_but_singular_is_not():
    flat = Ellipsoid([0, 0], [[1, 1], [1, 1 + 2**-50]])
    assert flat.contains([0.5, 0.5])
    assert all(flat.contains(x) for x in flat.sample(20, seed=0))
    with pytest.raises(ModegraphError, match="singular"):
        Ellipsoid([0, 0], [[1, 1], [1, 1]])


@pytest.mark.parametrize(
    "shape, words",
    [
        ([[1, 0.5], [0.4, 1]], "not symmetric"),
        ([[1, 0], [0, -1]], "positive definite"),
        ([[1, 0], [0, 0]], "singular"),
        ([[1, 2], [2, 1]], "positive definite"),
        ([[1]], "2 x 2"),
        ([1, 1], "matrix"),
        ([[1, 0], [0, float("nan")]], "shape[1, 1] is nan"),
    ],
)
def test_bad_ellipsoids(shape, words):
    with pytest.raises(ModegraphError, match="Ellipsoid") as error:
        Ellipsoid([0, 0], shape)
    assert words in str(error.value)
