"""Zonotopes: a centre plus a sum of segments."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from modegraph.errors import ModegraphError
from modegraph.model.sets import exact
from modegraph.model.sets.base import Face, Floats, Set, table, vector
from modegraph.model.sets.linear_program import Outcome, maximise

_MOST_VERTICES = 4096
_MOST_FACES = 2000


class Zonotope(Set):
    """{c + generators @ z : |z_k| <= 1}.

    Parameters
    ----------
    c : (dim,) array or scalar
    generators : (dim, g) array
        One generator a column; g = 0 is the single point c. A vector is one generator.
    """

    _fields = ("c", "generators")

    def __init__(self, c: ArrayLike, generators: ArrayLike) -> None:
        self.c = vector(c, "Zonotope: c")
        given = np.asarray(generators)
        self.generators = table(given[:, None] if given.ndim == 1 else given, "Zonotope: generators")
        if self.generators.shape[0] != self.c.size:
            raise ModegraphError(
                f"Zonotope: c has {self.c.size} coordinates, so generators must have {self.c.size} rows "
                f"(one generator a column); got shape {self.generators.shape}"
            )

    @property
    def dim(self) -> int:
        return self.c.size

    @property
    def center(self) -> Floats:
        return self.c

    @cached_property
    def _columns(self) -> exact.Matrix:
        """The nonzero generators, one a row."""
        return [row for row in exact.matrix(self.generators.T) if any(row)]

    @cached_property
    def _gram_inverse(self) -> exact.Matrix | None:
        """(G G')^-1, which gives least-norm coordinates; None for a flat zonotope."""
        columns = self._columns
        rows = [list(row) for row in zip(*columns, strict=True)] if columns else []
        return exact.inverse([[exact.dot(a, b) for b in rows] for a in rows]) if rows else None

    def coordinates(self, offset: exact.Row) -> exact.Row | None:
        """The z of least norm with generators z = offset, for the nonzero generators; None when flat."""
        if self._gram_inverse is None:
            return None
        direction = exact.times(self._gram_inverse, offset)
        return [exact.dot(direction, g) for g in self._columns]

    def bounding_box(self) -> tuple[Floats, Floats]:
        center = exact.fractions(self.c)
        half = [sum((abs(g[k]) for g in self._columns), Fraction(0)) for k in range(self.dim)]
        return (
            np.array([exact.round_down(c - h) for c, h in zip(center, half, strict=True)]),
            np.array([exact.round_up(c + h) for c, h in zip(center, half, strict=True)]),
        )

    def faces(self) -> list[Face] | None:
        return self._faces

    @cached_property
    def _faces(self) -> list[Face] | None:
        """Every facet normal of a solid zonotope is orthogonal to n - 1 of its generators."""
        n, columns = self.dim, self._columns
        if len(columns) < n or math.comb(len(columns), n - 1) > _MOST_FACES:
            return None
        center = exact.fractions(self.c)
        result: list[Face] = []
        flat = True
        for chosen in itertools.combinations(columns, n - 1):
            normal = exact.normal_to(list(chosen))
            if normal is None:
                continue
            reach = sum((abs(exact.dot(normal, g)) for g in columns), Fraction(0))
            flat = flat and reach == 0
            middle = exact.dot(normal, center)
            result += [(normal, middle + reach), ([-value for value in normal], reach - middle)]
        return None if flat else result

    def vertices(self) -> Iterator[exact.Row] | None:
        columns = self._columns
        if 2 ** len(columns) > _MOST_VERTICES:
            return None
        return self._corners(exact.fractions(self.c), columns)

    @staticmethod
    def _corners(center: exact.Row, columns: exact.Matrix) -> Iterator[exact.Row]:
        for signs in itertools.product((1, -1), repeat=len(columns)):
            yield [
                value + sum((s * g[k] for s, g in zip(signs, columns, strict=True)), Fraction(0))
                for k, value in enumerate(center)
            ]

    def support_at_most(self, direction: exact.Row, bound: Fraction) -> bool:
        reach = sum((abs(exact.dot(direction, g)) for g in self._columns), Fraction(0))
        return exact.dot(direction, exact.fractions(self.c)) + reach <= bound

    def _contains(self, x: Floats) -> bool:
        offset = [a - b for a, b in zip(exact.fractions(x), exact.fractions(self.c), strict=True)]
        return self.contains_offset(offset)

    def contains_offset(self, offset: exact.Row) -> bool:
        """Whether c + offset lies in the set, exactly.

        Outside means that a direction a has a'offset > sum |a'g|. The direction and the coordinates of
        least norm decide most cases (a parallelotope has no others); an exact linear program the rest.
        """
        if not any(offset):
            return True
        columns = self._columns
        count = len(columns)
        if not count:
            return False
        coordinates = self.coordinates(offset)
        if coordinates is not None:
            if all(abs(value) <= 1 for value in coordinates):
                return True
            if count == self.dim or exact.dot(coordinates, coordinates) > sum(map(abs, coordinates)):
                return False
        slack = exact.identity(count, -1)
        faces = [[*g, *s] for g, s in zip(columns, slack, strict=True)]
        faces += [[*(-value for value in g), *s] for g, s in zip(columns, slack, strict=True)]
        objective = [*offset, *[Fraction(-1)] * count]
        return maximise(objective, faces, [Fraction(0)] * (2 * count)).outcome is Outcome.OPTIMAL

    def _draw(self, n: int, rng: np.random.Generator) -> Floats:
        weights = rng.uniform(-1.0, 1.0, (n, self.generators.shape[1]))
        return self.c + weights @ self.generators.T

    def outline(self, dims: tuple[int, int]) -> Floats:
        flat = self.generators[list(dims)].T
        flat = flat[np.any(flat != 0.0, axis=1)]
        flat = np.where((flat[:, 1] < 0) | ((flat[:, 1] == 0) & (flat[:, 0] < 0)), -1.0, 1.0)[:, None] * flat
        flat = flat[np.argsort(np.arctan2(flat[:, 1], flat[:, 0]))]
        walk = np.vstack([np.zeros((1, 2)), np.cumsum(np.vstack([2 * flat, -2 * flat]), axis=0)])
        return self.c[list(dims)] - flat.sum(axis=0) + walk[: max(1, 2 * len(flat))]
