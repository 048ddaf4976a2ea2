"""Inclusion: a yes is exact; equal and touching sets count as inside; one unit in the last place does not."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from modegraph.errors import ModegraphError
from modegraph.model.sets import Ball, Box, Ellipsoid, Polytope, Zonotope, is_subset

UP = math.inf

small = st.integers(-3, 3)
size = st.sampled_from([0.25, 0.5, 1.0, 2.0, 4.0])


def box(n, half=1.0, centre=0.0):
    return Box([centre - half] * n, [centre + half] * n)


def cube(n, half=1.0):
    return Polytope(np.vstack([np.eye(n), -np.eye(n)]), [half] * (2 * n))


SAME = [
    Box([0.1, 0.2], [0.3, 0.7]),
    Ball([0.1, 0.2], 0.3),
    Ellipsoid([0.1, 0.2], [[0.1, 0.05], [0.05, 0.3]]),
    Zonotope([0.1, 0.2], [[0.1, 0.2, 0.3], [0.3, 0.1, 0.7]]),
    Zonotope([0.1, 0.2], [[0.1], [0.3]]),
    Polytope([[0.1, 0.3], [-0.7, 0.1], [0.3, -1.1]], [0.1, 0.2, 0.3]),
    Polytope([[0.1, 0.3]], [0.1]),
]


@pytest.mark.parametrize("region", SAME, ids=lambda s: type(s).__name__)
def test_equal_sets(region):
    again = type(region)(*(getattr(region, name) for name in region._fields))
    assert is_subset(again, region)


def test_a_ball_is_not_judged_by_its_bounding_box_in_eight_dimensions():
    # The box around Ball(0, 1) reaches to sqrt(8) = 2.83.
    assert is_subset(Ball([0] * 8, 1.0), Ball([0] * 8, 1.1))
    assert is_subset(Ball([0] * 8, 1.0), Ellipsoid([0] * 8, 1.21 * np.eye(8)))
    rotation = np.linalg.qr(np.random.default_rng(0).standard_normal((8, 8)))[0]
    turned = Polytope(np.vstack([rotation, -rotation]), [1.05] * 16)
    assert is_subset(Ball([0] * 8, 1.0), turned)
    assert not is_subset(box(8), turned)
    assert not is_subset(Ball([0] * 8, 1.1), box(8, 1.0))
    assert not is_subset(Ball([0] * 8, 1.1), Polytope(turned.A, [1.09] * 16))


def test_touching_from_inside():
    assert is_subset(Ball([0, 0], 1), box(2))
    assert is_subset(Ball([1, 0], 1), Ball([0, 0], 2))
    assert is_subset(Box([-3, -4], [3, 4]), Ball([0, 0], 5))
    assert is_subset(Box([-3, -4], [3, 4]), Ellipsoid([0, 0], 25 * np.eye(2)))
    assert is_subset(Ellipsoid([1, 0], np.diag([1.0, 0.5])), Ball([0, 0], 2))
    assert is_subset(Ellipsoid([0, 0], np.diag([4.0, 1.0])), Ball([0, 0], 2))
    assert is_subset(Zonotope([0, 0], [[1, 1], [1, -1]]), Ball([0, 0], 2))
    assert is_subset(Zonotope([0, 0], [[1, 1], [1, -1]]), Polytope([[1, 1], [-1, 1], [1, -1], [-1, -1]], [2] * 4))
    assert is_subset(cube(3), box(3))
    assert is_subset(box(3), cube(3))
    assert is_subset(Box([-1, -1], [1, 1]), Zonotope([0, 0], [[1, 0.5], [0, 0.5]])) is False
    assert is_subset(Box([-0.5, -0.5], [0.5, 0.5]), Zonotope([0, 0], [[1, 0.5], [0, 0.5]]))


def test_one_unit_in_the_last_place_too_large():
    one = math.nextafter(1.0, UP)
    assert not is_subset(Ball([0, 0], one), box(2))
    assert not is_subset(Ball([1, 0], one), Ball([0, 0], 2))
    assert not is_subset(Box([-3, -4], [3, math.nextafter(4, UP)]), Ball([0, 0], 5))
    assert not is_subset(Box([-3, -4], [3, math.nextafter(4, UP)]), Ellipsoid([0, 0], 25 * np.eye(2)))
    assert not is_subset(Ellipsoid([0, 0], np.diag([math.nextafter(4, UP), 1])), Ball([0, 0], 2))
    assert not is_subset(cube(3, one), box(3))
    assert not is_subset(Zonotope([0, 0], [[1, 1], [one, -1]]), Ball([0, 0], 2))


def test_unbounded_polytopes():
    half = Polytope([[1, 0]], [1])
    assert is_subset(box(2), half)
    assert is_subset(Polytope([[1, 0], [0, 1]], [1, 5]), half)
    assert not is_subset(half, box(2))
    assert not is_subset(half, Ball([0, 0], 1e6))
    assert not is_subset(half, Polytope([[0, 1]], [1]))


def test_the_empty_polytope_is_inside_everything():
    assert is_subset(Polytope([[1], [-1]], [0, -1]), Ball([5], 0))


def test_points():
    assert is_subset(Ball([0.1, 0.2], 0), Ellipsoid([0.1, 0.2], 1e-9 * np.eye(2)))
    assert is_subset(Box([0.1, 0.2], [0.1, 0.2]), Ball([0.1, 0.2], 0))
    assert not is_subset(Ball([0.1, 0.2], 5e-324), Ball([0.1, 0.2], 0))
    assert is_subset(Zonotope([1, 2], np.zeros((2, 0))), Ball([1, 2], 0))


def test_zonotopes_without_a_list_of_faces():
    flat = Zonotope([0, 0], [[1.0], [0.0]])
    assert is_subset(Zonotope([0, 0], [[0.5], [0.0]]), flat)
    assert not is_subset(Ball([0, 0], 0.1), flat)
    assert is_subset(Box([-1, 0], [1, 0]), flat)
    rng = np.random.default_rng(1)
    many = Zonotope(np.zeros(6), rng.standard_normal((6, 20)))
    assert many.faces() is None
    assert is_subset(box(6, 0.1), many)
    assert is_subset(Ball([0] * 6, 0.1), many)
    assert not is_subset(box(6, 50.0), many)


def test_large_boxes_in_round_sets():
    assert is_subset(box(16, 0.25), Ball([0] * 16, 1.0))
    assert is_subset(box(16, 0.25), Ellipsoid([0] * 16, np.eye(16)))
    assert not is_subset(box(16, math.nextafter(0.25, UP)), Ellipsoid([0] * 16, np.eye(16)))


def test_different_dimensions_are_an_error():
    with pytest.raises(ModegraphError, match="coordinates"):
        is_subset(Ball([0], 1), Ball([0, 0], 1))


def regions():
    centre = st.tuples(small, small).map(lambda c: [v / 2 for v in c])
    diagonal = st.tuples(size, size).map(np.diag)
    skew = st.tuples(size, size, st.sampled_from([-0.4, 0.0, 0.4])).map(
        lambda s: np.array([[s[0], s[2] * math.sqrt(s[0] * s[1])], [s[2] * math.sqrt(s[0] * s[1]), s[1]]])
    )
    return st.one_of(
        st.tuples(centre, size, size).map(
            lambda v: Box([v[0][0] - v[1], v[0][1] - v[2]], [v[0][0] + v[1], v[0][1] + v[2]])
        ),
        st.tuples(centre, size).map(lambda v: Ball(*v)),
        st.tuples(centre, skew).map(lambda v: Ellipsoid(*v)),
        st.tuples(centre, st.lists(st.tuples(small, small), min_size=1, max_size=4)).map(
            lambda v: Zonotope(v[0], np.array(v[1], float).T / 2)
        ),
        st.tuples(centre, diagonal).map(
            lambda v: Polytope(
                [[1, 1], [-1, 1], [1, -1], [-1, -1], [1, 0]],
                np.array([[1, 1], [-1, 1], [1, -1], [-1, -1], [1, 0]]) @ v[0] + v[1][0, 0],
            )
        ),
    )


@settings(max_examples=150, deadline=None)
@given(regions(), regions())
def test_a_yes_is_never_contradicted_by_a_sample(inner, outer):
    if is_subset(inner, outer):
        assert all(outer.contains(x) for x in inner.sample(30, seed=0))
        corners = inner.vertices()
        if corners is not None:
            for corner in itertools.islice(corners, 16):
                point = [float(v) for v in corner]
                if inner.contains(point):
                    assert outer.contains(point)


@settings(max_examples=60, deadline=None)
@given(regions())
def test_every_set_lies_in_its_bounding_box_and_shrunk_sets_in_themselves(region):
    assert is_subset(region, Box(*region.bounding_box()))
    lo, hi = region.bounding_box()
    reach = float(np.linalg.norm(np.maximum(np.abs(lo), np.abs(hi)))) * (1 + 1e-12)
    assert is_subset(region, Ball([0, 0], reach))


@settings(max_examples=60, deadline=None)
@given(st.tuples(small, small), size, size, st.floats(0.01, 0.999))
def test_shrunk_ellipsoids_are_proved_inside(centre, a, b, factor):
    outer = Ellipsoid(centre, np.diag([a, b]))
    inner = Ellipsoid(centre, np.diag([a, b]) * factor)
    assert is_subset(inner, outer)
    assert not is_subset(outer, inner)
