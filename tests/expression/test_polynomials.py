"""Counted polynomial arithmetic: the results of the library, and no call that cannot be bounded."""

from __future__ import annotations

from fractions import Fraction
from random import Random
from typing import Any

import pytest

from modegraph.expression.polynomials import PRODUCTS, Ring
from modegraph.expression.work import TooBig, Work


def ring(count: int = 3, work: float = 1e7) -> Ring:
    return Ring(count, Work(work))


def drawn(r: Ring, random: Random, terms: int = 5, degree: int = 3) -> Any:
    count = len(r.generators)
    while True:
        p = r.polynomial(
            {
                tuple(random.randint(0, degree) for _ in range(count)): r.number(
                    Fraction(random.randint(-9, 9), random.randint(1, 4))
                )
                for _ in range(terms)
            }
        )
        if p and not p.is_constant():
            return p


def test_division_is_that_of_the_library() -> None:
    random, r = Random(1), ring()
    rests = 0
    for k in range(200):
        p, q = drawn(r, random, 8, 4), drawn(r, random, 3, 2)
        p = p if k % 4 else p * q
        quotient, rest = r.division(p, q)
        assert (quotient, rest) == divmod(p, q)
        rests += bool(rest)
    assert 100 < rests <= 150


@pytest.mark.parametrize("step_by_step", [False, True])
def test_exact_division_finds_factors_and_no_others(step_by_step: bool) -> None:
    random, r = Random(2), ring()
    divided = r._divided_step_by_step if step_by_step else r.divided
    refused = 0
    for _ in range(100):
        p, q = drawn(r, random), drawn(r, random, 3, 2)
        assert divided(p * q, q) == p
        for other in (p, p * q + 1, p * q + drawn(r, random, 1)):
            found = divided(other, q)
            quotient, rest = divmod(other, q)
            assert (found is None) == bool(rest)
            assert found is None or found == quotient
            refused += found is None
    assert refused > 200


def test_a_factor_at_one_point_is_no_factor() -> None:
    # The other atoms are tried at 2, 3, ...: there y - 3 is zero, and the rest of the division by x with it.
    r = ring()
    x, y, _ = r.generators
    assert r._divided_step_by_step(x**2 + y - 3, x) is None
    assert r.divided(x**2 + y - 3, x) is None


def test_nothing_divided_is_nothing() -> None:
    r = ring()
    zero = r.one - r.one
    assert r.divided(zero, r.generators[0]) == zero
    assert r.division(zero, r.generators[0]) == (zero, zero)


def test_squares_are_rewritten() -> None:
    r = ring()
    s, c, _ = r.generators
    r.relate(s**2 + c**2 - 1)
    assert r.times(s, s) == 1 - c**2
    assert r.times(s**3 - s, s) == (1 - c**2) ** 2 - (1 - c**2)


def test_what_may_blow_up_is_refused_before_it_is_tried() -> None:
    r = ring(8)
    *rest, last = r.generators
    total = sum(rest, last)
    # The quotient of x^12 by x - (sum of others)^2 has more than a million terms.
    with pytest.raises(TooBig):
        r.division(r.generators[0] ** 12, r.generators[0] - (total - r.generators[0]) ** 2)
    r.relate(r.generators[0] ** 2 - (total - r.generators[0]) ** 3)
    with pytest.raises(TooBig):
        r.normal(r.generators[0] ** 20)
    long = (1 + total) ** 5
    assert len(long) ** 2 > PRODUCTS
    with pytest.raises(TooBig):
        r.times(long, long)


def test_long_coefficients_count() -> None:
    short, long = ring(), ring()
    for r, power in ((short, 1), (long, 4000)):
        before = r.work.spent
        p = sum((r.generators[k] * r.number(Fraction(10**power + k)) for k in range(3)), r.one)
        r.times(p, p)
        r.work.spent -= before
    assert long.work.spent > 20 * short.work.spent


def test_every_operation_stops_where_the_work_is_used_up() -> None:
    r = ring()
    x, y, _ = r.generators
    p = (x + y) ** 5
    r.work.add(r.work.left)
    for operation in (r.times, r.divided, r.division):
        with pytest.raises(TooBig):
            operation(p, x + y)
