"""Scaled sets hold every scaled point, decided exactly, and are hardly larger."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

import modegraph as mg
from modegraph.model.sets import is_subset
from modegraph.model.sets.scaled import scaled

SETS = [
    mg.Box([0.1, -0.7], [0.3, 1 / 3]),
    mg.Ball([0.1, 0.2], 0.3),
    mg.Ellipsoid([0.1, 0.2], [[0.3, 0.1], [0.1, 0.7]]),
    mg.Zonotope([0.1, 0.2], [[0.1, 0.3, 1 / 3], [0.7, -0.1, 0.2]]),
    mg.Polytope([[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1]], [0.7, 0.1, 0.3, 0.2, 0.9]),
]
SCALES = [0.3, 0.5, 1 / 3, 1.0, 1.7, 1e3]


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("shape", SETS, ids=lambda shape: type(shape).__name__)
def test_the_kind_stays_and_the_size_is_as_asked(shape: mg.Set, scale: float) -> None:
    there = scaled(shape, scale)
    assert type(there) is type(shape)
    assert is_subset(shape, there) == (scale >= 1.0)
    lo, hi = (np.asarray(side) for side in shape.bounding_box())
    below, above = there.bounding_box()
    assert above - below == pytest.approx(scale * (hi - lo), rel=1e-9)


@pytest.mark.parametrize("scale", SCALES)
def test_no_corner_of_a_box_and_no_end_of_a_ball_is_lost(scale: float) -> None:
    box, ball = SETS[:2]
    assert isinstance(box, mg.Box)
    assert isinstance(ball, mg.Ball)
    there = scaled(box, scale)
    assert isinstance(there, mg.Box)
    for a, b, lo, hi in zip(*(map(Fraction, side) for side in (box.lo, box.hi, there.lo, there.hi)), strict=True):
        middle, half = (a + b) / 2, Fraction(scale) * (b - a) / 2
        assert lo <= middle - half
        assert hi >= middle + half
    round_one = scaled(ball, scale)
    assert isinstance(round_one, mg.Ball)
    assert Fraction(round_one.radius) >= Fraction(scale) * Fraction(ball.radius)


@pytest.mark.parametrize("shape", SETS[:3], ids=lambda shape: type(shape).__name__)
def test_nested_scales_are_nested_sets(shape: mg.Set) -> None:
    for small, large in ((0.3, 0.5), (1.0, 1.7)):
        assert is_subset(scaled(shape, small), scaled(shape, large))
        assert not is_subset(scaled(shape, large), scaled(shape, small))


def test_a_sublevel_is_moved_in_its_argument() -> None:
    ring = mg.Sublevel(lambda x: (x[0] - 1.0) ** 2 + 4.0 * x[1] ** 2, 1.0)
    double = scaled(ring, 2.0)
    assert double.contains([2.99, 0.0])
    assert not double.contains([3.01, 0.0])
    assert double.contains([1.0, 0.99])
    assert not double.contains([1.0, 1.01])
