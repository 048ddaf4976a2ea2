"""Pieces of start sets hold their starts."""

from __future__ import annotations

from fractions import Fraction as F

import numpy as np
import pytest

import modegraph as mg
from modegraph.enclosure.monomials import monomials
from modegraph.errors import ModegraphError
from modegraph.model.sets import Set
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.field import cover
from modegraph.reach.start.piece import Piece, point, whole


def sets(scale: float) -> dict[str, Set]:
    c = np.array([1.0, -2.0]) * scale
    return {
        "box": mg.Box(c - 0.3 * scale, c + 0.1 * scale),
        "flat": mg.Box(c, c + np.array([0.0, 0.1]) * scale),
        "ball": mg.Ball(c, 0.7 * scale),
        "ellipsoid": mg.Ellipsoid(c, np.array([[2.0, 1.2], [1.2, 1.0]]) * scale**2),
        "zonotope": mg.Zonotope(c, np.array([[1.0, 0.4, 0.0], [0.5, -0.2, 0.3]]) * scale),
        "polytope": mg.Polytope([[1, 1], [-1, 2], [0, -1]], np.array([0.5, -2.0, 4.0]) * scale),
    }


def tops(piece: Piece, directions: np.ndarray) -> np.ndarray:
    table = monomials((1,) * piece.variables, 1)
    p, _, slack = piece.polynomials(table.linear, table.size)
    bounds = PolynomialBounds(piece, table, table.size)
    return bounds.upper(directions @ p) + np.abs(directions) @ slack


@pytest.mark.parametrize("scale", [1e-150, 1e-3, 1.0, 1e150])
@pytest.mark.parametrize("kind", sets(1.0))
def test_every_start_is_in_a_piece(kind: str, scale: float) -> None:
    start = sets(scale)[kind]
    directions = np.random.default_rng(0).normal(size=(40, 2))
    values = start.sample(60, seed=1) @ directions.T
    piece = whole(start, [])
    top = tops(piece, directions)
    assert (values.max(axis=0) <= top * (1 + 1e-15) + 1e-15 * np.abs(top)).all()
    parts = [piece]
    for variable in range(piece.variables):
        parts = [child for part in parts for child in part.split(variable)]
    cover_all = np.max([tops(part, directions) for part in parts], axis=0)
    assert (values.max(axis=0) <= cover_all + 1e-14 * np.abs(cover_all)).all()
    for value in values:
        assert any((value <= (t := tops(part, directions)) + 1e-14 * np.abs(t)).all() for part in parts)


def test_unknown_constants_are_variables_where_they_are_not_known() -> None:
    piece = whole(mg.Box([0.0], [1.0]), [(0.1, 0.7), (2.0, 2.0)])
    assert piece.variables == 2
    assert piece.uncertain.tolist() == [0]
    ranges = [part.unknown_range(0) for part in piece.split(1)]
    assert min(r[0] for r in ranges) <= 0.1
    assert max(r[1] for r in ranges) >= 0.7
    assert ranges[0][1] >= ranges[1][0] or ranges[1][1] >= ranges[0][0]


def test_a_point_has_no_variable() -> None:
    piece = point(np.array([0.1, 0.2]), [3.0])
    states, unknowns, slack = piece.polynomials(np.zeros(0, np.int64), 1)
    assert states[:, 0].tolist() == [0.1, 0.2]
    assert unknowns[0, 0] == 3.0
    assert not slack.any()


@pytest.mark.parametrize("lo, hi", [(0.1, 0.3), (-0.7, 0.7), (5e-324, 1e-323), (-1.7e308, 1.7e308), (0.1, 0.1)])
def test_cover_is_exact(lo: float, hi: float) -> None:
    c, r = (float(v[0]) for v in cover(np.array([lo]), np.array([hi])))
    if np.isfinite(r):
        assert F(c) - F(r) <= F(lo)
        assert F(hi) <= F(c) + F(r)
    else:
        assert hi > 1e308


def test_ellipsoids_near_singular_are_refused_or_covered() -> None:
    shape = np.array([[1.0, 1.0 - 1e-9], [1.0 - 1e-9, 1.0]])
    start = mg.Ellipsoid([0.0, 0.0], shape)
    directions = np.array([[1.0, -1.0], [1.0, 1.0]])
    try:
        top = tops(whole(start, []), directions)
    except ModegraphError:
        return
    assert (top**2 >= np.einsum("ki,ij,kj->k", directions, shape, directions) * (1 - 1e-7)).all()
