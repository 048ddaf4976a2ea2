"""Linear and quadratic inequalities among the parts of a sublevel set: their exact extent."""

from __future__ import annotations

import itertools
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from modegraph.model.sets import exact
from modegraph.model.sets.ellipsoid import Ellipsoid
from modegraph.model.sets.level_function import LevelFunction

Polynomial = dict[tuple[int, ...], Fraction]


def quadratic(function: LevelFunction, root: int) -> Polynomial | None:
    """Coefficients by sorted variable numbers, () being the constant; None above degree two."""
    from modegraph.expression import ops

    graph = function.graph
    known: dict[int, Polynomial | None] = {}
    for k in graph.reachable([root]):
        op, a, b, _, const = graph.nodes[k]
        left, right = known.get(a), known.get(b)
        result: Polynomial | None = None
        if op == ops.CONST and const is not None:
            result = {(): const}
        elif op == ops.VAR:
            result = {(a,): Fraction(1)}
        elif left is None:
            result = None
        elif op == ops.MULC and const is not None:
            result = {key: const * value for key, value in left.items()}
        elif op == ops.ADDC and const is not None:
            result = {**left, (): left.get((), Fraction(0)) + const}
        elif op in (ops.ADD, ops.SUB) and right is not None:
            sign = 1 if op == ops.ADD else -1
            result = {key: left.get(key, Fraction(0)) + sign * right.get(key, Fraction(0)) for key in {**left, **right}}
        elif op == ops.SQR:
            result = _times(left, left)
        elif op == ops.MUL and right is not None:
            result = _times(left, right)
        known[k] = result
    return known[root]


def _times(left: Polynomial, right: Polynomial) -> Polynomial | None:
    product: Polynomial = {}
    for (i, a), (j, b) in itertools.product(left.items(), right.items()):
        if a and b:
            if len(i) + len(j) > 2:
                return None
            key = tuple(sorted(i + j))
            product[key] = product.get(key, Fraction(0)) + a * b
    return product


class Quadric(NamedTuple):
    """{(x - centre)' P (x - centre) <= room} in the variables ``used``, P positive definite, room >= 0."""

    used: list[int]
    centre: exact.Row
    P: exact.Matrix
    inverse: exact.Matrix
    room: Fraction


def _completed(polynomial: Polynomial, bound: Fraction) -> Quadric | None:
    """{polynomial <= bound} where that is a bounded quadric with a point."""
    used = sorted({k for key, value in polynomial.items() if value for k in key})
    P = [[polynomial.get((min(i, j), max(i, j)), Fraction(0)) / (1 if i == j else 2) for j in used] for i in used]
    inverse = exact.inverse(P) if used and exact.is_positive_definite(P) else None
    if inverse is None:
        return None
    centre = [-value / 2 for value in exact.times(inverse, [polynomial.get((i,), Fraction(0)) for i in used])]
    room = bound - polynomial.get((), Fraction(0)) + exact.quadratic_form(P, centre)
    return Quadric(used, centre, P, inverse, room) if room >= 0 else None


def extent(polynomial: Polynomial, bound: Fraction) -> dict[int, tuple[float, float]]:
    """Bounds of coordinates on {polynomial <= bound}, exact up to rounding outward; {} where none follow."""
    lines = [(key, value) for key, value in polynomial.items() if key and value]
    if len(lines) == 1 and len(lines[0][0]) == 1:
        ((k,), slope) = lines[0]
        edge = (bound - polynomial.get((), Fraction(0))) / slope
        return {k: (-np.inf, exact.round_up(edge)) if slope > 0 else (exact.round_down(edge), np.inf)}
    quadric = _completed(polynomial, bound)
    if quadric is None:
        return {}
    found = {}
    for i, (k, middle) in enumerate(zip(quadric.used, quadric.centre, strict=True)):
        half = exact.sqrt_up(quadric.room * quadric.inverse[i][i])
        found[k] = exact.round_down(middle - half), exact.round_up(middle + half)
    return found


def ellipsoids(function: LevelFunction) -> tuple[Ellipsoid, Ellipsoid] | None:
    """(inner, outer), nearly equal, around the boundary of a set that is an ellipsoid; None for any other set.

    A centre that is off by at most epsilon in the norm of the set makes it smaller or larger by that;
    that the rounded shapes make up for it is checked exactly.
    """
    if len(function.parts) != 1 or function.graph.dropped:
        return None
    bound = function.parts[0].bound(function.level)
    polynomial = None if bound is None else quadratic(function, function.parts[0].expr.index)
    quadric = None if polynomial is None or bound is None else _completed(polynomial, bound)
    if quadric is None or quadric.room == 0 or len(quadric.used) != function.dim:
        return None
    centre = np.array([float(value) for value in quadric.centre])
    off = [a - b for a, b in zip(quadric.centre, exact.fractions(centre), strict=True)]
    epsilon = exact.sqrt_up(exact.quadratic_form(quadric.P, off) / quadric.room)
    if epsilon >= 1:
        return None
    shape = [[quadric.room * value for value in row] for row in quadric.inverse]
    found = []
    for sign in (-1, 1):
        wanted = [[(1 + sign * epsilon) ** 2 * value for value in row] for row in shape]
        rounded = _beyond(wanted, sign)
        if rounded is None:
            return None
        found.append(Ellipsoid(centre, rounded))
    return found[0], found[1]


def _beyond(wanted: exact.Matrix, sign: int) -> np.ndarray | None:
    """Doubles S near a symmetric matrix with sign * (S - wanted) positive semidefinite."""
    near = np.array([[float(value) for value in row] for row in wanted])
    for growth in (0.0, *(2.0**k for k in range(-50, -18, 4))):
        given = near * (1.0 + sign * growth)
        gap = [
            [sign * (Fraction(float(b)) - a) for a, b in zip(row, other, strict=True)]
            for row, other in zip(wanted, given, strict=True)
        ]
        if exact.is_positive_semidefinite(gap):
            return given
    return None
