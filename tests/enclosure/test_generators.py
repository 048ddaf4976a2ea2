"""Merging generators, and quadratic forms over them, by sampling."""

from __future__ import annotations

import numpy as np
import pytest

from modegraph.enclosure.quadratic import main_generators, quadratic_bound
from modegraph.enclosure.variational import reduce_generators
from modegraph.reach.quadric import generator_sizes


def at(G: np.ndarray, xi: np.ndarray) -> np.ndarray:
    """Generators (count, n) at set variables xi; monomials 1, xi_1, .."""
    return G @ np.concatenate([[1.0], xi])


@pytest.mark.parametrize("scale", [1e-300, 1.0, 1e150])
@pytest.mark.parametrize("keep", [0, 3, 11])
def test_reduced_generators_hold_the_old_zonotope(keep: int, scale: float) -> None:
    rng = np.random.default_rng(keep)
    for n in (1, 2, 4):
        G = rng.normal(size=(12, n, 3)) * np.array([1.0, 0.1, 0.1]) * 10.0 ** rng.uniform(-3, 0, (12, 1, 1))
        G[3], G[5], G[6] = 0.0, G[4], -0.5 * G[4]
        G *= scale
        less = reduce_generators(G, keep)
        assert len(less) <= 12 + n
        assert keep != 11 or len(less) <= keep + n
        for _ in range(40):
            xi = rng.uniform(-1.0, 1.0, 2)
            d = rng.normal(size=n)
            old, new = np.abs(at(G, xi) @ d).sum(), np.abs(at(less, xi) @ d).sum()
            assert old <= new * (1 + 1e-12)


def test_quadratic_bound_holds_and_follows_signs() -> None:
    rng = np.random.default_rng(3)
    for n in (1, 2, 3):
        for _ in range(10):
            H, G0, G1 = rng.normal(size=(n, n, n)), rng.normal(size=(5, n)), rng.normal(size=(5, n))
            spread = rng.random(n) * 0.3
            bound = quadratic_bound(H, G0, G1, spread)
            for _ in range(60):
                zeta, s = (
                    np.sign(rng.uniform(-1, 1, 5)) * rng.integers(0, 2, 5),
                    rng.choice([0.0, 1.0, rng.random()]),
                )
                e = (1 - s) * zeta @ G0 + s * zeta @ G1 + spread * rng.choice([-1.0, 1.0], n)
                assert (np.abs(np.einsum("ikl,k,l->i", H, e, e)) / 2 <= bound * (1 + 1e-12)).all()
    # x y from the x axis to the y axis: 0 at both ends, 1/4 half way.
    H = np.array([[[0.0, 1.0], [1.0, 0.0]]] * 2)
    assert (quadratic_bound(H, np.array([[1.0, 0.0]]), np.array([[0.0, 1.0]]), np.zeros(2)) >= 0.25).all()
    # x y along (1, 1) and (1, -1): what the box adds is cancelled by the signs.
    H = np.array([[[1.0, 0.0], [0.0, -1.0]]] * 2)
    slow = np.array([[1.0, 1.0]])
    assert quadratic_bound(H, slow, slow, np.zeros(2))[0] < 1e-14


def test_main_generators_put_the_rest_into_the_box() -> None:
    rng = np.random.default_rng(4)
    n = 3
    G0, G1 = rng.normal(size=(9, n, 3)), rng.normal(size=(9, n, 3))
    for most in (0, 4, 20):
        a0, a1, box = main_generators(G0, G1, most)
        assert len(a0) == len(a1) == min(most, 9)
        for _ in range(60):
            d = rng.normal(size=n)
            xi, s = rng.uniform(-1, 1, 2), rng.random()
            true = np.abs(((1 - s) * at(G0, xi) + s * at(G1, xi)) @ d).sum()
            kept = np.abs(((1 - s) * a0 + s * a1) @ d).sum()
            assert true <= (kept + np.abs(d) @ box) * (1 + 1e-12)


@pytest.mark.parametrize("terms", [1, 3])
def test_how_far_generators_reach_along_directions(terms: int) -> None:
    """Each coefficient counts by itself; states beyond those of A do not."""
    rng = np.random.default_rng(5)
    A, G = rng.normal(size=(4, 2)), rng.normal(size=(6, 3, terms))
    true = np.abs(np.einsum("fi,gik->fgk", A, G[:, :2])).sum(axis=(1, 2))
    found = generator_sizes(A, [G, np.zeros((0, 3, 1))])
    assert (found[0] >= true).all()
    assert found[0] == pytest.approx(true, rel=1e-12)
    assert (found[1] == 0.0).all()
