"""Rational arithmetic for decisions about sets: a double is the rational number it denotes.

Matrices are lists of rows of :class:`fractions.Fraction`. Sizes are those of control models (up to a
few dozen rows), so the straightforward algorithms are fast enough and nothing is ever rounded.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction

import numpy as np

Row = list[Fraction]
Matrix = list[Row]


def fractions(values: Iterable[float]) -> Row:
    """The exact rational values of finite doubles."""
    return [Fraction(float(value)) for value in values]


def matrix(values: np.ndarray) -> Matrix:
    """The exact rational entries of a two-dimensional array of finite doubles."""
    return [fractions(row) for row in values]


def dot(a: Sequence[Fraction], b: Sequence[Fraction]) -> Fraction:
    """Inner product; zero factors are skipped, sparse directions are common."""
    return sum((x * y for x, y in zip(a, b, strict=True) if x and y), Fraction(0))


def times(rows: Matrix, vector: Sequence[Fraction]) -> Row:
    """Matrix times vector."""
    return [dot(row, vector) for row in rows]


def quadratic_form(rows: Matrix, vector: Sequence[Fraction]) -> Fraction:
    """v' M v."""
    return dot(vector, times(rows, vector))


def identity(n: int, scale: Fraction | int = 1) -> Matrix:
    """``scale`` times the (n, n) identity."""
    return [[Fraction(scale) if i == j else Fraction(0) for j in range(n)] for i in range(n)]


def solve(rows: Matrix, right: Matrix) -> Matrix | None:
    """The X with ``rows`` X = ``right`` for a square matrix, or None when it is singular."""
    n = len(rows)
    work = [list(row) + list(extra) for row, extra in zip(rows, right, strict=True)]
    for k in range(n):
        pivot = next((i for i in range(k, n) if work[i][k]), None)
        if pivot is None:
            return None
        work[k], work[pivot] = work[pivot], work[k]
        head = work[k][k]
        work[k] = [value / head for value in work[k]]
        for i in range(n):
            factor = work[i][k]
            if i != k and factor:
                work[i] = [a - factor * b if b else a for a, b in zip(work[i], work[k], strict=True)]
    return [row[n:] for row in work]


def inverse(rows: Matrix) -> Matrix | None:
    """The inverse of a square matrix, or None when it is singular."""
    return solve(rows, identity(len(rows)))


def normal_to(vectors: Matrix) -> Row | None:
    """A nonzero vector orthogonal to n - 1 vectors of length n; None when they are dependent."""
    n = len(vectors) + 1
    work = [list(row) for row in vectors]
    pivots: list[int] = []
    for column in range(n):
        k = len(pivots)
        pivot = next((i for i in range(k, n - 1) if work[i][column]), None)
        if pivot is None:
            continue
        work[k], work[pivot] = work[pivot], work[k]
        head = work[k][column]
        work[k] = [value / head for value in work[k]]
        for i in range(n - 1):
            factor = work[i][column]
            if i != k and factor:
                work[i] = [a - factor * b for a, b in zip(work[i], work[k], strict=True)]
        pivots.append(column)
    if len(pivots) < n - 1:
        return None
    free = next(column for column in range(n) if column not in pivots)
    normal = [Fraction(0)] * n
    normal[free] = Fraction(1)
    for row, column in zip(work, pivots, strict=True):
        normal[column] = -row[free]
    return normal


def is_positive_definite(rows: Matrix) -> bool:
    """Whether a symmetric matrix is positive definite (symmetric elimination, all pivots > 0)."""
    return _pivots_hold(rows, strict=True)


def is_positive_semidefinite(rows: Matrix) -> bool:
    """Whether a symmetric matrix is positive semidefinite.

    Symmetric elimination: pivots are >= 0, and where a pivot is zero the rest of its row is zero too.
    """
    return _pivots_hold(rows, strict=False)


def _pivots_hold(rows: Matrix, *, strict: bool) -> bool:
    work = [list(row) for row in rows]
    n = len(work)
    for k in range(n):
        pivot = work[k][k]
        if pivot < 0 or (strict and pivot == 0):
            return False
        if pivot == 0:
            if any(work[k][j] for j in range(k + 1, n)):
                return False
            continue
        for i in range(k + 1, n):
            factor = work[i][k] / pivot
            if factor:
                for j in range(k, n):
                    work[i][j] -= factor * work[k][j]
    return True


def round_up(value: Fraction) -> float:
    """The smallest double >= value (``inf`` beyond the largest double)."""
    try:
        near = value.numerator / value.denominator
    except OverflowError:
        return math.inf if value > 0 else -float(np.finfo(float).max)
    return near if Fraction(near) >= value else math.nextafter(near, math.inf)


def round_down(value: Fraction) -> float:
    """The largest double <= value."""
    return -round_up(-value)


def sqrt_up(value: Fraction) -> Fraction:
    """A rational upper bound of the square root of value >= 0, exact for squares, else tight to 2**-64."""
    product = value.numerator * value.denominator
    shift = max(0, 66 - product.bit_length() // 2)
    scaled = product << (2 * shift)
    root = math.isqrt(scaled)
    if root * root < scaled:
        root += 1
    return Fraction(root, value.denominator << shift)
