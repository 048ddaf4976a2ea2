"""The bound of how far an approximate inverse is off, against exact rational arithmetic."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from modegraph.reach.inverse import near_inverse


def exact_miss(N: np.ndarray, A: np.ndarray) -> Fraction:
    """|N A - I| in the infinity norm, exactly."""
    left, right = ([[Fraction(float(v)) for v in row] for row in side] for side in (N, A))
    columns = list(zip(*right, strict=True))
    return max(
        sum(
            abs(sum((a * b for a, b in zip(row, column, strict=True)), Fraction(-(i == j))))
            for j, column in enumerate(columns)
        )
        for i, row in enumerate(left)
    )


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("decay", [0.0, 2.0, 10.0])
def test_the_miss_is_bounded_and_no_larger_than_rounding(seed: int, decay: float) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 8))
    turn = [np.linalg.qr(rng.normal(size=(n, n)))[0] for _ in range(2)]
    A = turn[0] * np.exp(-decay * np.linspace(0.0, 1.0, n)) @ turn[1]
    found = near_inverse(A)
    assert found is not None
    N, off = found
    assert exact_miss(N, A) <= Fraction(off)
    assert off <= 1e-13 * n**2 * np.exp(decay)


def test_nearly_dependent_axes_are_bounded_too() -> None:
    # Condition 1e13: the inverse is wrong in its third digit, and the bound says so.
    A = np.array([[1.0, 1.0], [1.0, 1.0 + 1e-13]]) / 3.0
    found = near_inverse(A)
    assert found is not None
    assert exact_miss(found[0], A) <= Fraction(found[1])
    assert found[1] > 1e-3


def test_singular_or_undefined_axes_have_no_bound() -> None:
    assert near_inverse(np.array([[1.0, 2.0], [2.0, 4.0]])) is None
    with np.errstate(all="ignore"):
        for bad in (np.nan, np.inf, 1e-310):
            found = near_inverse(np.array([[bad, 0.0], [0.0, 1.0]]))
            assert found is None or not found[1] < 1.0
