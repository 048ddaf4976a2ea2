"""Bounds of polynomials over pieces of a start set."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.enclosure.monomials import monomials
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.start.piece import whole


@pytest.mark.parametrize("size", [1.0, 1e-150, 1e-163, 1e-200, 1e-300])
def test_a_linear_form_on_a_ball_is_bounded_at_every_scale(size: float) -> None:
    table = monomials((1, 1), 1)
    bounds = PolynomialBounds(whole(mg.Ball([0.0, 0.0], 1.0), []), table, table.size)
    p = np.zeros(table.size)
    p[table.linear[0]] = size
    assert float(bounds.upper(p)) >= size


@pytest.mark.parametrize("start", [mg.Box([0, 0], [1, 1]), mg.Ball([0, 0], 1.0)])
@pytest.mark.parametrize("scale", [1e-300, 1.0, 1e150])
def test_no_sample_is_outside_the_range(start: Any, scale: float) -> None:
    table = monomials((1, 1), 4)
    rng = np.random.default_rng(6)
    for piece in [whole(start, []), *whole(start, []).split(0)]:
        bounds = PolynomialBounds(piece, table, table.size)
        xi = rng.uniform(-1.0, 1.0, (500, 2))
        xi[:4] = [[1, 1], [1, -1], [-1, 1], [-1, -1]]
        if isinstance(start, mg.Ball):
            plain = piece.middle + piece.radius * xi
            xi = xi[(plain**2).sum(axis=1) <= 1.0]
        powers = np.prod(xi[:, None, :] ** table.exponents, axis=2)
        for _ in range(20):
            p = rng.normal(size=table.size) * (rng.random(table.size) < 0.4) * scale
            lo, hi = bounds.ranges(p)
            below, above = bounds.nonlinear_radius(p)
            slack = 1e-12 * np.abs(p).sum()
            assert ((powers @ p >= lo - slack) & (powers @ p <= hi + slack)).all()
            higher = powers[:, table.degree > 1] @ p[table.degree > 1]
            assert ((higher >= below - slack) & (higher <= above + slack)).all()


def test_a_linear_form_on_parts_of_a_ball() -> None:
    table = monomials((1, 1), 1)
    angle = np.linspace(0.0, 2.0 * np.pi, 721)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1) * (1.0 - 1e-15)
    parts = whole(mg.Ball([0.0, 0.0], 1.0), []).split(0)
    parts += [child for part in parts for child in part.split(1)]
    for piece in parts:
        inside = circle[((piece.lo <= circle) & (circle <= piece.hi)).all(axis=1)]
        eta = (inside - piece.middle) / piece.radius
        bounds = PolynomialBounds(piece, table, table.size)
        for d in circle[::15]:
            p = np.zeros(table.size)
            p[table.linear] = d * piece.radius
            assert (eta @ (d * piece.radius)).max() <= float(bounds.upper(p)) + 1e-14
