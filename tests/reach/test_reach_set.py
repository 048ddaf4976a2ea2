"""What a reach set says of itself holds for every point of it."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import modegraph as mg
from modegraph.enclosure.monomials import monomials
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.reach_set import ReachSet, ReachSets
from modegraph.reach.start.piece import Piece, whole

TABLE = monomials((1, 1), 3)
STARTS: dict[str, Any] = {"box": mg.Box([0, 0], [1, 1]), "ball": mg.Ball([0, 0], 1.0)}
BOUNDS = {name: PolynomialBounds(whole(start, []), TABLE, TABLE.size) for name, start in STARTS.items()}
N, Q = 3, 3

seeds = st.integers(0, 10_000)
starts = st.sampled_from([*STARTS])
scales = st.sampled_from([1e-150, 1e-8, 1.0, 1e150])
boxes = st.sampled_from([0.0, 0.3])


def reach_set(seed: int, start: str, scale: float, box: float) -> ReachSet:
    rng = np.random.default_rng(seed)
    p, G = rng.normal(size=(N, TABLE.size)) * scale, rng.normal(size=(int(rng.integers(0, 4)), N, Q)) * 0.2 * scale
    return ReachSet.of(BOUNDS[start], p, G).plus_box(rng.uniform(0.0, box, N) * scale)


def starts_of(piece: Piece, rng: np.random.Generator, count: int = 60) -> np.ndarray:
    """Scaled variables of starts of a piece, many of them extreme."""
    eta = rng.choice([-1.0, 1.0, 0.3], (count, piece.variables))
    if piece.chart.round:
        xi = piece.middle + piece.radius * eta
        eta = eta[np.linalg.norm(xi, axis=1) <= 1.0] if piece.depth else eta / np.sqrt(2.0)
    return eta


def powers_of(eta: np.ndarray) -> np.ndarray:
    return np.asarray(np.prod(eta[:, None, :] ** TABLE.exponents, axis=2))


def points(reach: ReachSet, rng: np.random.Generator) -> np.ndarray:
    """Points of it; each coefficient of the generators moves on its own."""
    powers = powers_of(starts_of(reach.piece, rng))
    zeta = rng.choice([-1.0, 1.0], (len(powers), *reach.G.shape[::2]))
    e = rng.choice([-1.0, 1.0], (len(powers), reach.dim)) * reach.box
    return np.asarray(powers @ reach.p.T + np.einsum("sgk,gik->si", zeta, reach.G) + e)


@settings(deadline=None)
@given(seeds, starts, scales, boxes)
def test_ranges_and_support_hold_all_points(seed: int, start: str, scale: float, box: float) -> None:
    reach, rng = reach_set(seed, start, scale, box), np.random.default_rng(seed + 1)
    x = points(reach, rng)
    room = 1e-13 * np.abs(reach.p).sum()
    lo, hi = reach.ranges()
    assert (lo - room <= x).all()
    assert (x <= hi + room).all()
    directions = rng.normal(size=(8, N))
    assert (x @ directions.T <= reach.support(directions) + 10 * room).all()


def test_support_is_met() -> None:
    """Of a linear set over a box it is what corners reach, and no more."""
    reach = reach_set(5, "box", 1.0, 0.3)
    p = reach.p.copy()
    p[:, TABLE.exponents.sum(axis=1) > 1] = 0.0
    reach = ReachSet(reach.bounds, p, reach.G, reach.box)
    directions = np.random.default_rng(6).normal(size=(20, N))
    linear = reach.bounds.linear_part(p)
    most = directions @ p[:, 0] + np.abs(directions @ linear).sum(axis=1)
    most += np.abs(np.einsum("hi,gik->hgk", directions, reach.G)).sum(axis=(1, 2)) + np.abs(directions) @ reach.box
    assert np.allclose(reach.support(directions), most, rtol=1e-12)
    lo, hi = reach.ranges()
    assert np.allclose(reach.support(np.eye(N)), hi)
    assert np.allclose(reach.support(-np.eye(N)), -lo)


@pytest.mark.parametrize("start", [*STARTS])
def test_rounding_is_in_the_support(start: str) -> None:
    """Against exact arithmetic, where the boundary is met to the last digit."""
    rng = np.random.default_rng(2)
    for _ in range(40):
        p = np.zeros((N, TABLE.size))
        p[:, 0] = rng.normal(size=N)
        G, box, d = rng.normal(size=(2, N, 1)), rng.uniform(size=N), rng.normal(size=N)
        reach = ReachSet(BOUNDS[start], p, G, box)
        exact = [Fraction(float(v)) for v in d]
        total = sum(a * Fraction(float(v)) for a, v in zip(exact, p[:, 0], strict=True))
        total += sum(abs(sum(a * Fraction(float(v)) for a, v in zip(exact, g[:, 0], strict=True))) for g in G)
        total += sum(abs(a) * Fraction(float(v)) for a, v in zip(exact, box, strict=True))
        assert total <= Fraction(float(reach.support(d[None])[0]))


@given(seeds, starts, st.permutations(range(N)))
def test_projections_are_exact(seed: int, start: str, order: list[int]) -> None:
    reach = reach_set(seed, start, 1.0, 0.3)
    lo, hi = reach.ranges()
    some = reach.select(order[:2])
    assert some.dim == 2
    assert (np.stack(some.ranges()) == np.stack([lo, hi])[:, order[:2]]).all()
    assert (np.stack(reach.project(2).ranges()) == np.stack([lo, hi])[:, :2]).all()


def test_boxes_add_up() -> None:
    reach = reach_set(1, "box", 1.0, 0.0)
    assert not reach.box.any()
    a, b = np.array([0.1, 0.0, 0.7]), np.array([0.2, 0.3, 1e-20])
    once = reach.plus_box(a)
    assert (once.box == a).all()
    twice = once.plus_box(b)
    assert all(Fraction(x) + Fraction(y) <= Fraction(z) for x, y, z in zip(a, b, twice.box, strict=True))
    assert np.allclose(twice.spread, reach.spread + a + b)


@settings(deadline=None)
@given(seeds, starts, st.lists(st.tuples(st.integers(0, 1), st.integers(0, 1)), min_size=1, max_size=4))
def test_a_restriction_holds_the_points_of_its_starts(seed: int, start: str, cuts: list[tuple[int, int]]) -> None:
    """Point by point: the same start, in the variables of the part, is where it was."""
    sets = ReachSets.one(reach_set(seed, start, 1.0, 0.3))
    part, rng = sets, np.random.default_rng(seed)
    for variable, side in cuts:
        halves = part.piece.split(variable)
        if len(halves) < 2:
            return
        part = part.restricted(halves[side], TABLE)
    child, parent = part.piece, sets.piece
    eta = starts_of(child, rng)
    before = (child.middle + child.radius * eta - parent.middle) / parent.radius
    apart = np.abs(powers_of(before) @ sets[0].p.T - powers_of(eta) @ part[0].p.T)
    assert (apart <= part[0].box - sets[0].box + 1e-13).all()
    assert part.generators is sets.generators


def test_rounding_of_a_restriction_is_in_its_box() -> None:
    """Against exact arithmetic: the centre of a part that a rounded map reaches."""
    sets = ReachSets.one(reach_set(3, "box", 1.0, 0.0))
    part = sets.restricted(sets.piece.split(0)[1].split(1)[0].split(0)[0], TABLE)
    middle = [Fraction(float(v)) for v in part.piece.middle]
    exponents = TABLE.exponents.tolist()
    for row, found, room in zip(sets[0].p, part[0].p, part[0].box, strict=True):
        there = sum(
            Fraction(float(c)) * middle[0] ** e[0] * middle[1] ** e[1] for c, e in zip(row, exponents, strict=True)
        )
        assert room > 0.0
        assert abs(there - Fraction(float(found[0]))) <= Fraction(float(room))


def test_many_sets_are_what_each_of_them_is() -> None:
    each = [reach_set(seed, "ball", 1.0, 0.3) for seed in range(5)]
    sets = ReachSets.of(BOUNDS["ball"], each, N)
    assert len(sets) == 5
    assert all(
        (sets[k].p == s.p).all() and sets[k].G is s.G and (sets[k].box == s.box).all() for k, s in enumerate(each)
    )
    assert (sets.spread == [s.spread for s in each]).all()
    assert (sets[1:3].box == [s.box for s in each[1:3]]).all()
    assert [G is each[k].G for k, G in zip((4, 0), sets[[4, 0]].generators, strict=True)] == [True, True]
    assert sets.project(2).dim == 2
    assert (sets.project(2)[3].p == each[3].project(2).p).all()
    plain = sets.without_boxes
    assert not plain.box.any()
    assert np.allclose(plain.spread, sets.spread)
    assert np.allclose(sets.polynomials.spread, sets.box)


def test_there_may_be_no_sets() -> None:
    none = ReachSets.of(BOUNDS["box"], [], N)
    assert len(none) == 0
    assert none.project(2).dim == 2
    assert none.spread.shape == (0, N)
    assert none.without_boxes is none


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_not_finite_is_known(bad: float) -> None:
    reach = reach_set(2, "box", 1.0, 0.3)
    assert reach.is_finite
    broken = reach.p.copy()
    broken[1, 2] = bad
    several = [reach, ReachSet.of(reach.bounds, broken), reach.plus_box(np.array([0.0, bad, 0.0]))]
    assert [s.is_finite for s in several] == [True, False, False]
    assert ReachSets.of(reach.bounds, several, N).are_finite.tolist() == [True, False, False]
