"""Targets: a gauge of at most 1 proves containment, separation proves that there is no common point."""

from __future__ import annotations

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.targets.region import Region
from modegraph.enclosure.monomials import monomials
from modegraph.model.sets import Set
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.quadric import largest_singular_value
from modegraph.reach.reach_set import ReachSet, ReachSets
from modegraph.reach.start.piece import whole

SCALES = [1e-150, 1e-3, 1.0, 1e150]


def sets(scale: float) -> dict[str, Set]:
    c = np.array([1.0, -2.0]) * scale
    return {
        "box": mg.Box(c - 0.3 * scale, c + 0.1 * scale),
        "ball": mg.Ball(c, 0.7 * scale),
        "ellipsoid": mg.Ellipsoid(c, np.array([[2.0, 1.2], [1.2, 1.0]]) * scale**2),
        "zonotope": mg.Zonotope(c, np.array([[1.0, 0.4], [0.5, -0.2]]) * scale),
        "polytope": mg.Polytope([[1, 1], [-1, 2], [0, -1]], np.array([0.5, -2.0, 4.0]) * scale),
    }


def gauge(region: Region, start: mg.Box) -> float:
    piece = whole(start, [])
    table = monomials((1,) * piece.variables, 1)
    p, _, slack = piece.polynomials(table.linear, table.size)
    G = np.zeros((2, 2, 1))
    G[[0, 1], [0, 1], 0] = slack
    return region.gauge(ReachSet.of(PolynomialBounds(piece, table, table.size), p, G))


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("kind", sets(1.0))
def test_gauge_and_separation_agree_with_exact_containment(kind: str, scale: float) -> None:
    target = sets(scale)[kind]
    region = Region(target)
    rng = np.random.default_rng(0)
    proved = apart = 0
    for size in (0.0, 1e-9, 0.05, 0.3):
        for _ in range(40):
            middle = (np.array([1.0, -2.0]) + rng.uniform(-1.5, 1.5, 2)) * scale
            box = mg.Box(middle - size * scale, middle + size * scale)
            corners = [np.array([a, b]) for a in (box.lo[0], box.hi[0]) for b in (box.lo[1], box.hi[1])]
            inside = [target.contains(x) for x in corners]
            if gauge(region, box) <= 1.0:
                assert all(inside)
                proved += 1
            if region.separated(box.lo[None], box.hi[None])[0]:
                assert not any(inside)
                assert not target.contains(middle)
                apart += 1
    assert proved >= 1
    assert apart >= 20


@pytest.mark.parametrize("scale", SCALES)
def test_the_boundary(scale: float) -> None:
    target = mg.Box(np.array([-1.0, -1.0]) * scale, np.array([1.0, 1.0]) * scale)
    region = Region(target)
    assert gauge(region, mg.Box(target.lo, np.nextafter(target.hi, np.inf))) > 1.0
    assert gauge(region, mg.Box(target.lo * 0.999, target.hi * 0.999)) <= 1.0
    assert not region.separated(target.hi[None], 2 * target.hi[None])[0]
    ball = Region(mg.Ball([0.0, 0.0], scale))
    edge = np.nextafter(scale, np.inf) * (1 + 1e-15)
    assert gauge(ball, mg.Box([edge, 0.0], [edge, 0.0])) > 1.0


@pytest.mark.parametrize("kind", sets(1.0))
def test_a_remainder_counts(kind: str) -> None:
    """A point with generators is inside where all its corners are."""
    target = sets(1.0)[kind]
    region, piece, table = Region(target), whole(mg.Box([0, 0], [1, 1]), []), monomials((1, 1), 1)
    bounds = PolynomialBounds(piece, table, table.size)
    rng = np.random.default_rng(4)
    proved = 0
    for _ in range(300):
        p = np.zeros((2, table.size))
        p[:, 0] = np.array([1.0, -2.0]) + rng.uniform(-0.3, 0.3, 2)
        G = rng.normal(size=(3, 2, 1)) * float(rng.choice([0.01, 0.1, 0.3]))
        if region.gauge(ReachSet.of(bounds, p, G)) <= 1.0:
            corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T @ G[:, :, 0]
            assert all(target.contains(p[:, 0] + corner * (1 - 1e-12)) for corner in corners)
            proved += 1
    assert proved >= 5


