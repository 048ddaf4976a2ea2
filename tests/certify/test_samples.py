"""Sampled starts are starts of their piece."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.samples import SAMPLES, points_of, powers_at, sample_powers, sample_variables
from modegraph.enclosure.monomials import monomials
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.reach_set import ReachSet, ReachSets
from modegraph.reach.start.piece import whole

STARTS: dict[str, Any] = {
    "box": mg.Box([0, 1], [2, 4]),
    "ball": mg.Ball([1, 1], 0.5),
    "ellipsoid": mg.Ellipsoid([0, 0], [[2.0, 1.2], [1.2, 1.0]]),
    "sublevel": mg.Sublevel(lambda x: np.abs(x[0]) * np.abs(x[1]) + x[0] ** 2 + x[1] ** 2, 0.5, dim=2),
}


@pytest.mark.parametrize("depth", [0, 3])
@pytest.mark.parametrize("kind", STARTS)
def test_samples_are_starts_of_the_piece(kind: str, depth: int) -> None:
    start = STARTS[kind]
    piece = whole(start, [(1.0, 2.0)])
    for k in range(depth):
        piece = piece.split(k % 3)[k % 2]
    eta = sample_variables(piece)
    assert eta.shape == (SAMPLES, 3)
    assert np.abs(eta).max() <= 1.0
    xi = piece.middle + piece.radius * eta
    free = piece.chart.free
    x = piece.chart.centre + xi[:, :free] @ piece.chart.axes.T
    near = np.asarray(start.center) + (x - np.asarray(start.center)) * (1.0 - 1e-9)
    inside = [start.contains(y) for y in near]
    # A part of a ball is a box cut with it: a sample pulled into the ball is put back into the box.
    assert np.mean(inside) > 0.5
    if not depth:
        assert all(inside)
        assert len(np.unique(eta[:, free])) > SAMPLES // 4


def test_points_are_the_polynomials_at_the_samples() -> None:
    piece, table = whole(STARTS["box"], []), monomials((1, 1), 3)
    bounds = PolynomialBounds(piece, table, table.size)
    p = np.random.default_rng(0).normal(size=(4, 2, table.size))
    sets = ReachSets.of(bounds, [ReachSet.of(bounds, q) for q in p], 2)
    eta = sample_variables(piece)
    found = points_of(sets, eta)
    assert found.shape == (4, SAMPLES, 2)
    for k in range(4):
        for s in (0, 20, 47):
            by_hand = p[k] @ [eta[s, 0] ** int(a) * eta[s, 1] ** int(b) for a, b in table.exponents]
            assert np.allclose(found[k, s], by_hand)
    assert (sample_powers(piece, table.exponents) == powers_at(eta, table.exponents)).all()
