"""Ellipsoids with a centre and a shape matrix."""

from __future__ import annotations

from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from modegraph.errors import ModegraphError
from modegraph.model.sets import exact
from modegraph.model.sets.ball import points_in_unit_ball, unit_circle
from modegraph.model.sets.base import Floats, Set, table, vector


class Ellipsoid(Set):
    """{x : (x - c)' shape^-1 (x - c) <= 1}.

    Parameters
    ----------
    c : (dim,) array or scalar
    shape : (dim, dim) array
        Symmetric (exactly) and positive definite; the squares of the semi-axes on its diagonal when it
        is diagonal.
    """

    _fields = ("c", "shape")

    def __init__(self, c: ArrayLike, shape: ArrayLike) -> None:
        self.c = vector(c, "Ellipsoid: c")
        self.shape = table(shape, "Ellipsoid: shape")
        n = self.c.size
        if self.shape.shape != (n, n):
            raise ModegraphError(
                f"Ellipsoid: c has {n} coordinates, so shape must be {n} x {n}; got {self.shape.shape}"
            )
        uneven = np.argwhere(self.shape != self.shape.T)
        if len(uneven):
            i, j = (int(k) for k in uneven[0])
            raise ModegraphError(
                f"Ellipsoid: shape is not symmetric: shape[{i}, {j}] = {self.shape[i, j]!r} but "
                f"shape[{j}, {i}] = {self.shape[j, i]!r}; pass (shape + shape.T) / 2"
            )
        if not exact.is_positive_definite(exact.matrix(self.shape)):
            raise ModegraphError(
                "Ellipsoid: shape is singular or not positive definite, so the set has no inside in some "
                "direction; give every semi-axis a positive length (or use a Box with lo = hi)"
            )

    @property
    def dim(self) -> int:
        return self.c.size

    @property
    def center(self) -> Floats:
        return self.c

    @cached_property
    def inverse_shape(self) -> exact.Matrix:
        """shape^-1 as exact rationals."""
        inverse = exact.inverse(exact.matrix(self.shape))
        assert inverse is not None  # positive definite
        return inverse

    def bounding_box(self) -> tuple[Floats, Floats]:
        center = exact.fractions(self.c)
        half = [exact.sqrt_up(Fraction(float(value))) for value in np.diag(self.shape)]
        return (
            np.array([exact.round_down(c - h) for c, h in zip(center, half, strict=True)]),
            np.array([exact.round_up(c + h) for c, h in zip(center, half, strict=True)]),
        )

    def support_at_most(self, direction: exact.Row, bound: Fraction) -> bool:
        room = bound - exact.dot(direction, exact.fractions(self.c))
        return room >= 0 and exact.quadratic_form(exact.matrix(self.shape), direction) <= room**2

    def _contains(self, x: Floats) -> bool:
        offset = [a - b for a, b in zip(exact.fractions(x), exact.fractions(self.c), strict=True)]
        return exact.quadratic_form(self.inverse_shape, offset) <= 1

    def _draw(self, n: int, rng: np.random.Generator) -> Floats:
        return self.c + points_in_unit_ball(n, self.dim, rng) @ _root(self.shape).T

    def outline(self, dims: tuple[int, int]) -> Floats:
        k = list(dims)
        return self.c[k] + unit_circle() @ _root(self.shape[np.ix_(k, k)]).T


def _root(shape: Floats) -> Floats:
    """A float R with R R' = shape, also where rounding spoils a Cholesky factorisation."""
    values, vectors = np.linalg.eigh(shape)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))
