"""Bisected upper bounds of polynomials."""

from __future__ import annotations

import numpy as np
import pytest

from modegraph.enclosure.monomials import monomials
from modegraph.enclosure.ranges import upper_bound


@pytest.mark.parametrize("scale", [1e-300, 1e-150, 1.0, 1e150])
@pytest.mark.parametrize("m, order", [(1, 4), (2, 3), (3, 3)])
def test_no_sample_is_above_the_bound(m: int, order: int, scale: float) -> None:
    rng = np.random.default_rng(m + order)
    exponents = monomials((1,) * m, order).exponents
    for _ in range(20):
        c = rng.normal(size=len(exponents)) * scale * (rng.random(len(exponents)) < 0.7)
        lo = rng.uniform(-1.0, 0.5, m)
        hi = np.minimum(1.0, lo + rng.uniform(0.0, 1.5, m))
        x = lo + (hi - lo) * rng.random((400, m))
        x[:8] = np.where(rng.random((8, m)) < 0.5, lo, hi)
        best = float((np.prod(x[:, None, :] ** exponents, axis=2) @ c).max())
        rough = upper_bound(c, exponents, lo, hi, -np.inf, 0)
        fine = upper_bound(c, exponents, lo, hi, -np.inf, 300)
        assert best <= fine * (1 + 1e-12) + 1e-12 * abs(fine)
        assert fine <= rough
        assert fine - best <= 0.35 * np.abs(c).sum() + 1e-305


def test_bisection_stops_at_the_limit_and_finds_the_extremum() -> None:
    exponents = monomials((1,), 2).exponents
    c = np.array([0.0, 1.0, -1.0])  # x - x^2: at most 1/4
    lo, hi = np.array([-1.0]), np.array([1.0])
    assert 0.25 <= upper_bound(c, exponents, lo, hi, -np.inf, 200) < 0.2501
    assert 0.25 <= upper_bound(c, exponents, lo, hi, 0.5, 200) <= 0.5


def test_no_variable() -> None:
    assert (
        3.0 <= upper_bound(np.array([3.0]), np.zeros((1, 0), np.int64), np.zeros(0), np.zeros(0), 0.0, 9) < 3.0 + 1e-12
    )
