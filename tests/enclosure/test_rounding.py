"""Every rounding constant is at least its proved bound, and half of it is not."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from flint import arb, ctx

from modegraph.enclosure import rounding
from modegraph.enclosure.disturbance import MEAN, SLOPE, STRAY
from modegraph.enclosure.exponential import POWERS
from modegraph.enclosure.rounding import LIBM, MAX_PRODUCTS, MAX_ROUNDINGS, TINY, UNIT, UP, gamma
from modegraph.enclosure.variational import chord_distance

HALF_ULP = Fraction(1, 2**53)


def exact_gamma(k: int) -> Fraction:
    return k * HALF_ULP / (1 - k * HALF_ULP)


@pytest.mark.parametrize("k", [1, 2, 17, 1000, MAX_ROUNDINGS])
def test_gamma(k: int) -> None:
    assert Fraction(UNIT) == HALF_ULP
    assert exact_gamma(k) <= Fraction(gamma(k)) < 2 * exact_gamma(k)


def test_up_covers_the_sum_and_its_own_product() -> None:
    # s <= c (1 + gamma), and UP times c is rounded once: (1 - u) UP >= 1 + gamma.
    needed = (1 + exact_gamma(MAX_ROUNDINGS)) / (1 - HALF_ULP) - 1
    assert needed <= Fraction(UP) - 1 < 2 * needed
    assert rounding.MAX_MONOMIALS <= MAX_ROUNDINGS


def test_tiny_covers_what_products_lose_to_underflow() -> None:
    lost = MAX_PRODUCTS * Fraction(1, 2**1075)
    assert lost <= Fraction(TINY) <= 4 * lost


def test_libm_is_two_ulp() -> None:
    assert Fraction(LIBM) == 2 * Fraction(1, 2**52)


@pytest.mark.parametrize("x", [1e-310, 0.3, 1.0, 1.5, 3.0, 710.0, 1e5, 1e22])
def test_the_library_keeps_to_libm(x: float) -> None:
    with ctx.workprec(2000):
        for name, floats, exact in (
            ("sin", math.sin, arb.sin), ("cos", math.cos, arb.cos), ("atan", math.atan, arb.atan),
            ("log", math.log, arb.log), ("exp", math.exp, arb.exp),
        ):  # fmt: skip
            if name == "exp" and x > 700.0:
                continue
            true = exact(arb(x))
            size = arb(1) if name in ("sin", "cos") else abs(true)
            assert not abs(arb(floats(x)) - true) > size * LIBM + TINY


@pytest.mark.parametrize("k", range(POWERS + 1))
def test_powers_stray_from_their_lines(k: int) -> None:
    """x^k / k! - MEAN - SLOPE (x - 1/2) is convex: positive, negative, positive. Its mean is 0."""
    mean, slope = Fraction(1, math.factorial(k + 1)), Fraction(6 * k, math.factorial(k) * (k + 1) * (k + 2))
    assert abs(Fraction(MEAN[k]) - mean) <= mean / 2**52
    assert abs(Fraction(SLOPE[k]) - slope) <= slope / 2**52
    if k < 2:
        return

    def off(x: Fraction) -> Fraction:
        return x**k / math.factorial(k) - mean - slope * (x - Fraction(1, 2))

    def integral(x: Fraction) -> Fraction:
        return x ** (k + 1) / math.factorial(k + 1) - mean * x - slope * (x**2 - x) / 2

    low = min((Fraction(j, 64) for j in range(65)), key=off)
    roots = []
    for inside, outside in ((low, Fraction(0)), (low, Fraction(1))):
        for _ in range(60):
            middle = (inside + outside) / 2
            inside, outside = (inside, middle) if off(middle) > 0 else (middle, outside)
        roots.append(inside)
    # The negative part is half of the whole.
    true = 2 * (integral(roots[0]) - integral(roots[1]))
    assert true < Fraction(STRAY[k]) < Fraction(11, 10) * true


@pytest.mark.parametrize("j", range(2, 13))
def test_chord_distance(j: int) -> None:
    value = chord_distance(j)
    with ctx.workprec(200):
        s = (arb(1) / j) ** (arb(1) / (j - 1))
        true = s - s**j
        assert true <= arb(value)
        assert true > arb(value) / 2
        assert true > arb(value) * (1 - 1e-14)
