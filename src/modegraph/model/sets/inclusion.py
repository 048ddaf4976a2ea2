"""Is one set inside another? A yes is always an exact proof."""

from __future__ import annotations

from fractions import Fraction
from itertools import islice

import numpy as np

from modegraph.errors import ModegraphError
from modegraph.model.sets import exact
from modegraph.model.sets.ball import Ball
from modegraph.model.sets.base import Floats, Set
from modegraph.model.sets.box import Box
from modegraph.model.sets.ellipsoid import Ellipsoid
from modegraph.model.sets.sublevel import Sublevel
from modegraph.model.sets.zonotope import Zonotope

_FEW_CORNERS = 64
"""Most corners that are looked for in a zonotope by linear programs of their own."""


def is_subset(inner: Set, outer: Set) -> bool:
    """Whether every point of ``inner`` lies in ``outer``, proved in rational (Sublevel: interval) arithmetic.

    True is a proof. False means "not proved": it is exact too when ``outer`` is a Box or a Polytope,
    for a Box or Ball in a Ball, and mostly where ``inner`` has few corners. An empty set is inside
    everything.

    Raises
    ------
    ModegraphError
        If the two sets have different dimensions.
    """
    if inner.dim != outer.dim:
        raise ModegraphError(
            f"is_subset: {type(inner).__name__} has {inner.dim} coordinates but {type(outer).__name__} has "
            f"{outer.dim}; compare sets of the same states"
        )
    if inner == outer or inner.is_empty():
        return True
    if isinstance(inner, Sublevel) and isinstance(outer, Sublevel) and inner.is_lower_level_of(outer):
        return True
    if not inner.is_bounded() and (outer.is_bounded() or isinstance(outer, Sublevel)):
        return False
    if isinstance(outer, Sublevel):
        return outer.holds_box(*inner.bounding_box())
    if isinstance(outer, Ball) and outer.radius == 0:
        outer = Box(outer.c, outer.c)
    faces = outer.faces()
    if faces is not None:
        return all(inner.support_at_most(direction, bound) for direction, bound in faces)
    if isinstance(outer, Ball):
        return _in_ball(inner, outer)
    if isinstance(outer, Ellipsoid):
        return in_quadric(inner, exact.fractions(outer.c), outer.inverse_shape)
    if isinstance(outer, Zonotope):
        return _in_zonotope(inner, outer)
    return False


def _in_ball(inner: Set, outer: Ball) -> bool:
    center, radius = exact.fractions(outer.c), Fraction(outer.radius)
    if isinstance(inner, Box):
        lo, hi = exact.fractions(inner.lo), exact.fractions(inner.hi)
        farthest = [max(abs(a - c), abs(b - c)) for a, b, c in zip(lo, hi, center, strict=True)]
        return exact.dot(farthest, farthest) <= radius**2
    if isinstance(inner, Ball):
        room = radius - Fraction(inner.radius)
        offset = _minus(exact.fractions(inner.c), center)
        return room >= 0 and exact.dot(offset, offset) <= room**2
    return in_quadric(inner, center, exact.identity(inner.dim, 1 / radius**2))


def in_quadric(inner: Set, center: exact.Row, weight: exact.Matrix) -> bool:
    """Whether inner lies in {x : (x - center)' weight (x - center) <= 1}."""
    if isinstance(inner, Ball) and inner.radius == 0:
        return exact.quadratic_form(weight, _minus(exact.fractions(inner.c), center)) <= 1
    if isinstance(inner, Ball):
        squared = Fraction(inner.radius) ** 2
        own, shape = exact.identity(inner.dim, 1 / squared), float(squared) * np.eye(inner.dim)
        return quadric_in_quadric(_minus(exact.fractions(inner.c), center), own, shape, weight)
    if isinstance(inner, Ellipsoid):
        offset = _minus(exact.fractions(inner.c), center)
        return quadric_in_quadric(offset, inner.inverse_shape, inner.shape, weight)
    if generators_in_quadric(*_as_zonotope(inner), center, weight):
        return True
    corners = inner.vertices()
    return corners is not None and all(exact.quadratic_form(weight, _minus(corner, center)) <= 1 for corner in corners)


