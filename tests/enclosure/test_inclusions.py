"""Excesses and distances of affine sets hold the exact values, with their allowances."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from modegraph.enclosure.inclusions import distances, excesses
from modegraph.model.sets import exact


def exact_values(offset: np.ndarray, rates: np.ndarray, p: np.ndarray) -> exact.Row:
    point = exact.fractions(p)
    return [Fraction(c) + exact.dot(exact.fractions(row), point) for c, row in zip(offset.tolist(), rates, strict=True)]


def test_excesses_hold_the_exact_values() -> None:
    rng = np.random.default_rng(0)
    reach, bound, allowance = rng.normal(size=3), rng.normal(size=3), np.array([0.0, 1e-3, 1e-17])
    rates, others = rng.normal(size=(3, 2)), rng.normal(size=(3, 1))
    p, q = rng.normal(size=(200, 2)), rng.normal(size=(200, 1))
    low, high = excesses(p, q, reach, rates, bound, others, allowance)
    for k in range(len(p)):
        over = [a - b for a, b in zip(exact_values(reach, rates, p[k]), exact_values(bound, others, q[k]), strict=True)]
        off = exact.fractions(allowance)
        assert Fraction(low[k]) <= max(v - w for v, w in zip(over, off, strict=True))
        assert Fraction(high[k]) >= max(v + w for v, w in zip(over, off, strict=True))
        assert high[k] - low[k] < 2.1e-3


def test_an_excess_that_is_not_a_number_proves_nothing() -> None:
    one = np.ones((1, 1))
    low, high = excesses(np.array([[np.nan]]), one, np.ones(1), one, np.ones(1), one, np.zeros(1))
    assert not low[0] > 0.0
    assert not high[0] <= 0.0


def test_distances_are_not_above_the_exact_ones() -> None:
    rng = np.random.default_rng(1)
    centre, other, allowance = rng.normal(size=2), rng.normal(size=2), np.array([1e-3, 0.0])
    rates, others, rows = rng.normal(size=(2, 2)), rng.normal(size=(2, 3)), rng.normal(size=(2, 2))
    p, q = rng.normal(size=(200, 2)), rng.normal(size=(200, 3))
    found = distances(p, q, centre, rates, other, others, rows, allowance)
    for k in range(len(p)):
        a, b = exact_values(centre, rates, p[k]), exact_values(other, others, q[k])
        for sign in (1, -1):
            apart = [v - w for v, w in zip(a, b, strict=True)]
            apart[0] += sign * Fraction(1e-3)
            y = exact.times(exact.matrix(rows), apart)
            assert Fraction(found[k]) ** 2 <= exact.dot(y, y)
            assert float(exact.dot(y, y)) ** 0.5 - found[k] < 0.01