@pytest.mark.parametrize("kind", sets(1.0))
def test_a_box_counts(kind: str) -> None:
    """At instants, on the way between two, and in what is missing: a point with a box is where its corners are."""
    target = sets(1.0)[kind]
    region, piece, table = Region(target), whole(mg.Box([0, 0], [1, 1]), []), monomials((1, 1), 1)
    bounds = PolynomialBounds(piece, table, table.size)
    rng = np.random.default_rng(4)
    proved = 0
    for _ in range(300):
        p = np.zeros((2, table.size))
        p[:, 0] = np.array([1.0, -2.0]) + rng.uniform(-0.3, 0.3, 2)
        box = rng.uniform(size=2) * float(rng.choice([0.01, 0.1, 0.3]))
        plain = ReachSet.of(bounds, p)
        reach = plain.plus_box(box)
        corners = [p[:, 0] + box * np.array([a, b]) * (1 - 1e-12) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
        inside = all(target.contains(corner) for corner in corners)
        way = region.tube_gauges(ReachSets.of(bounds, [reach, plain, plain], 2), np.zeros((2, 2)))
        if region.gauge(reach) <= 1.0:
            assert inside
            assert region.binding(reach)[1] <= 1e-12
            proved += 1
        assert way[0] >= region.gauge(reach) * (1 - 1e-12)
        assert way[1] == pytest.approx(region.gauge(plain))
        if not inside:
            assert not way[0] <= 1.0
            assert region.binding(reach)[1] > -1e-12
    assert proved >= 5


def test_points_on_a_face_are_never_separated() -> None:
    rng = np.random.default_rng(5)
    touched = 0
    for _ in range(400):
        A = rng.normal(size=(3, 3))
        inner = rng.normal(size=3)
        target = mg.Polytope(np.vstack([A, -A]), np.concatenate([A @ inner, 5.0 + np.abs(A).sum(axis=1) * 9.0]))
        x = inner * (1.0 + rng.integers(-4, 5, 3) * 2.0**-53)
        if target.contains(x):
            assert not Region(target).separated(x[None], x[None])[0]
            touched += 1
    assert touched >= 20


def test_flat_targets_hold_themselves_at_most() -> None:
    region = Region(mg.Box([1.0, 0.0], [1.0, 2.0]))
    assert gauge(region, mg.Box([1.0 + 2**-52, 1.0], [1.0 + 2**-52, 1.0])) > 1.0
    dot = Region(mg.Ball([1.0, 0.0], 0.0))
    assert gauge(dot, mg.Box([1.0, 1e-300], [1.0, 1e-300])) > 1.0


def test_what_is_not_finite_proves_nothing() -> None:
    for target in (mg.Box([-1, -1], [1, 1]), mg.Ball([0, 0], 1.0)):
        region = Region(target)
        bad = np.array([[np.nan, 0.0], [-np.inf, 0.0]])
        assert not region.separated(bad, np.array([[np.nan, 0.0], [np.inf, 1.0]])).any()
        piece = whole(mg.Box([0, 0], [1, 1]), [])
        table = monomials((1, 1), 1)
        bounds = PolynomialBounds(piece, table, table.size)
        p = np.full((2, table.size), np.nan)
        assert not region.gauge(ReachSet.of(bounds, p)) <= 1.0


def test_largest_singular_value() -> None:
    rng = np.random.default_rng(1)
    Y = rng.normal(size=(30, 3, 4)) * 10.0 ** rng.uniform(-3, 3, (30, 1, 1))
    true = np.linalg.svd(Y, compute_uv=False)[:, 0]
    assert (true <= largest_singular_value(Y)).all()
    assert (largest_singular_value(Y) <= true * (1 + 1e-6)).all()
