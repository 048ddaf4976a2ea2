"""Sets scaled about their centres, never smaller than they should be."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from modegraph.errors import ModegraphError
from modegraph.model.sets import exact
from modegraph.model.sets.ball import Ball
from modegraph.model.sets.base import Floats, Set
from modegraph.model.sets.box import Box
from modegraph.model.sets.ellipsoid import Ellipsoid
from modegraph.model.sets.polytope import Polytope
from modegraph.model.sets.sublevel import Sublevel
from modegraph.model.sets.zonotope import Zonotope


def scaled(shape: Set, scale: float) -> Set:
    """A set of the same kind that contains {c + scale (x - c) : x in shape}, c its centre, up to rounding equal.

    Parameters
    ----------
    scale : float
        Finite and > 0.
    """
    factor = Fraction(scale)
    if isinstance(shape, Ball):
        return Ball(shape.c, exact.round_up(factor * Fraction(shape.radius)))
    if isinstance(shape, Box):
        return Box(*_about(shape, factor))
    if isinstance(shape, Ellipsoid):
        return Ellipsoid(shape.c, _covering_shape(shape, factor**2))
    if isinstance(shape, Zonotope):
        # Scale has few digits in a bisection from powers of two; where a product is rounded, a box covers it.
        wanted = [[factor * value for value in row] for row in exact.matrix(shape.generators)]
        given = np.array([[float(value) for value in row] for row in wanted]).reshape(shape.generators.shape)
        lost = [
            sum((abs(a - Fraction(float(b))) for a, b in zip(row, near, strict=True)), Fraction(0))
            for row, near in zip(wanted, given, strict=True)
        ]
        rest = np.diag([exact.round_up(value) for value in lost])[:, [k for k, value in enumerate(lost) if value]]
        return Zonotope(shape.c, np.hstack([given, rest]))
    if isinstance(shape, Polytope):
        centre = exact.fractions(shape.chebyshev[0])
        bounds = []
        for row, b in zip(exact.matrix(shape.A), exact.fractions(shape.b), strict=True):
            at = exact.dot(row, centre)
            bounds.append(exact.round_up(at + factor * (b - at)))
        return Polytope(shape.A, bounds)
    if isinstance(shape, Sublevel):
        return _scaled_sublevel(shape, factor)
    raise ModegraphError(f"a {type(shape).__name__} cannot be scaled")


def _about(shape: Box, factor: Fraction) -> tuple[Floats, Floats]:
    """Sides of the scaled box, rounded outward; the centre is the exact one."""
    lo, hi = [], []
    for a, b in zip(exact.fractions(shape.lo), exact.fractions(shape.hi), strict=True):
        middle, half = (a + b) / 2, factor * (b - a) / 2
        lo.append(exact.round_down(middle - half))
        hi.append(exact.round_up(middle + half))
    return np.array(lo), np.array(hi)


def _covering_shape(shape: Ellipsoid, square: Fraction) -> Floats:
    """Doubles S with S - square * shape positive semidefinite, checked exactly."""
    wanted = [[square * value for value in row] for row in exact.matrix(shape.shape)]
    near = np.array([[float(value) for value in row] for row in wanted])
    for growth in (0.0, *(2.0**k for k in range(-50, -10, 4))):
        given = near * (1.0 + growth)
        excess = [
            [Fraction(float(b)) - a for a, b in zip(row, other, strict=True)]
            for row, other in zip(wanted, given, strict=True)
        ]
        if exact.is_positive_semidefinite(excess):
            return np.asarray(given)
    raise ModegraphError("the ellipsoid's shape is too close to singular to be scaled; scale its coordinates")


def _scaled_sublevel(shape: Sublevel, factor: Fraction) -> Sublevel:
    """x -> fn(c + (x - c) / scale), traced in exact arithmetic."""
    inverse = 1 / factor
    centre = exact.fractions(shape.center)
    offset = [c - c * inverse for c in centre]

    def moved(x: Any) -> Any:
        return shape.fn(x * inverse + np.array(offset, dtype=object))

    return Sublevel(moved, shape.level, shape.dim)
