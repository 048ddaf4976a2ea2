"""Single kernels against exact rationals, ball arithmetic and closed forms."""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import pytest
from flint import arb, arb_mat, ctx
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from modegraph.enclosure.arguments import Errors, Jacobian
from modegraph.enclosure.disturbance import DROPPED, SET_VARIABLE, disturbance_bounds
from modegraph.enclosure.monomials import monomials
from modegraph.enclosure.polynomial import compose_into, multiply_into
from modegraph.enclosure.ranges import upper_bound
from modegraph.enclosure.rounding import TINY, gamma
from modegraph.enclosure.variational import (
    advance_generators,
    apply_matrix,
    exponential_majorant,
    fundamental_defect,
    fundamental_matrix,
    growth_bound,
)
from modegraph.expression import ops
from tests.enclosure.test_jets_and_remainder import TABLE as NODE_TABLE
from tests.enclosure.test_jets_and_remainder import K, Program, check, stored

TABLE = monomials((1, 1), 3)
N = TABLE.size
SPECIAL = [0.0, -0.0, 5e-324, -5e-324, 2.2250738585072014e-308, -1e-310, 1e-150, -1e-17, 1 / 3, 1.0, -1.0, 1e8, -1e150]
NUMBERS = st.one_of(st.sampled_from(SPECIAL), st.floats(-3.0, 3.0))
VECTORS = st.lists(NUMBERS, min_size=N, max_size=N).map(np.array)
CORNERS = [tuple(Fraction(v) for v in xi) for xi in product((-1, 1), (-1, 1))] + [(Fraction(1, 3), Fraction(-5, 8))]
MANY = settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)


def exact(c: np.ndarray, xi: tuple[Fraction, ...]) -> Fraction:
    """The polynomial c over a prefix of the table at xi."""
    terms = zip(c, TABLE.exponents[: len(c)], strict=True)
    return sum((Fraction(float(v)) * xi[0] ** int(e[0]) * xi[1] ** int(e[1]) for v, e in terms), Fraction(0))


def degree(c: np.ndarray) -> int:
    return max((int(TABLE.degree[k]) for k in np.flatnonzero(c)), default=-1)


@MANY
@given(VECTORS, VECTORS, st.integers(0, 3), st.sampled_from([1.0, -1.0, 0.1]))
def test_a_product_is_the_truncated_product(a: np.ndarray, b: np.ndarray, top: int, factor: float) -> None:
    c = np.zeros(N)
    multiply_into(c, a, degree(a), b, degree(b), top, factor, TABLE.arrays)
    true, size = [Fraction(0)] * N, [Fraction(0)] * N
    for i, j in product(range(N), repeat=2):
        if TABLE.degree[i] + TABLE.degree[j] <= top:
            k = int(TABLE.product[TABLE.offset[i] + j])
            term = Fraction(float(a[i])) * Fraction(float(b[j])) * Fraction(factor)
            true[k] += term
            size[k] += abs(term)
    for k in range(N):
        allowed = size[k] * Fraction(gamma(TABLE.pairs + 3)) + Fraction(TINY)
        assert abs(Fraction(float(c[k])) - true[k]) <= allowed


@MANY
@given(VECTORS, st.lists(st.floats(-2.0, 2.0), min_size=4, max_size=4))
def test_a_composition_is_horners_polynomial(u: np.ndarray, series: list[float]) -> None:
    u = np.clip(u, -2.0, 2.0)
    u[0] = 0.0
    u[TABLE.degree > 1] = 0.0  # nothing is truncated then
    c = np.zeros(N)
    compose_into(c, u, max(degree(u), 0), np.array(series), 3, np.zeros(N), TABLE.arrays)
    for xi in CORNERS:
        y = exact(u, xi)
        true = sum(Fraction(s) * y**k for k, s in enumerate(series))
        size = sum(Fraction(abs(s)) * Fraction(float(np.abs(u).sum())) ** k for k, s in enumerate(series))
        assert abs(exact(c, xi) - true) <= size * Fraction(gamma(200)) + Fraction(TINY)


