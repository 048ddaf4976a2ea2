"""Euclidean balls in all coordinates."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from modegraph.errors import ModegraphError
from modegraph.model.sets import exact
from modegraph.model.sets.base import Floats, Set, vector


class Ball(Set):
    """{x : |x - c| <= radius} in the Euclidean norm over all coordinates.

    Parameters
    ----------
    c : (dim,) array or scalar
    radius : float
        Finite and >= 0; 0 is the single point c.
    """

    _fields = ("c", "radius")

    def __init__(self, c: ArrayLike, radius: float) -> None:
        self.c = vector(c, "Ball: c")
        size = vector(radius, "Ball: radius")
        if size.size != 1:
            raise ModegraphError(
                f"Ball: radius must be one number, got {size.size}; for one per coordinate use Ellipsoid or Box"
            )
        self.radius = float(size[0])
        if self.radius < 0:
            raise ModegraphError(f"Ball: radius = {self.radius} is negative; it must be >= 0")

    @property
    def dim(self) -> int:
        return self.c.size

    @property
    def center(self) -> Floats:
        return self.c

    def bounding_box(self) -> tuple[Floats, Floats]:
        radius = Fraction(self.radius)
        center = exact.fractions(self.c)
        return (
            np.array([exact.round_down(value - radius) for value in center]),
            np.array([exact.round_up(value + radius) for value in center]),
        )

    def support_at_most(self, direction: exact.Row, bound: Fraction) -> bool:
        room = bound - exact.dot(direction, exact.fractions(self.c))
        return room >= 0 and Fraction(self.radius) ** 2 * exact.dot(direction, direction) <= room**2

    def _contains(self, x: Floats) -> bool:
        offset = [a - b for a, b in zip(exact.fractions(x), exact.fractions(self.c), strict=True)]
        return exact.dot(offset, offset) <= Fraction(self.radius) ** 2

    def _draw(self, n: int, rng: np.random.Generator) -> Floats:
        return self.c + self.radius * points_in_unit_ball(n, self.dim, rng)

    def outline(self, dims: tuple[int, int]) -> Floats:
        return self.c[list(dims)] + self.radius * unit_circle()


def points_in_unit_ball(n: int, dim: int, rng: np.random.Generator) -> Floats:
    """n points, (n, dim), uniform in the unit ball."""
    direction = rng.standard_normal((n, dim))
    length = np.linalg.norm(direction, axis=1, keepdims=True)
    return direction / np.where(length > 0, length, 1.0) * rng.random((n, 1)) ** (1.0 / dim)


def unit_circle(count: int = 96) -> Floats:
    """``count`` points, (count, 2), on the unit circle, for drawing."""
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    return np.column_stack([np.cos(angle), np.sin(angle)])
