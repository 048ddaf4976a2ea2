"""Polytopes: emptiness, boundedness and bounding boxes are exact."""

import math
from fractions import Fraction

import numpy as np
import pytest

from modegraph.errors import ModegraphError
from modegraph.model.sets import Polytope

TRIANGLE = ([[-1, 0], [0, -1], [1, 1]], [0, 0, 1])


def test_membership_is_exact_at_the_last_bit():
    triangle = Polytope(*TRIANGLE)
    assert triangle.contains([0.5, 0.5])
    assert not triangle.contains([0.5, math.nextafter(0.5, 1)])
    assert not triangle.contains([-5e-324, 0.5])


def test_products_are_not_rounded():
    face = Polytope([[0.1]], [0.01])
    edge = float(Fraction(0.01) / Fraction(0.1))
    assert face.contains([edge]) == (Fraction(0.1) * Fraction(edge) <= Fraction(0.01))
    assert face.contains([math.nextafter(edge, 0)])


def test_bounding_box_encloses_the_exact_one():
    polytope = Polytope([[3, 0], [-3, 0], [0, 1], [0, -1]], [1, 1, 2, 2])
    lo, hi = polytope.bounding_box()
    assert Fraction(hi[0]) >= Fraction(1, 3)
    assert hi[0] == math.nextafter(1 / 3, 1)
    assert lo[0] == -hi[0]
    assert hi[1] == 2.0


def test_chebyshev_centre():
    centre, radius = Polytope([[1, 0], [-1, 0], [0, 2], [0, -2]], [1, 1, 6, 6]).chebyshev
    assert radius == pytest.approx(1.0)
    assert centre[0] == pytest.approx(0.0, abs=1e-12)
    assert abs(centre[1]) <= 2.0 + 1e-12


def test_empty():
    assert Polytope([[1], [-1]], [0, -5e-324]).is_empty()
    assert not Polytope([[1], [-1]], [0, 0]).is_empty()
    assert Polytope([[0.0, 0.0]], [-1]).is_empty()
    with pytest.raises(ModegraphError, match="empty"):
        Polytope([[1], [-1]], [0, -1]).bounding_box()


def test_unbounded():
    half = Polytope([[1, 0]], [1])
    assert not half.is_bounded()
    assert half.contains([-1e300, 1e300])
    assert half.contains(half.center)
    with pytest.raises(ModegraphError, match="unbounded"):
        half.bounding_box()
    with pytest.raises(ModegraphError, match="unbounded"):
        half.sample(3)


def test_flat_polytope_has_points():
    segment = Polytope([[1, 0], [-1, 0], [0, 1], [0, -1]], [0, 0, 1, 1])
    assert not segment.is_empty()
    points = segment.sample(10, seed=0)
    assert all(segment.contains(x) for x in points)


def test_a_flat_polytope_between_the_doubles_says_so():
    sliver = Polytope([[3], [-3]], [1, -1])
    assert not sliver.is_empty()
    with pytest.raises(ModegraphError, match="thin"):
        sliver.sample(1)


def test_samples_spread():
    triangle = Polytope(*TRIANGLE)
    points = triangle.sample(300, seed=5)
    assert all(triangle.contains(x) for x in points)
    assert points.max(axis=0).min() > 0.8


def test_corners():
    corners = {tuple(float(v) for v in corner) for corner in Polytope(*TRIANGLE).vertices()}
    assert corners == {(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)}


def test_a_vector_is_one_face():
    assert Polytope([1, 2], 3).A.shape == (1, 2)


def test_eight_dimensions():
    rng = np.random.default_rng(0)
    polytope = Polytope(np.vstack([rng.standard_normal((12, 8)), np.eye(8), -np.eye(8)]), np.ones(28))
    assert polytope.is_bounded()
    lo, hi = polytope.bounding_box()
    assert (lo >= -1).all()
    assert (hi <= 1).all()
    assert polytope.contains(polytope.center)


@pytest.mark.parametrize(
    "A, b, words",
    [
        ([[1, 0]], [1, 2], "one row of A"),
        ([[1, float("inf")]], [1], "inf"),
        (np.zeros((0, 2)), [], "non-empty"),
    ],
)
def test_bad_polytopes(A, b, words):
    with pytest.raises(ModegraphError, match="Polytope") as error:
        Polytope(A, b)
    assert words in str(error.value)
