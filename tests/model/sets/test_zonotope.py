"""Zonotopes: membership is exact for parallelotopes and for general ones."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from modegraph.errors import ModegraphError
from modegraph.model.sets import Box, Zonotope

numbers = st.integers(-3, 3)


def test_parallelotope_corner_is_inside_and_one_ulp_further_is_not():
    zonotope = Zonotope([0, 0], [[1, 1], [0, 1]])
    assert zonotope.contains([2, 1])
    assert not zonotope.contains([math.nextafter(2, 3), 1])
    assert not zonotope.contains([2, math.nextafter(1, 0)])


def test_three_generators_corner_is_inside_and_one_ulp_further_is_not():
    zonotope = Zonotope([0, 0], [[1, 1, 0.5], [0, 1, 0.25]])
    assert zonotope.contains([2.5, 1.25])
    assert not zonotope.contains([math.nextafter(2.5, 3), 1.25])
    assert not zonotope.contains([2.5, math.nextafter(1.25, 2)])
    assert zonotope.contains([0.5, -0.25])


@settings(max_examples=80, deadline=None)
@given(st.lists(st.lists(numbers, min_size=4, max_size=4), min_size=2, max_size=2), numbers, numbers)
def test_agrees_with_a_linear_program(generators, x, y):
    zonotope = Zonotope([0, 0], generators)
    program = linprog(np.zeros(4), A_eq=np.array(generators, float), b_eq=[x, y], bounds=(-1, 1))
    assert zonotope.contains([x, y]) == (program.status == 0)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.lists(numbers, min_size=4, max_size=4), min_size=3, max_size=3),
    st.tuples(numbers, numbers, numbers),
)
def test_faces_describe_the_set(generators, point):
    zonotope = Zonotope([0, 0, 0], generators)
    faces = zonotope.faces()
    if faces is None:
        assert np.linalg.matrix_rank(np.array(generators, float)) < 3
    else:
        inside = all(sum(a * x for a, x in zip(direction, point, strict=True)) <= bound for direction, bound in faces)
        assert inside == zonotope.contains(point)


def test_flat_and_empty_generators():
    flat = Zonotope([0, 1], [[1], [0]])
    assert flat.contains([0.3, 1])
    assert not flat.contains([0.3, math.nextafter(1, 2)])
    assert all(flat.contains(x) for x in flat.sample(10, seed=0))
    point = Zonotope([1, 2], np.zeros((2, 0)))
    assert point.contains([1, 2])
    assert not point.contains([1, 2.5])


def test_a_vector_is_one_generator():
    assert Zonotope([0, 0], [1, 2]).generators.shape == (2, 1)


def test_samples_and_bounding_box():
    zonotope = Zonotope([1, 2], [[1, 0.5, 0.1], [0, 1, -0.3]])
    lo, hi = zonotope.bounding_box()
    assert lo == pytest.approx([-0.6, 0.7])
    assert hi == pytest.approx([2.6, 3.3])
    points = zonotope.sample(100, seed=2)
    assert all(zonotope.contains(x) for x in points)


def test_diagonal_zonotope_is_a_box():
    zonotope, box = Zonotope([0, 0], np.diag([1.0, 2.0])), Box([-1, -2], [1, 2])
    for x in ([1, 2], [1.0000000000000002, 0], [0, -2], [0.5, 2.5]):
        assert zonotope.contains(x) == box.contains(x)


def test_bad_zonotopes():
    with pytest.raises(ModegraphError, match="must have 2 rows"):
        Zonotope([0, 0], np.eye(3))
    with pytest.raises(ModegraphError, match="nan"):
        Zonotope([0], [[float("nan")]])