@MANY
@given(st.integers(1, 2), st.integers(1, 3), st.integers(0, 2**31), st.sampled_from([1e-150, 1.0, 1e120]))
def test_transported_generators_hold_the_exact_product(n: int, q: int, seed: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    size = int(TABLE.start[q + 1])
    F = rng.normal(size=(n, n, size)) * (rng.random((n, n, size)) < 0.8)
    G = rng.normal(size=(3, n, size)) * (rng.random((3, n, size)) < 0.7) * scale
    H, lost = advance_generators(F, G, q, TABLE.arrays)
    for xi in CORNERS:
        for r in range(n):
            off = Fraction(0)
            for g in range(3):
                true = sum(exact(F[r, c], xi) * exact(G[g, c], xi) for c in range(n))
                off += abs(true - exact(H[g, r], xi))
            assert off <= Fraction(float(lost[r])) + Fraction(TINY)


@MANY
@given(st.integers(0, 2**31), st.sampled_from([1e-160, 1.0, -0.125, 1e100]))
def test_what_a_matrix_drops_from_a_vector(seed: int, factor: float) -> None:
    rng = np.random.default_rng(seed)
    n, q = 2, 2
    size = int(TABLE.start[q + 1])
    J, v = rng.normal(size=(n * n, 1, size)), rng.normal(size=(n, size)) * (rng.random((n, size)) < 0.7)
    jacobian = Jacobian(J, np.full((n * n, 1), q), np.zeros((n * n, 1, q + 1)))
    out, lost = apply_matrix(jacobian, v, n, q, factor, TABLE.arrays)
    for xi, i in product(CORNERS, range(n)):
        true = sum(exact(J[i * n + k, 0], xi) * exact(v[k], xi) for k in range(n)) * Fraction(factor)
        rounding = Fraction(gamma(n * TABLE.pairs + 4)) * Fraction(abs(factor)) * 100
        assert abs(exact(out[i], xi) - true) <= Fraction(float(lost[i])) + rounding + Fraction(TINY)


@pytest.mark.parametrize("scale", [0.0, 5e-324, 1e-160, 1e-3, 1.0, 9.0, 40.0])
def test_the_exponential_majorant(scale: float) -> None:
    rng = np.random.default_rng(1)
    for n in (1, 2, 3):
        for X in (rng.normal(size=(n, n)) * scale, np.abs(rng.normal(size=(n, n))) * scale):
            W, norm = exponential_majorant(X)
            with ctx.workprec(400):
                for s in (0.0, 0.25, 0.5, 1.0):
                    true = arb_mat([[arb(float(v)) * arb(s) for v in row] for row in X]).exp()
                    assert all(abs(true[i, j]) <= arb(float(W[i, j])) for i in range(n) for j in range(n))
            assert max(sum(Fraction(abs(float(v))) for v in row) for row in X) <= Fraction(float(norm))


@pytest.mark.parametrize("uncertain", [0.0, 0.3])
@pytest.mark.parametrize("KP, q", [(2, 1), (3, 2), (5, 2)])
def test_the_defect_of_the_fundamental_matrix(KP: int, q: int, uncertain: float) -> None:
    n, KJ, h = 2, 1, 0.7
    size = int(TABLE.start[q + 1])
    rng = np.random.default_rng(KP)
    s = (np.arange(400) + 0.5) / 400
    for scale in (1.0, 1.0, 1.0, 0.2, 0.2, 0.01):
        J = rng.normal(size=(n * n, KJ + 1, size)) * scale
        dJ = np.full((n * n, KJ + 1), q)
        norms = np.stack([np.abs(J[:, :, TABLE.degree[:size] == d]).sum(axis=2) for d in range(q + 1)], axis=2)
        end, sup, last, bend, tails = fundamental_matrix(Jacobian(J, dJ, norms), n, h, KP, q, TABLE.arrays)
        E = fundamental_defect(norms, np.full(n * n, uncertain), sup, tails, n, h, KP, q, TABLE.pairs)
        S = _fundamental(J.reshape(n, n, KJ + 1, size), h, KP, q)
        for xi in [*product((-1.0, 1.0), (-1.0, 1.0)), (0.3, -0.6)]:
            at = np.prod(np.array(xi) ** TABLE.exponents[:size], axis=1)
            psi = np.einsum("jrck,k,jt->trc", S, at, s ** np.arange(KP + 1)[:, None])
            slope = np.einsum("jrck,k,jt->trc", S[1:], at, np.arange(1, KP + 1)[:, None] * s ** np.arange(KP)[:, None])
            true = np.einsum("rcik,k,it->trc", J.reshape(n, n, KJ + 1, size), at, s ** np.arange(KJ + 1)[:, None])
            near = true + uncertain * rng.choice([-1.0, 1.0], (n, n))
            assert (np.abs(h * near @ psi - slope).mean(axis=0) <= E * (1 + 1e-4) + 1e-14).all()
            assert (np.abs(psi) <= sup + 1e-14).all()
            finish = (S.sum(axis=0) * at).sum(axis=2)
            assert (np.abs(finish) <= last).all()
            assert np.allclose(end @ at, finish)
            chord = np.eye(n) + s[:, None, None] * (finish - np.eye(n))
            assert (np.abs(psi - chord) <= bend + 1e-12).all()


def _fundamental(J: np.ndarray, h: float, KP: int, q: int) -> np.ndarray:
    """Coefficients (KP + 1, n, n, size) of Psi' = h J Psi truncated at degree q, the plain way."""
    n, size = len(J), J.shape[3]
    S = np.zeros((KP + 1, n, n, size))
    S[0, np.arange(n), np.arange(n), 0] = 1.0
    for j in range(KP):
        for r, c, k, i in product(range(n), range(n), range(n), range(min(j, J.shape[2] - 1) + 1)):
            for a, b in product(range(size), repeat=2):
                if TABLE.degree[a] + TABLE.degree[b] <= q:
                    S[j + 1, r, c, TABLE.product[TABLE.offset[a] + b]] += (
                        h / (j + 1) * J[r, k, i, a] * S[j - i, k, c, b]
                    )
    return S


@MANY
@given(st.integers(1, 4), st.integers(0, 2**31), st.sampled_from([5e-324, 1e-300, 1e-9, 1.0, 1e200]))
def test_growth_bounds_satisfy_their_inequality(n: int, seed: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    M = rng.random((n, n)) * float(rng.choice([0.1, 1.0, 4.0]))
    c = rng.random(n) * scale * 10.0 ** rng.uniform(-12, 0, n)
    h = float(rng.choice([0.01, 0.3]))
    found, g = growth_bound(h, M, c)
    if found:
        for i in range(n):
            grown = sum(Fraction(h) * Fraction(float(M[i, j])) * Fraction(float(g[j])) for j in range(n))
            assert Fraction(float(g[i])) >= grown + Fraction(float(c[i]))
    elif scale > 1e-300:
        assert h * np.abs(np.linalg.eigvals(M)).max() > 0.9


@pytest.mark.parametrize("radius", [0.5, 1e-300])
def test_the_mean_of_the_disturbance_matrix(radius: float) -> None:
    """df/dw = b0 + b1 s + b2 s^2 + c xi + e error + d s xi^2 with xi, error, s free."""
    errors = Errors(np.array([0, 1]), np.array([SET_VARIABLE, SET_VARIABLE, 0, DROPPED]), np.array([2]))
    rng = np.random.default_rng(2)
    for _ in range(40):
        Q = np.zeros((1, 3, 4))
        Q[0, :, 0], Q[0, 0, 1:] = rng.normal(size=3), rng.normal(size=3)
        Q[0, 1, 3] = rng.normal()
        off = 0.125
        B, miss = disturbance_bounds(Q, np.array([off]), np.array([0]), 0, 1, np.array([radius]), errors)
        for s, xi, e, two in product(np.linspace(0.0, 1.0, 11), (-1.0, 1.0), (-1.0, 1.0), (-1.0, 1.0)):
            true = s ** np.arange(3) @ Q[0] @ np.array([1.0, xi, e, two]) + off * e
            mean = B[0, 0] @ np.array([1.0, xi])
            assert abs(true - mean) * radius <= miss[0] * (1 + 1e-12)


@pytest.mark.parametrize("op", [ops.RELU, ops.STEP, ops.WHERE])
@pytest.mark.parametrize("centre", [0.25, -0.375, 0.0, -0.0, 1.0, -1.0])
def test_a_kink_inside_the_range(op: int, centre: float) -> None:
    made = Program()
    made.apply(op, 0, 1, 0, 0.0)
    start = np.zeros((2, K + 1, NODE_TABLE.size))
    start[0, 0, 0], start[0, 0, NODE_TABLE.linear[0]], start[1, 0, 0] = centre, 1.0, 7.0
    zero = Fraction(0)
    points = [[Fraction(k, 16), zero, Fraction(s), zero, zero] for k in range(-16, 17) for s in (0, 1)]
    check(made, start, np.zeros(2), points)
    if op == ops.WHERE:
        assert np.isinf(stored(made, start, np.zeros(2))[1][-1])


@MANY
@given(
    st.lists(NUMBERS, min_size=N, max_size=N).map(np.array),
    st.tuples(*[st.sampled_from([-1.0, -0.75, -5e-324, -0.0, 0.0, 1e-310, 0.3, 1.0])] * 4),
    st.sampled_from([0, 1, 40]),
)
def test_bisected_bounds_hold_exactly(c: np.ndarray, ends: tuple[Any, ...], cells: int) -> None:
    lo, hi = np.minimum(ends[:2], ends[2:]), np.maximum(ends[:2], ends[2:])
    bound = Fraction(float(upper_bound(c, TABLE.exponents, lo, hi, -np.inf, cells)))
    sides = [
        {Fraction(float(a)), Fraction(float(b)), (Fraction(float(a)) + Fraction(float(b))) / 2}
        | ({Fraction(0)} if a <= 0.0 <= b else set())
        for a, b in zip(lo, hi, strict=True)
    ]
    assert all(exact(c, xi) <= bound for xi in product(*sides))
