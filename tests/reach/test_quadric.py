"""Gauges in a quadratic norm hold all points of a set, and are not far above the farthest."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.enclosure.monomials import monomials
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.quadric import Quadric
from modegraph.reach.reach_set import ReachSet, ReachSets
from modegraph.reach.start.piece import whole

TABLE = monomials((1, 1), 2)
N = 3


def some_sets(start: Any, scale: float, box: float, depth: int = 0) -> ReachSets:
    piece = whole(start, [])
    for k in range(depth):
        piece = piece.split(k % 2)[0]
    bounds = PolynomialBounds(piece, TABLE, TABLE.size)
    rng = np.random.default_rng(8)
    each = []
    for g in range(6):
        p = rng.normal(size=(N, TABLE.size)) * scale
        p[:, 3:] *= 0.1
        G = rng.normal(size=(g, N, 3)) * 0.05 * scale
        each.append(ReachSet.of(bounds, p, G).plus_box(rng.uniform(0.0, box, N) * scale))
    return ReachSets.of(bounds, each, N)


def farthest(quadric: Quadric, reach: ReachSet) -> float:
    """The largest norm of sampled points."""
    rng, piece = np.random.default_rng(9), reach.piece
    eta = rng.choice([-1.0, 1.0, 0.5], (4000, 2))
    if piece.chart.round:
        xi = piece.middle + piece.radius * eta
        xi = xi / np.maximum(1.0, np.linalg.norm(xi, axis=1))[:, None]
        eta = (xi - piece.middle) / piece.radius
        eta = eta[(np.abs(eta) <= 1.0).all(axis=1)]
    powers = np.prod(eta[:, None, :] ** TABLE.exponents, axis=2)
    zeta = rng.choice([-1.0, 1.0], (len(eta), len(reach.G)))
    e = rng.choice([-1.0, 1.0], (len(eta), N)) * reach.box
    x = powers @ reach.p.T + np.einsum("sg,gik,sk->si", zeta, reach.G, powers[:, :3]) + e
    return float(np.linalg.norm((x - quadric.centre) @ quadric.T.T, axis=1).max())


@pytest.mark.parametrize("depth", [0, 2])
@pytest.mark.parametrize("box", [0.0, 1.0])
@pytest.mark.parametrize("scale", [1e-100, 1.0, 1e100])
@pytest.mark.parametrize("start", [mg.Box([0, 0], [1, 1]), mg.Ball([0, 0], 1.0)], ids=["box", "ball"])
def test_no_point_is_farther(start: Any, scale: float, box: float, depth: int) -> None:
    rng = np.random.default_rng(1)
    quadric = Quadric(rng.normal(size=N) * scale, rng.normal(size=(N, N)) / scale)
    sets = some_sets(start, scale, box, depth)
    gauges = quadric.gauges(sets)
    for k, gauge in enumerate(gauges.tolist()):
        least = farthest(quadric, sets[k])
        assert least * (1.0 - 1e-12) <= gauge <= 3.0 * least
        assert quadric.gauge(sets[k]) >= least * (1.0 - 1e-12)


def test_what_the_norm_is_off_by_counts() -> None:
    sets = some_sets(mg.Box([0, 0], [1, 1]), 1.0, 1.0)
    plain, grown = (Quadric(np.zeros(N), np.eye(N), grow).gauges(sets) for grow in (1.0, 1.5))
    assert np.allclose(grown, 1.5 * plain)


def test_a_box_adds_the_norm_of_its_corner() -> None:
    quadric = Quadric(np.zeros(2), np.diag([1.0, 2.0]))
    assert quadric.box_gauges(np.array([[3.0, 2.0]]))[0] == pytest.approx(5.0)
    assert quadric.box_gauges(np.array([[3.0, 2.0]]))[0] >= 5.0
