"""What acts from outside during a step, carried to its end, against matrix exponentials."""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from modegraph.enclosure.arguments import Jacobian
from modegraph.enclosure.disturbance import STRAY, disturbance_columns
from modegraph.enclosure.exponential import POWERS, exponential_terms, push_columns
from modegraph.enclosure.monomials import monomials

TABLE = monomials((1, 1), 3)
Q = 2
SIZE = int(TABLE.start[Q + 1])
STIFF = np.array([[0.0, 0.0, 1.0], [1.0, -2.0, 0.0], [-20.0, 7.0, -30.0]])
PLACES = [*product((-1.0, 1.0), repeat=2), (0.3, -0.8)]
SCALES = [1e-3, 0.1, 1.0]
K = 12
"""Pieces of a signal during the step."""


def powers(xi: tuple[float, ...]) -> Any:
    return np.prod(np.array(xi) ** TABLE.exponents[:SIZE], axis=1)


def loop(seed: int, n: int, scale: float) -> Jacobian:
    """(J, dJ, nJ): Jacobians that cancel much, with some curvature and some motion in time."""
    rng = np.random.default_rng(seed)
    J = rng.normal(size=(n * n, 2, SIZE)) * scale
    J[:, 0, 0] += STIFF[:n, :n].ravel() if seed % 2 else 0.0
    nJ = np.stack([np.abs(J[:, :, TABLE.degree[:SIZE] == d]).sum(axis=2) for d in range(Q + 1)], axis=2)
    return Jacobian(J, np.full((n * n, 2), Q), nJ * (1 + 1e-12))


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("h", [0.01, 0.1])
def test_the_terms_of_the_exponential(scale: float, h: float) -> None:
    n = 3
    for seed in range(4):
        jacobian = loop(seed, n, scale)
        v = np.random.default_rng(seed + 50).normal(size=(n, SIZE))
        images, sizes, missed, beyond = exponential_terms(jacobian, v, h, Q, TABLE.arrays)
        for xi in PLACES:
            at = powers(xi)
            Z = h * (jacobian.J[:, 0] @ at).reshape(n, n)
            term, rest = v @ at, np.zeros(n)
            for k in range(40):
                if k <= POWERS:
                    slack = 1e-12 * np.abs(term).max()
                    assert (np.abs(term - images[k] @ at) <= missed[k] + slack).all()
                    assert (np.abs(images[k] @ at) <= sizes[k]).all()
                else:
                    rest += np.abs(term) / math.factorial(k)
                term = Z @ term
            assert (rest <= beyond * (1 + 1e-9)).all()


def test_what_lies_beyond_the_powers_that_are_formed() -> None:
    """x' = 40 x + w: there is little room, e^4 by powers up to the sixth misses a tenth of it."""
    J, dJ = np.zeros((1, 1, SIZE)), np.zeros((1, 1), np.int64)
    J[0, 0, 0] = 40.0
    one = np.zeros((1, SIZE))
    one[0, 0] = 1.0
    nJ = np.array([[[40.0, 0.0, 0.0]]])
    *_, beyond = exponential_terms(Jacobian(J, dJ, nJ), one, 0.1, Q, TABLE.arrays)
    true = math.exp(4.0) - sum(4.0**k / math.factorial(k) for k in range(POWERS + 1))
    assert true <= beyond[0] < 1.15 * true


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("h", [0.01, 0.1])
def test_a_push_at_any_time(scale: float, h: float) -> None:
    """Measures of total variation 1, one state at a time."""
    n = 3
    rng = np.random.default_rng(1)
    x = np.linspace(0.0, 1.0, K)
    for seed in range(4):
        jacobian = loop(seed, n, scale)
        chords, strays, tops = push_columns(jacobian, n, h, Q, TABLE.arrays)
        for xi in PLACES:
            at = powers(xi)
            Z = h * (jacobian.J[:, 0] @ at).reshape(n, n)
            carried = np.stack([expm(Z * s) for s in x])
            assert (np.abs(carried).max(axis=0) <= tops * (1 + 1e-9) + 1e-12).all()
            for trial, c in product(range(8), range(n)):
                mass = rng.normal(size=K) * (rng.random(K) < (0.1, 1.0)[trial % 2])
                mass = np.abs(mass) if trial < 4 else mass
                mass /= max(np.abs(mass).sum(), 1e-300)
                end = mass @ carried[:, :, c]
                middle, half = (chords[c] @ at)[0], (chords[c] @ at)[1]
                # |a + b| + |a - b| <= 2 for the sums of the masses and of the masses times 2 x - 1.
                a, b = mass.sum(), mass @ (2.0 * x - 1.0)
                assert max(abs(a), abs(b)) <= 1 + 1e-12
                assert (np.abs(end - a * middle - b * half) <= strays[:, c] * (1 + 1e-9) + 1e-12).all()


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("h", [0.01, 0.1])
def test_a_switched_disturbance(scale: float, h: float) -> None:
    n, nw = 3, 2
    rng = np.random.default_rng(2)
    radius = np.array([0.3, 1.5])
    # Gauss points of each piece: exact for the powers, and nearly so for the exponential.
    nodes, weights = np.polynomial.legendre.leggauss(4)
    x = ((np.arange(K)[:, None] + 0.5 + 0.5 * nodes) / K).ravel()
    dx = np.tile(0.5 * weights / K, K)
    for seed in range(4):
        jacobian = loop(seed, n, scale)
        B = rng.normal(size=(nw, n, SIZE))
        columns, outside, speed = disturbance_columns(jacobian, B, radius, h, Q, TABLE.arrays)
        for xi in PLACES:
            at = powers(xi)
            Z = h * (jacobian.J[:, 0] @ at).reshape(n, n)
            carried = np.stack([expm(Z * s) for s in x])
            for trial in range(12):
                # Constant, bang-bang at random, and along the second and third column.
                shape = (np.ones(K), np.sign(rng.normal(size=K)), np.sign(np.arange(K) - K // 2 + 0.5))[trial % 3]
                shape = np.sign(np.abs(np.arange(K) / K - 0.5) - 0.29) if trial > 8 else shape
                v = np.repeat(radius[:, None] * shape * rng.choice([-1.0, 1.0], (nw, 1)), len(nodes), axis=1)
                pushed = np.einsum("ti,tij,jt->ti", np.ones((len(x), n)), carried, h * (B @ at).T @ (v * dx))
                end = pushed.sum(axis=0)
                reached = np.abs(np.cumsum(pushed, axis=0))
                assert (reached <= speed * np.cumsum(dx)[:, None] * (1 + 1e-9) + 1e-12).all()
                line = 0.5 * x**2 - 1 / 6 - 0.5 * (x - 0.5)
                numbers = np.stack([v @ dx, v @ (dx * (x - 0.5)) * 4.0, v @ (dx * line) / STRAY[2]])
                share = numbers / radius
                assert (np.abs(share) <= 1.0 + 1e-9).all()
                inside = np.einsum("rj,jri->i", share, columns @ at)
                assert (np.abs(end - inside) <= outside * (1 + 1e-9) + 1e-13).all()
