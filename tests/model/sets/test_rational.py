"""Sets of rational numbers: one is inside another exactly where `is_subset` says so of the same sets of doubles."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from modegraph.model.sets import Ball, Box, Ellipsoid, Polytope, Set, Zonotope, exact, is_subset
from modegraph.model.sets.rational import RationalSet, rational_subset

steps = st.integers(-8, 8)
sizes = st.integers(0, 8)


def rational(region: Set) -> RationalSet:
    if isinstance(region, Box):
        lo, hi = exact.fractions(region.lo), exact.fractions(region.hi)
        half = [(b - a) / 2 for a, b in zip(lo, hi, strict=True)]
        middle = [(a + b) / 2 for a, b in zip(lo, hi, strict=True)]
        axes = [[h if i == k else Fraction(0) for i in range(region.dim)] for k, h in enumerate(half)]
        return RationalSet(Box, middle, axes)
    if isinstance(region, Ball):
        return RationalSet(Ball, exact.fractions(region.c), [], radius=Fraction(region.radius))
    if isinstance(region, Zonotope):
        return RationalSet(Zonotope, exact.fractions(region.c), exact.matrix(region.generators.T))
    assert isinstance(region, Ellipsoid)
    about = Ellipsoid(np.zeros(region.dim), region.shape)
    return RationalSet(Ellipsoid, exact.fractions(region.c), [], ellipsoid=about)


@st.composite
def regions(draw: st.DrawFn) -> Set:
    c = np.array([draw(steps), draw(steps)]) / 16.0
    a, b, s = (draw(k) / 8.0 for k in (sizes, sizes, steps))
    kind = draw(st.sampled_from(["box", "ball", "ellipsoid", "zonotope"]))
    if kind == "box":
        half = np.array([a, b])
        return Box(c - half, c + half)
    if kind == "ball":
        return Ball(c, a)
    if kind == "ellipsoid":
        return Ellipsoid(c, [[a + 0.25, s / 8], [s / 8, b + 0.25]])
    return Zonotope(c, [[a + 0.125, s], [0.25, -b - 0.125]])


@settings(max_examples=400, deadline=None)
@given(inner=regions(), outer=regions())
def test_the_answer_is_that_for_doubles(inner: Set, outer: Set) -> None:
    # A flat zonotope has no list of faces, and is no target.
    assume(not isinstance(outer, Zonotope) or outer.faces() is not None)
    assert rational_subset(rational(inner), rational(outer)) == is_subset(inner, outer)


@pytest.mark.parametrize(
    "inner", [Ball([0.25, 0.0], 0.5), Box([-0.25, -0.5], [0.75, 0.5]), Ellipsoid([0, 0], np.eye(2))]
)
def test_polytopes_on_either_side(inner: Set) -> None:
    outer = Polytope([[1, 0], [-1, 0], [0, 1], [0, -1]], [1.0, 1.0, 1.0, 1.0])
    assert rational_subset(rational(inner), outer)
    assert not rational_subset(rational(inner), Polytope([[1.0, 0.0]], [0.5]))
    assert rational_subset(Polytope(outer.A, [0.5] * 4), rational(Ball([0, 0], 0.75)))


def test_thirds_are_compared_exactly() -> None:
    third = Fraction(1, 3)
    inner = RationalSet(Ball, [third], [], radius=third)
    assert rational_subset(inner, RationalSet(Ball, [Fraction(0)], [], radius=2 * third))
    assert not rational_subset(inner, RationalSet(Ball, [Fraction(0)], [], radius=2 * third - Fraction(1, 10**30)))
