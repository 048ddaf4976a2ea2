"""Pairs of references against the inequalities written out in exact fractions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from modegraph.enclosure.arguments import Instants, Rows, Targets
from modegraph.enclosure.pairs import affine_centres, first_crossings, part_gauges


@dataclass
class Table:
    """Random parts, flows and instants for references (k,) of the source in [-1, 1]^k."""

    k: int
    n: int
    is_round: bool
    seed: int

    def __post_init__(self) -> None:
        rng = self.rng = np.random.default_rng(self.seed)
        f = self.n if self.is_round else 2 * self.n
        self.rows = rng.normal(size=(f, self.n))
        self.slack = np.abs(rng.normal(size=f)) * 1e-11
        flows = [2, 1, 2]
        self.part_flows = np.concatenate([[0], np.cumsum(flows)])
        F = sum(flows)
        # The last part has starts for some references only.
        self.lo, self.hi = -np.ones((3, self.k)), np.ones((3, self.k))
        self.lo[2] = 0.0
        self.middle, self.scale = rng.normal(size=(F, self.k)) * 0.1, rng.uniform(1.0, 2.0, (F, self.k))
        self.exponents = np.array([[0] * self.k, [1] + [0] * (self.k - 1), [2] + [0] * (self.k - 1)] * F)
        self.flow_terms = 3 * np.arange(F + 1)
        self.flow_instants = 4 * np.arange(F + 1)
        self.flow_coefficients = 4 * 3 * f * np.arange(F + 1)
        self.coefficients = rng.normal(size=(4 * F, f, 3)) * 0.3
        self.farthest = np.full(F, 10.0)
        self.size = np.abs(self.coefficients).sum(axis=2)
        self.spread = rng.uniform(0.0, 0.3, (4 * F, 1 if self.is_round else f))
        self.limit = rng.uniform(0.5, 1.0, 1 if self.is_round else f)
        # Half of all pairs are inside.
        source, target = rng.uniform(-1.0, 1.0, (200, self.k)), rng.uniform(-1.0, 1.0, (200, self.n))
        found = first_crossings(source, target, self.classes(), *self.arguments(target), False)
        self.limit *= np.median(found[0])

    def arguments(self, target: np.ndarray) -> tuple[Targets, Rows, Instants]:
        there = affine_centres(target, np.zeros(self.n), np.eye(self.n), np.zeros(self.n), self.limit)
        instants = Instants(
            self.part_flows, self.lo, self.hi, self.middle, self.scale, self.flow_terms, self.exponents,
            self.flow_instants, self.flow_coefficients, self.coefficients.ravel(), self.farthest, self.size,
            self.spread,
        )  # fmt: skip
        return Targets(*there), Rows(self.rows, self.slack, self.is_round, 1.0), instants

    def classes(self) -> Any:
        return (-np.ones((1, self.k)), np.ones((1, self.k))), (-np.ones((1, self.n)), np.ones((1, self.n)))

    def exact(self, part: int, p: np.ndarray, centre: np.ndarray) -> list[Fraction]:
        """Gauges of one part at its instants, in exact arithmetic (a square root to 2**-80)."""
        out = []
        for flow in range(self.part_flows[part], self.part_flows[part + 1]):
            eta = (Fraction(p[0]) - Fraction(self.middle[flow, 0])) / Fraction(self.scale[flow, 0])
            for t in range(4 * flow, 4 * flow + 4):
                y = []
                for f, row in enumerate(self.rows):
                    a, b, c = (Fraction(x) for x in self.coefficients[t, f])
                    y.append(
                        a
                        + b * eta
                        + c * eta**2
                        - sum(Fraction(r) * Fraction(x) for r, x in zip(row, centre, strict=True))
                    )
                if self.is_round:
                    square = sum((v * v for v in y), Fraction(0))
                    root = Fraction(math.isqrt(int(square * 2**160)), 2**80)
                    out.append((root + Fraction(self.spread[t, 0])) / Fraction(self.limit[0]))
                else:
                    out.append(
                        max(
                            (v + Fraction(s)) / Fraction(b)
                            for v, s, b in zip(y, self.spread[t], self.limit, strict=True)
                        )
                    )
        return out


@pytest.fixture(
    params=[(k, n, is_round, seed) for k, n in ((1, 1), (2, 3)) for is_round in (False, True) for seed in (1, 2)]
)
def table(request: Any) -> Table:
    return Table(*request.param)


def test_gauges_are_upper_bounds_and_sharp(table: Table) -> None:
    rng = np.random.default_rng(5)
    source, target = rng.uniform(-1.0, 1.0, (20, table.k)), rng.uniform(-1.0, 1.0, (20, table.n))
    for part in range(3):
        found = part_gauges(part, source, *table.arguments(target))
        for b in range(20):
            exact = table.exact(part, source[b], target[b])
            assert len(exact) == found.shape[1]
            for bound, true in zip(found[b], exact, strict=True):
                assert Fraction(float(bound)) >= true
                assert float(bound) <= float(true) + 1e-7


def test_a_pair_is_certified_by_an_instant_of_every_part_that_has_starts(table: Table) -> None:
    rng = np.random.default_rng(6)
    source, target = rng.uniform(-1.0, 1.0, (60, table.k)), rng.uniform(-1.0, 1.0, (60, table.n))
    gauge, instant = first_crossings(source, target, table.classes(), *table.arguments(target), False)
    certified = 0
    for b in range(60):
        parts = [part for part in range(3) if part < 2 or (source[b] >= 0.0).all()]
        exact = {part: table.exact(part, source[b], target[b]) for part in parts}
        worst = max(min(values) for values in exact.values())
        assert Fraction(float(gauge[b])) >= worst
        assert float(gauge[b]) <= float(worst) + 1e-7
        certified += gauge[b] <= 1.0
        for part in range(3):
            if part not in parts:
                assert instant[b, part] == -2
            elif gauge[b] <= 1.0:
                # The first instant that proves this part, counted over all flows.
                k = instant[b, part] - 4 * table.part_flows[part]
                assert exact[part][k] <= 1
                assert all(value > 1 - Fraction(1e-7) for value in exact[part][:k])
    assert 0 < certified < 60


def test_a_quick_look_decides_the_same(table: Table) -> None:
    rng = np.random.default_rng(7)
    source, target = rng.uniform(-1.0, 1.0, (400, table.k)), rng.uniform(-1.0, 1.0, (400, table.n))
    whole, quick = (
        first_crossings(source, target, table.classes(), *table.arguments(target), fast)[0] <= 1.0
        for fast in (False, True)
    )
    assert (whole == quick).all()
    assert whole.any()
    assert not whole.all()


def test_nothing_is_said_outside_the_classes_or_of_what_is_not_a_number(table: Table) -> None:
    source, target = np.zeros((4, table.k)), np.zeros((4, table.n))
    table.limit[:] = 1e6
    source[1, 0], target[2, -1], source[3, 0] = 1.0 + 1e-15, -1.1, np.nan
    gauge, _ = first_crossings(source, target, table.classes(), *table.arguments(target), False)
    assert gauge[0] <= 1.0
    assert np.isinf(gauge[1:]).all()
    table.coefficients[:, 0, 0] = np.nan
    for fast in (False, True):
        gauge, _ = first_crossings(source, target, table.classes(), *table.arguments(target), fast)
        assert np.isinf(gauge).all()


def test_a_face_without_room_must_be_met_exactly() -> None:
    table = Table(1, 1, False, 3)
    table.limit[:] = 0.0
    table.coefficients[:] = 0.0
    table.spread[:] = 0.0
    source, target = np.zeros((1, 1)), np.zeros((1, 1))
    assert np.isinf(part_gauges(0, source, *table.arguments(target))).all()
    table.coefficients[:, :, 0] = -1.0
    assert (part_gauges(0, source, *table.arguments(target)) == 0.0).all()
    table.limit[:] = -2.0
    assert np.isinf(part_gauges(0, source, *table.arguments(target))).all()
