"""Boxes: constructor, exact membership, corners."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from modegraph.errors import ModegraphError
from modegraph.model.sets import Box

finite = st.floats(-1e6, 1e6)


def test_keeps_what_it_was_given():
    box = Box([0, -1], [2, 3])
    assert box.dim == 2
    assert box.lo.tolist() == [0.0, -1.0]
    assert box.hi.tolist() == [2.0, 3.0]
    assert box.center.tolist() == [1.0, 1.0]


def test_is_a_read_only_copy():
    lo = np.zeros(2)
    box = Box(lo, [1, 1])
    lo[0] = 5.0
    assert box.lo[0] == 0.0
    with pytest.raises(ValueError):
        box.lo[0] = 1.0


def test_scalar_is_one_dimension():
    assert Box(-1, 1).dim == 1
    assert Box(-1, 1).contains(0.5)


@given(finite, finite)
def test_membership_is_exact_at_the_last_bit(a, b):
    lo, hi = min(a, b), max(a, b)
    box = Box([lo], [hi])
    assert box.contains([lo])
    assert box.contains([hi])
    assert not box.contains([math.nextafter(hi, math.inf)])
    assert not box.contains([math.nextafter(lo, -math.inf)])


@given(finite, finite)
def test_centre_is_inside(a, b):
    box = Box([min(a, b)], [max(a, b)])
    assert box.contains(box.center)


def test_centre_does_not_overflow():
    assert Box([1e308], [1.5e308]).center[0] == pytest.approx(1.25e308)


def test_point_is_a_box():
    box = Box([1.0, 2.0], [1.0, 3.0])
    assert box.contains([1.0, 2.5])
    assert (box.sample(5, seed=0)[:, 0] == 1.0).all()


@pytest.mark.parametrize(
    "lo, hi, words",
    [
        ([0, 1], [1, 0], "coordinate 1 is inverted"),
        ([0, float("nan")], [1, 1], "lo[1] is nan"),
        ([0], [float("inf")], "hi[0] is inf"),
        ([0, 1], [1], "lo has 2 coordinates but hi has 1"),
        ([], [], "non-empty"),
        ([[0, 1]], [[1, 2]], "vector"),
        (["a"], [1], "real numbers"),
        ([1j], [1], "real numbers"),
    ],
)
def test_bad_boxes(lo, hi, words):
    with pytest.raises(ModegraphError, match="Box") as error:
        Box(lo, hi)
    assert words in str(error.value)


def test_corners_and_faces():
    box = Box([0, 0, 1], [1, 2, 1])
    corners = {tuple(float(v) for v in corner) for corner in box.vertices()}
    assert corners == {(x, y, 1.0) for x in (0.0, 1.0) for y in (0.0, 2.0)}
    assert len(box.faces()) == 6
    assert Box([0] * 20, [1] * 20).vertices() is None
