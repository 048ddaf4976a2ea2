"""|true value - stored polynomial| <= R at every node of random tapes, against ball arithmetic."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx, fmpq
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from modegraph.enclosure import arguments
from modegraph.enclosure.adjoint import tighten
from modegraph.enclosure.jets import PLAIN, TOO_WIDE, solve_in_time
from modegraph.enclosure.monomials import monomials
from modegraph.enclosure.remainder import coefficient_norms, image, remainders, wants_another_try
from modegraph.expression import ops

K = 3
TABLE = monomials((1, 1), 3)
CUT = np.array([3, 3, 2, 2], np.int64)
SPECIAL = [0.0, -0.0, 5e-324, -1e-310, 1e-150, 1e-17, 1 / 3, 1.0, -2.5, 40.0, -710.0, 1e8, -1e150, 1e300]
NUMBERS = st.one_of(st.sampled_from(SPECIAL), st.floats(-4.0, 4.0))
SPREADS = st.sampled_from([0.0, 0.0, 5e-324, 1e-160, 1e-9, 0.1, 0.5, 3.0, 1e9])


class Program:
    """A tape over two variables, row by row."""

    def __init__(self) -> None:
        self.rows: list[list[int]] = [[ops.VAR, 0, -1, -1], [ops.VAR, 1, -1, -1]]
        self.const = [0.0, 0.0]

    def add(self, op: int, a: int = -1, b: int = -1, c: int = -1, const: float = 0.0) -> int:
        self.rows.append([op, a, b, c])
        self.const.append(const)
        return len(self.rows) - 1

    def apply(self, op: int, a: int, b: int, c: int, const: float) -> None:
        if op == ops.CONST:
            self.add(op, const=const)
        elif op in (ops.MULC, ops.ADDC):
            self.add(op, a, const=const)
        elif op == ops.SIN:
            here = len(self.rows)
            self.add(ops.SIN, a, here + 1)
            self.add(ops.COS, a, here)
        elif op == ops.LOG:
            self.add(ops.LOG, a, self.add(ops.RECIP, a))
        elif op == ops.ATAN:
            slope = self.add(ops.RECIP, self.add(ops.ADDC, self.add(ops.SQR, a), const=1.0))
            self.add(ops.ATAN, a, slope)
        elif op in (ops.ADD, ops.SUB, ops.MUL):
            self.add(op, a, b)
        elif op == ops.WHERE:
            self.add(op, a, b, c)
        else:
            self.add(op, a)


KINDS = [
    ops.CONST, ops.ADD, ops.SUB, ops.MUL, ops.SQR, ops.MULC, ops.ADDC, ops.SIN, ops.RECIP, ops.EXP, ops.LOG,
    ops.ATAN, ops.RELU, ops.STEP, ops.WHERE,
]  # fmt: skip
CHOICES = st.tuples(st.sampled_from(KINDS), *[st.integers(0, 30)] * 3, NUMBERS)


@st.composite
def programs(draw: Any) -> Program:
    made = Program()
    for op, a, b, c, const in draw(st.lists(CHOICES, min_size=1, max_size=7)):
        size = len(made.rows)
        made.apply(op, a % size, b % size, c % size, const)
    return made


def stored(made: Program, start: np.ndarray, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """P, R (the lesser of both bounds) and kinks for variables with the coefficients ``start`` (2, K+1, N)."""
    rows = np.array(made.rows, np.int64)
    count = len(rows)
    tape = arguments.Program(rows, np.array(made.const), np.zeros(count), np.array([count - 1]), np.array([0, 1]))
    space = arguments.Workspace(
        P=np.zeros((count, K + 1, TABLE.size)),
        dg=np.full((count, K + 1), -1, np.int64),
        norms=np.zeros((count, K + 1, TABLE.order + 1)),
        R=np.zeros(count),
        kinks=np.zeros((count, 2)),
        ranges=np.full((count, 2), np.nan),
    )
    space.P[:2] = start
    for v in range(2):
        for j in range(K + 1):
            space.dg[v, j] = max((int(TABLE.degree[k]) for k in np.flatnonzero(start[v, j])), default=-1)
    space.R[:2] = radius
    for _ in range(2):
        solve_in_time(tape, space, 0, 1.0, CUT, TABLE.arrays)
        coefficient_norms(space, TABLE.start)
        _, A, local = remainders(tape, space, CUT, TABLE.arrays)
        if not wants_another_try(rows, space):
            break
    tighten(tape, np.arange(count), space, A, local)
    return space.P, space.R, space.kinks


def ball(x: Fraction) -> arb:
    return arb(fmpq(x.numerator, x.denominator))


def polynomial(coefficients: np.ndarray, xi: list[Fraction], s: Fraction) -> arb:
    total = Fraction(0)
    for j, k in zip(*np.nonzero(coefficients), strict=True):
        e = TABLE.exponents[k]
        total += Fraction(float(coefficients[j, k])) * xi[0] ** int(e[0]) * xi[1] ** int(e[1]) * s ** int(j)
    return ball(total)


def truth(made: Program, x: list[arb]) -> list[arb | None]:
    """Exact values, None where undefined or where the balls cannot tell."""
    out: list[arb | None] = []
    one = {ops.SIN: arb.sin, ops.COS: arb.cos, ops.EXP: arb.exp, ops.ATAN: arb.atan, ops.SQR: lambda v: v * v}
    for (op, a, b, c), const in zip(made.rows, made.const, strict=True):
        value: arb | None = None
        va = None if op in (ops.VAR, ops.CONST) else out[a]
        if op == ops.VAR:
            value = x[a]
        elif op == ops.CONST:
            value = arb(const)
        elif op == ops.WHERE:
            vc = out[c]
            value = None if vc is None else va if vc > 0 else out[b] if vc <= 0 else None
        elif va is None:
            pass
        elif op in one:
            value = one[op](va)
        elif op == ops.RECIP:
            value = 1 / va if va != 0 else None
        elif op == ops.LOG:
            value = va.log() if va > 0 else None
        elif op == ops.MULC:
            value = va * arb(const)
        elif op == ops.ADDC:
            value = va + arb(const)
        elif op == ops.RELU:
            value = va if va > 0 else arb(0) if va <= 0 else None
        elif op == ops.STEP:
            # At 0 any slope of relu will do: the step only occurs as its derivative.
            value = arb(1) if va > 0 else arb(0) if va < 0 else None
        elif out[b] is not None:
            vb = out[b]
            value = va + vb if op == ops.ADD else va - vb if op == ops.SUB else va * vb
        out.append(value if value is not None and value.is_finite() else None)
    return out


def check(made: Program, start: np.ndarray, radius: np.ndarray, points: list[list[Fraction]]) -> None:
    P, R, _ = stored(made, start, radius)
    with ctx.workprec(1200):
        for *xi, s, off0, off1 in points:
            offsets = [ball(Fraction(float(r)) * o) for r, o in zip(radius, (off0, off1), strict=True)]
            values = truth(made, [polynomial(P[v], xi, s) + offsets[v] for v in range(2)])
            for q, value in enumerate(values):
                if not np.isfinite(P[q]).all():
                    continue  # Overflowed: whatever reads it is unbounded.
                if np.isfinite(R[q]) and value is not None:
                    assert not abs(value - polynomial(P[q], xi, s)) > arb(float(R[q])), (
                        made.rows[: q + 1],
                        xi,
                        s,
                    )
                elif np.isfinite(R[q]) and made.rows[q][0] in (ops.RECIP, ops.LOG):
                    argument = values[made.rows[q][1]]
                    bad = argument is not None and (argument == 0 or (made.rows[q][0] == ops.LOG and argument <= 0))
                    assert not bad, ("undefined, but bounded", made.rows[: q + 1])


UNIT = st.integers(-8, 8).map(lambda k: Fraction(k, 8))
POINT = st.tuples(UNIT, UNIT, st.integers(0, 8).map(lambda k: Fraction(k, 8)), UNIT, UNIT).map(list)
EXTREMES = [
    [Fraction(a), Fraction(b), Fraction(s), Fraction(a), Fraction(b)] for a in (-1, 1) for b in (-1, 1) for s in (0, 1)
]


@settings(max_examples=1000, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
@given(
    programs(),
    st.tuples(NUMBERS, NUMBERS),
    st.lists(SPREADS, min_size=8, max_size=8),
    st.lists(POINT, max_size=4),
)
def test_random_expressions(
    made: Program, centre: tuple[float, float], spread: list[float], points: list[list[Fraction]]
) -> None:
    start = np.zeros((2, K + 1, TABLE.size))
    start[:, 0, 0] = centre
    for v in range(2):
        start[v, 0, TABLE.linear[v]] = spread[v]
        start[v, 0, TABLE.linear[1 - v]] = -0.5 * spread[2 + v]
        start[v, 1, 0] = spread[4 + v]
        start[v, 2, TABLE.linear[v]] = 0.25 * spread[4 + v]
    check(made, start, np.array(spread[6:]), [*EXTREMES, *points])


@pytest.mark.parametrize("op", [ops.SIN, ops.RECIP, ops.EXP, ops.LOG, ops.ATAN, ops.RELU, ops.STEP])
@pytest.mark.parametrize("centre", [5e-324, 1e-310, 1e-150, 0.7, 20.0, 1e8, 1e154, 1e300])
def test_one_function_at_every_scale(op: int, centre: float) -> None:
    for sign in (1.0, -1.0):
        for share in (0.0, 1e-12, 0.4, 0.999, 3.0):
            made = Program()
            made.apply(op, 0, 0, 0, 0.0)
            start = np.zeros((2, K + 1, TABLE.size))
            start[0, 0, 0] = sign * centre
            start[0, 0, TABLE.linear[0]] = 0.5 * share * centre
            start[0, 1, 0] = 0.5 * share * centre
            check(made, start, np.zeros(2), EXTREMES)


@pytest.mark.parametrize(
    "op, lo, hi",
    [(ops.EXP, -30.0, 30.0), (ops.LOG, 1e-3, 9.0), (ops.ATAN, -50.0, 50.0)],
)
def test_wide_arguments_fall_back_to_the_range(op: int, lo: float, hi: float) -> None:
    made = Program()
    made.apply(op, 0, 0, 0, 0.0)
    start = np.zeros((2, K + 1, TABLE.size))
    start[0, 0, 0], start[0, 0, TABLE.linear[0]] = 0.5 * (lo + hi), 0.5 * (hi - lo)
    P, R, kinks = stored(made, start, np.zeros(2))
    assert kinks[-1, 0] in (PLAIN, TOO_WIDE)
    low, high = image(op, lo, hi)
    assert R[-1] <= 0.51 * (high - low) * 1.01
    assert np.count_nonzero(P[-1]) <= 1
    check(made, start, np.zeros(2), [*EXTREMES, [Fraction(1, 3)] * 2 + [Fraction(1, 2)] + [Fraction(0)] * 2])


@pytest.mark.parametrize("op", [ops.RECIP, ops.EXP, ops.LOG, ops.ATAN, ops.SIN, ops.RELU, ops.STEP, ops.MULC, ops.SQR])
def test_overflow_is_never_bounded(op: int) -> None:
    """A square that overflows is stored as infinite: no function of it has a finite value and bound."""
    made = Program()
    made.apply(op, made.add(ops.SQR, 0), 0, 0, -1.0)
    start = np.zeros((2, K + 1, TABLE.size))
    start[0, 0, 0] = 2e154
    P, R, _ = stored(made, start, np.zeros(2))
    assert np.isinf(R[-1]) or not np.isfinite(P[-1]).all()


@pytest.mark.parametrize("op", [ops.RECIP, ops.LOG])
def test_undefined_arguments_are_unbounded(op: int) -> None:
    made = Program()
    made.apply(op, 0, 0, 0, 0.0)
    start = np.zeros((2, K + 1, TABLE.size))
    start[0, 0, 0], start[0, 0, TABLE.linear[0]] = 1.0, 1.0
    assert np.isinf(stored(made, start, np.zeros(2))[1][-1])


def test_a_large_factor_of_a_small_value_costs_only_relative_rounding() -> None:
    """mu / r^3 of an orbit: the factor is 1e18, what it multiplies 1e-16."""
    made = Program()
    made.apply(ops.MULC, 0, 0, 0, 1e18)
    start = np.zeros((2, K + 1, TABLE.size))
    start[0, 0, 0] = 1e-16
    P, R, _ = stored(made, start, np.zeros(2))
    assert R[-1] <= 1e-15 * abs(P[-1, 0, 0])


def far_input(made: Program, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """P, R of a program whose first variable is 1 up to a radius, with nothing truncated."""
    start = np.zeros((2, K + 1, TABLE.size))
    start[0, 0, 0] = 1.0
    P, R, _ = stored(made, start, np.array([radius, 0.0]))
    check(made, start, np.array([radius, 0.0]), EXTREMES)
    return P, R


@pytest.mark.parametrize("op", [ops.SQR, ops.EXP, ops.RECIP, ops.SIN])
def test_sensitivities_hold_over_the_whole_range(op: int) -> None:
    """A wide input: the slope at the centre is far from the largest one."""
    made = Program()
    made.apply(op, 0, 0, 0, 0.0)
    far_input(made, 0.5)


def test_terms_that_cancel_do_not_add_up() -> None:
    """3 x - 2 x: forward 5 times the radius of x, by adjoints once."""
    made = Program()
    made.add(ops.SUB, made.add(ops.MULC, 0, const=3.0), made.add(ops.MULC, 0, const=2.0))
    _, R = far_input(made, 0.5)
    assert 0.5 <= R[-1] <= 0.5 * (1.0 + 1e-9)


def over_a_kink(op: int, start: np.ndarray) -> tuple[np.ndarray, float]:
    """P and R of the last node: relu or step of the first variable, or where it is positive."""
    made = Program()
    made.apply(op, 0, 1, 0, 0.0)
    points = [[Fraction(a), Fraction(0), Fraction(s, 16), *[Fraction(0)] * 2] for a in (-1, 0, 1) for s in range(17)]
    check(made, start, np.zeros(2), points)
    P, R, _ = stored(made, start, np.zeros(2))
    return P, R[-1]


@pytest.mark.parametrize("op", [ops.RELU, ops.STEP, ops.WHERE])
def test_a_kink_that_is_crossed_between_the_ends(op: int) -> None:
    """8 s - 8 s^2 - 1 is negative at both ends and 1 in the middle."""
    start = np.zeros((2, K + 1, TABLE.size))
    start[0, :3, 0] = -1.0, 8.0, -8.0
    for side in (1.0, -1.0):
        assert over_a_kink(op, side * start)[1] > 0.3


@pytest.mark.parametrize("op", [ops.RELU, ops.STEP, ops.WHERE])
def test_a_set_that_moves_onto_a_kink(op: int) -> None:
    """.5 - s and s - .5, with a share of xi."""
    start = np.zeros((2, K + 1, TABLE.size))
    start[0, :2, 0] = 0.5, -1.0
    start[0, 0, TABLE.linear[0]] = 0.25
    for side in (1.0, -1.0):
        assert over_a_kink(op, side * start)[1] > 0.1


@pytest.mark.parametrize("op", [ops.RELU, ops.STEP, ops.WHERE])
def test_a_set_that_shrinks_away_from_a_kink(op: int) -> None:
    """1.01 + (1 - s) xi is at least .01, though its powers of time add up to more than 1.01."""
    start = np.zeros((2, K + 1, TABLE.size))
    start[0, 0, 0] = 1.01
    start[0, :2, TABLE.linear[0]] = 1.0, -1.0
    P, R = over_a_kink(op, start)
    assert R <= 1e-13
    if op == ops.RELU:
        np.testing.assert_array_equal(P[-1], P[0])
