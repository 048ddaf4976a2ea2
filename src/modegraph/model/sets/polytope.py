"""Polytopes given by faces; they may be unbounded."""

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
from modegraph.model.sets.ball import unit_circle
from modegraph.model.sets.base import Face, Floats, Set, table, vector
from modegraph.model.sets.linear_program import Optimum, Outcome, maximise

_MOST_CORNERS = 2000


class Polytope(Set):
    """{x : A x <= b}; bounded or not. As a start set it must be bounded.

    Parameters
    ----------
    A : (faces, dim) array
        One face a row; a vector is one face.
    b : (faces,) array or scalar
    """

    _fields = ("A", "b")

    def __init__(self, A: ArrayLike, b: ArrayLike) -> None:
        given = np.asarray(A)
        self.A = table(given[None, :] if given.ndim == 1 else given, "Polytope: A")
        self.b = vector(b, "Polytope: b")
        if self.A.shape[1] == 0 or self.A.shape[0] != self.b.size:
            raise ModegraphError(
                f"Polytope: A has shape {self.A.shape} and b has {self.b.size} entries; "
                "give one row of A and one entry of b for each face"
            )

    @property
    def dim(self) -> int:
        return int(self.A.shape[1])

    @property
    def center(self) -> Floats:
        """The Chebyshev centre (rounded); see :attr:`chebyshev`."""
        return self.chebyshev[0]

    @cached_property
    def chebyshev(self) -> tuple[Floats, float]:
        """Centre, (dim,), and radius of a largest inscribed ball, rounded.

        The radius of an unbounded polytope is capped at the largest distance of a face from the origin
        (at least 1), so that a centre exists.
        """
        self._require_points("Chebyshev centre")
        rows, bounds = self._rational
        norms = [Fraction(float(np.linalg.norm(row))) for row in self.A]
        cap = max([Fraction(1), *(abs(b) / norm for b, norm in zip(bounds, norms, strict=True) if norm)])
        faces = [[*row, norm] for row, norm in zip(rows, norms, strict=True)]
        faces.append([*[Fraction(0)] * self.dim, Fraction(1)])
        objective = [*[Fraction(0)] * self.dim, Fraction(1)]
        best = maximise(objective, faces, [*bounds, cap])
        center = np.array([float(value) for value in best.point[:-1]])
        center.flags.writeable = False
        return center, max(0.0, float(best.value))

    def is_empty(self) -> bool:
        return self._empty

    @cached_property
    def _empty(self) -> bool:
        return self._maximum([Fraction(0)] * self.dim).outcome is Outcome.EMPTY

    def is_bounded(self) -> bool:
        return self._empty or self._extents is not None

    @cached_property
    def _extents(self) -> list[tuple[Fraction, Fraction]] | None:
        """Exact (min, max) of every coordinate; None when one of them is unbounded."""
        extents = []
        for axis in exact.identity(self.dim):
            high = self._maximum(axis)
            low = self._maximum([-value for value in axis])
            if Outcome.UNBOUNDED in (high.outcome, low.outcome):
                return None
            extents.append((-low.value, high.value))
        return extents

    def bounding_box(self) -> tuple[Floats, Floats]:
        self._require_points("bounding box")
        if self._extents is None:
            raise ModegraphError(
                "Polytope: the set is unbounded, so it has no bounding box; add faces that bound every coordinate"
            )
        return (
            np.array([exact.round_down(low) for low, _ in self._extents]),
            np.array([exact.round_up(high) for _, high in self._extents]),
        )

    def faces(self) -> list[Face]:
        return list(zip(*self._rational, strict=True))

    def vertices(self) -> Iterator[exact.Row] | None:
        if math.comb(len(self.b), self.dim) > _MOST_CORNERS or not self.is_bounded():
            return None
        return self._corners()

    def _corners(self) -> Iterator[exact.Row]:
        for chosen in itertools.combinations(self.faces(), self.dim):
            corner = exact.solve([row for row, _ in chosen], [[bound] for _, bound in chosen])
            if corner is not None:
                point = [value for (value,) in corner]
                if all(exact.dot(row, point) <= bound for row, bound in self.faces()):
                    yield point

    def support_at_most(self, direction: exact.Row, bound: Fraction) -> bool:
        if any(bound >= own and row == direction for row, own in self.faces()):
            return True
        if self._empty:
            return True
        best = self._maximum(direction)
        return best.outcome is Outcome.OPTIMAL and best.value <= bound

    @cached_property
    def _rational(self) -> tuple[exact.Matrix, exact.Row]:
        return exact.matrix(self.A), exact.fractions(self.b)

    def _maximum(self, direction: exact.Row) -> Optimum:
        return maximise(direction, *self._rational)

    def _require_points(self, what: str) -> None:
        if self._empty:
            raise ModegraphError(f"Polytope: the set is empty, so it has no {what}; its faces contradict each other")

    def _contains(self, x: Floats) -> bool:
        point = exact.fractions(x)
        return all(exact.dot(row, point) <= bound for row, bound in self.faces())

    def _draw(self, n: int, rng: np.random.Generator) -> Floats:
        """Hit and run from the centre: uniform in the limit, 4 dim steps between points."""
        self.bounding_box()
        points = np.empty((n, self.dim))
        here = np.array(self.center)
        for row in points:
            for _ in range(4 * self.dim):
                here = self._random_step(here, rng)
            row[:] = here
        return points

    def _random_step(self, here: Floats, rng: np.random.Generator) -> Floats:
        direction = rng.standard_normal(self.dim)
        rate = self.A @ direction
        room = np.maximum(self.b - self.A @ here, 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = room / rate
        forward = float(np.min(ratio[rate > 0], initial=np.inf))
        backward = float(np.max(ratio[rate < 0], initial=-np.inf))
        if not (np.isfinite(forward) and np.isfinite(backward)):
            return here
        return np.asarray(here + rng.uniform(backward, forward) * direction)

    def outline(self, dims: tuple[int, int]) -> Floats:
        self.bounding_box()
        corners: list[tuple[float, float]] = []
        for along in unit_circle(64):
            direction = [Fraction(0)] * self.dim
            for k, value in zip(dims, along, strict=True):
                direction[k] = Fraction(float(value))
            point = self._maximum(direction).point
            corner = (float(point[dims[0]]), float(point[dims[1]]))
            if not corners or corner != corners[-1]:
                corners.append(corner)
        return np.array(corners)
