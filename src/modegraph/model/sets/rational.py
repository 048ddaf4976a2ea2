"""Sets whose numbers are rational, and whether one is inside another, exactly.

A start set S(p) written as a formula has such numbers for a double p: they need not be doubles themselves.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from modegraph.model.sets import exact
from modegraph.model.sets.base import Face, Set
from modegraph.model.sets.box import Box
from modegraph.model.sets.ellipsoid import Ellipsoid
from modegraph.model.sets.inclusion import generators_in_quadric, in_quadric, quadric_in_quadric
from modegraph.model.sets.zonotope import Zonotope

MOST_GENERATORS = 12
"""Of a set whose corners are all looked at."""


@dataclass(frozen=True)
class RationalSet:
    """{centre + sum z_k generator_k : |z_k| <= 1}, a ball, or centre + an ellipsoid about the origin.

    Attributes
    ----------
    generators : list of rows
        One generator a row; none for a ball or an ellipsoid.
    radius : Fraction or None
        Of a ball.
    """

    kind: type[Set]
    centre: exact.Row
    generators: exact.Matrix
    radius: Fraction | None = None
    ellipsoid: Ellipsoid | None = None

    @property
    def dim(self) -> int:
        return len(self.centre)

    def support_at_most(self, direction: exact.Row, bound: Fraction) -> bool:
        """Whether direction'x <= bound for every point x of the set."""
        room = bound - exact.dot(direction, self.centre)
        if self.radius is not None:
            return room >= 0 and self.radius**2 * exact.dot(direction, direction) <= room**2
        if self.ellipsoid is not None:
            return self.ellipsoid.support_at_most(direction, room)
        return sum((abs(exact.dot(direction, g)) for g in self.generators), Fraction(0)) <= room

    def faces(self) -> list[Face] | None:
        """(direction, bound) of all faces; None of a round set, and of a zonotope without a list of them."""
        axes = exact.identity(self.dim)
        if self.kind is Box or self.radius == 0:
            # A box has one generator along each axis, in their order.
            half = [g[k] for k, g in enumerate(self.generators)] if self.kind is Box else [Fraction(0)] * self.dim
            sides = list(zip(axes, self.centre, half, strict=True))
            return [(a, c + r) for a, c, r in sides] + [([-v for v in a], r - c) for a, c, r in sides]
        if self.kind is not Zonotope:
            return None
        columns = [[float(v) for v in row] for row in self.generators]
        if any(Fraction(v) != w for row, g in zip(columns, self.generators, strict=True)
               for v, w in zip(row, g, strict=True)):  # fmt: skip
            return None
        about = Zonotope(np.zeros(self.dim), np.array(columns).reshape(-1, self.dim).T).faces()
        return None if about is None else [(a, b + exact.dot(a, self.centre)) for a, b in about]

    def weight(self) -> exact.Matrix | None:
        """W of a round set {(x - centre)' W (x - centre) <= 1}."""
        if self.ellipsoid is not None:
            return self.ellipsoid.inverse_shape
        return exact.identity(self.dim, 1 / self.radius**2) if self.radius else None

    def in_quadric(self, centre: exact.Row, weight: exact.Matrix) -> bool:
        """Whether the set lies in {(x - centre)' weight (x - centre) <= 1}; True is a proof."""
        offset = _minus(self.centre, centre)
        if self.radius == 0:
            return exact.quadratic_form(weight, offset) <= 1
        if self.radius is not None:
            own = exact.identity(self.dim, 1 / self.radius**2)
            return quadric_in_quadric(offset, own, float(self.radius) ** 2 * np.eye(self.dim), weight)
        if self.ellipsoid is not None:
            return quadric_in_quadric(offset, self.ellipsoid.inverse_shape, self.ellipsoid.shape, weight)
        if generators_in_quadric(self.centre, self.generators, centre, weight):
            return True
        columns = [g for g in self.generators if any(g)]
        return len(columns) <= MOST_GENERATORS and all(
            exact.quadratic_form(weight, _corner(offset, columns, signs)) <= 1
            for signs in itertools.product((1, -1), repeat=len(columns))
        )


def rational_subset(inner: Set | RationalSet, outer: RationalSet | Set) -> bool:
    """Whether every point of ``inner`` lies in ``outer``; as `is_subset`, True is a proof."""
    faces = outer.faces()
    if faces is not None:
        return all(inner.support_at_most(direction, bound) for direction, bound in faces)
    if not isinstance(outer, RationalSet):
        return False
    weight = outer.weight()
    if weight is None:
        return False
    if not isinstance(inner, RationalSet):
        return in_quadric(inner, outer.centre, weight)
    if inner.radius is not None and outer.radius is not None:
        offset, room = _minus(inner.centre, outer.centre), outer.radius - inner.radius
        return room >= 0 and exact.dot(offset, offset) <= room**2
    return inner.in_quadric(outer.centre, weight)


def _minus(a: exact.Row, b: exact.Row) -> exact.Row:
    return [x - y for x, y in zip(a, b, strict=True)]


def _corner(offset: exact.Row, columns: exact.Matrix, signs: tuple[int, ...]) -> exact.Row:
    return [
        value + sum((s * g[k] for s, g in zip(signs, columns, strict=True)), Fraction(0))
        for k, value in enumerate(offset)
    ]
