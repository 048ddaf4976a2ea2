"""Exact linear programs over the rationals: no tolerance, no cycling.

``maximise`` runs the simplex method on the dual, min b'y with A'y = c and y >= 0, because models have
few dimensions and more faces. The tableau holds integers over one common denominator (Edmonds'
integer pivoting), so every division is exact and numbers stay as short as the determinants they are.
Bland's rule takes over after a while and guarantees termination.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction

_GREEDY_PIVOTS = 60


class Outcome(Enum):
    """How an exact linear program ended."""

    OPTIMAL = "optimal"
    EMPTY = "empty"
    UNBOUNDED = "unbounded"


@dataclass(frozen=True)
class Optimum:
    """Result of :func:`maximise`; ``value`` and ``point`` belong to ``OPTIMAL`` only."""

    outcome: Outcome
    value: Fraction = Fraction(0)
    point: tuple[Fraction, ...] = ()


def maximise(objective: Sequence[Fraction], faces: Sequence[Sequence[Fraction]], bounds: Sequence[Fraction]) -> Optimum:
    """Maximise objective'x over {x : faces x <= bounds}, exactly.

    Parameters
    ----------
    objective : (n,)
    faces : (m, n)
    bounds : (m,)

    Returns
    -------
    Optimum
        ``UNBOUNDED`` means "no finite maximum": where the set may be empty, ask for objective 0 first,
        which gives ``EMPTY`` or ``OPTIMAL``.
    """
    n = len(objective)
    columns = [_integers([*row, bound])[0] for row, bound in zip(faces, bounds, strict=True)]
    target, scale = _integers(list(objective))
    return _Tableau(columns, target, n).solve(scale)


def _integers(values: list[Fraction]) -> tuple[list[int], int]:
    """The values times the smallest common positive integer that clears their denominators."""
    scale = math.lcm(*(value.denominator for value in values)) if values else 1
    return [value.numerator * (scale // value.denominator) for value in values], scale


class _Tableau:
    """Rows: n equations, then the cost row, then the phase-one row. Columns: y, artificials, right side."""

    def __init__(self, columns: list[list[int]], target: list[int], n: int) -> None:
        self.n = n
        self.m = len(columns)
        self.denominator = 1
        self.signs = [-1 if value < 0 else 1 for value in target]
        self.rows: list[list[int]] = []
        for j in range(n):
            sign = self.signs[j]
            artificial = [1 if k == j else 0 for k in range(n)]
            self.rows.append([sign * column[j] for column in columns] + artificial + [sign * target[j]])
        cost = [column[n] for column in columns] + [0] * (n + 1)
        phase_one = [-sum(row[k] for row in self.rows) for k in range(self.m)] + [0] * n
        phase_one.append(-sum(row[-1] for row in self.rows))
        self.rows += [cost, phase_one]
        self.basis = [self.m + j for j in range(n)]

    def solve(self, scale: int) -> Optimum:
        self._minimise(self.n + 1)
        if self.rows[self.n + 1][-1] != 0:
            return Optimum(Outcome.UNBOUNDED)
        self._drive_out_artificials()
        if not self._minimise(self.n):
            return Optimum(Outcome.EMPTY)
        cost = self.rows[self.n]
        value = Fraction(-cost[-1], self.denominator * scale)
        point = tuple(Fraction(-sign * cost[self.m + j], self.denominator) for j, sign in enumerate(self.signs))
        return Optimum(Outcome.OPTIMAL, value, point)

    def _minimise(self, cost_row: int) -> bool:
        """Pivot until no reduced cost is negative; False when the (dual) objective has no lower bound."""
        pivots = 0
        while True:
            cost = self.rows[cost_row]
            negative = [k for k in range(self.m) if cost[k] < 0]
            if not negative:
                return True
            entering = negative[0] if pivots > _GREEDY_PIVOTS else min(negative, key=cost.__getitem__)
            leaving = self._leaving_row(entering)
            if leaving is None:
                return False
            self._pivot(leaving, entering)
            pivots += 1

    def _leaving_row(self, entering: int) -> int | None:
        best: int | None = None
        for i in range(self.n):
            entry = self.rows[i][entering]
            if entry <= 0:
                continue
            if best is None:
                best = i
                continue
            left = self.rows[i][-1] * self.rows[best][entering]
            right = self.rows[best][-1] * entry
            if left < right or (left == right and self.basis[i] < self.basis[best]):
                best = i
        return best

    def _drive_out_artificials(self) -> None:
        """After phase one basic artificials are zero; a row without other entries is redundant and stays."""
        for i in range(self.n):
            if self.basis[i] < self.m:
                continue
            entering = next((k for k in range(self.m) if self.rows[i][k]), None)
            if entering is not None:
                if self.rows[i][entering] < 0:
                    self.rows[i] = [-value for value in self.rows[i]]
                self._pivot(i, entering)

    def _pivot(self, r: int, q: int) -> None:
        pivot_row = self.rows[r]
        pivot, old = pivot_row[q], self.denominator
        for i, row in enumerate(self.rows):
            if i == r:
                continue
            factor = row[q]
            if factor:
                self.rows[i] = [(a * pivot - factor * b) // old for a, b in zip(row, pivot_row, strict=True)]
            elif pivot != old:
                self.rows[i] = [a * pivot // old for a in row]
        self.denominator = pivot
        self.basis[r] = q
