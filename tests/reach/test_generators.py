"""Boxes around generators, and fewer generators, lose nothing."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from modegraph.reach.generators import generator_box, generator_sizes, thinned, with_box

N, Q = 3, 10
G = np.random.default_rng(3).normal(size=(7, N, Q)) * 0.1


@pytest.mark.parametrize("kept", [1, 3, 4])
def test_thinned_generators_hold_the_old_ones(kept: int) -> None:
    less = thinned(G, kept)
    assert less.shape[2] == kept
    rng = np.random.default_rng(0)
    for _ in range(200):
        powers = np.concatenate([[1.0], rng.choice([-1.0, 1.0, 0.2], Q - 1)])
        d = rng.normal(size=N)
        assert np.abs(G @ powers @ d).sum() <= np.abs(less @ powers[:kept] @ d).sum() * (1 + 1e-12)
    assert thinned(G, 5) is G
    assert (thinned(G, 0)[:, :, 0] == np.diag(generator_box(G))).all()


@pytest.mark.parametrize("scale", [1e-150, 1.0, 1e150])
def test_sums_are_rounded_up(scale: float) -> None:
    """Against exact arithmetic: the box, and rows of a matrix."""
    rng = np.random.default_rng(1)
    H, A = G * scale, rng.normal(size=(4, N))
    exact = [[[Fraction(float(v)) for v in row] for row in g] for g in H]
    for i, found in enumerate(generator_box(H)):
        assert sum(abs(v) for g in exact for v in g[i]) <= Fraction(float(found))
    for row, found in zip(A, generator_sizes(A, [H])[0], strict=True):
        a = [Fraction(float(v)) for v in row]
        total = sum(abs(sum(a[i] * g[i][k] for i in range(N))) for g in exact for k in range(Q))
        assert total <= Fraction(float(found)) <= total * (1 + Fraction(1, 10**12))


def test_no_generators_have_no_size() -> None:
    nothing = np.zeros((0, N, 1))
    assert not generator_box(nothing).any()
    assert not generator_sizes(np.eye(N), [nothing]).any()


def test_a_box_becomes_generators_of_its_own() -> None:
    radius = np.array([0.5, 0.0, 2.0])
    both = with_box(G, radius)
    assert (both[:7] == G).all()
    assert np.allclose(generator_box(both), generator_box(G) + radius)
    assert (both[7:, :, 0] == np.diag(radius)).all()
    assert not both[7:, :, 1:].any()