def generators_in_quadric(middle: exact.Row, generators: exact.Matrix, center: exact.Row, weight: exact.Matrix) -> bool:
    """Sufficient: bound the square of offset + sum g_k z_k term by term (exact for orthogonal generators)."""
    offset = _minus(middle, center)
    weighted = [exact.times(weight, g) for g in generators]
    total = exact.quadratic_form(weight, offset)
    total += 2 * sum(abs(exact.dot(w, offset)) for w in weighted)
    total += sum(abs(exact.dot(w, g)) for w in weighted for g in generators)
    return total <= 1


def _as_zonotope(region: Set) -> tuple[exact.Row, exact.Matrix]:
    """Centre and generators (one a row) of a zonotope, or of the box around any other set."""
    if isinstance(region, Zonotope):
        return exact.fractions(region.c), exact.matrix(region.generators.T)
    lo, hi = (exact.fractions(side) for side in region.bounding_box())
    half = [(b - a) / 2 for a, b in zip(lo, hi, strict=True)]
    return [(a + b) / 2 for a, b in zip(lo, hi, strict=True)], [
        [value if j == k else Fraction(0) for j in range(region.dim)] for k, value in enumerate(half)
    ]


def quadric_in_quadric(offset: exact.Row, own: exact.Matrix, shape: Floats, weight: exact.Matrix) -> bool:
    """S-lemma: {y'own y <= 1} lies in {(y + offset)'weight(y + offset) <= 1} iff, for some m >= 0,

        [m own - weight          -weight offset              ]
        [-(weight offset)'   1 - m - offset'weight offset]   is positive semidefinite.

    Floats propose m, an exact elimination decides.
    """
    pull = exact.times(weight, offset)
    rest = 1 - exact.dot(offset, pull)
    for multiplier in _multipliers(shape, weight, offset):
        rows = [
            [*(multiplier * a - b for a, b in zip(row, other, strict=True)), -p]
            for row, other, p in zip(own, weight, pull, strict=True)
        ]
        rows.append([*(-p for p in pull), rest - multiplier])
        if exact.is_positive_semidefinite(rows):
            return True
    return False


def _multipliers(shape: Floats, weight: exact.Matrix, offset: exact.Row) -> list[Fraction]:
    """Candidates for the multiplier: the end 1, and the float optimum with simple fractions near it."""
    candidates = [Fraction(1)]
    if not any(offset):
        return candidates
    values, vectors = np.linalg.eigh(shape)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    outer = np.array([[float(value) for value in row] for row in weight])
    shift = np.array([float(value) for value in offset])
    curvature, axes = np.linalg.eigh(root.T @ outer @ root)
    pull = (axes.T @ (root.T @ (outer @ shift))) ** 2
    low, high = max(0.0, float(curvature[-1])), 1.0
    if not np.isfinite([low, *pull]).all() or low >= high:
        return candidates
    for _ in range(80):
        # Slope of the Schur complement 1 - m - offset'W offset - sum pull / (m - curvature), concave in m.
        middle = 0.5 * (low + high)
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = -1.0 + float(np.nansum(pull / (middle - curvature) ** 2))
        low, high = (middle, high) if slope > 0 else (low, middle)
    best = Fraction(0.5 * (low + high))
    return [*candidates, best, *(best.limit_denominator(size) for size in (100, 10_000, 1_000_000))]


def _in_zonotope(inner: Set, outer: Zonotope) -> bool:
    """A zonotope without a short list of faces.

    Sufficient: inner (or a box around it) written in the coordinates of outer stays within [-1, 1].
    Else every corner of inner is asked for, if there are few.
    """
    middle, generators = _as_zonotope(inner)
    center = exact.fractions(outer.c)
    parts = [outer.coordinates(part) for part in (_minus(middle, center), *generators)]
    known = [part for part in parts if part is not None]
    if known and all(sum(map(abs, row)) <= 1 for row in zip(*known, strict=True)):
        return True
    corners = inner.vertices() or Box(*inner.bounding_box()).vertices()
    few = list(islice(corners, _FEW_CORNERS + 1)) if corners is not None else []
    return 0 < len(few) <= _FEW_CORNERS and all(outer.contains_offset(_minus(corner, center)) for corner in few)


def _minus(a: exact.Row, b: exact.Row) -> exact.Row:
    return [x - y for x, y in zip(a, b, strict=True)]
