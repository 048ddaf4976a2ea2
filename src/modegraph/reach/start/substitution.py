"""The reach sets of a class with the parameters fixed: what one of its references can reach."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.rounding import TINY, UNIT
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.reach_set import ReachSet
from modegraph.reach.start.class_chart import parameters_of, scale_of
from modegraph.reach.start.piece import Piece

Floats = NDArray[np.float64]


def holds(piece: Piece, p: Floats) -> bool:
    """Whether the parameters p (k,) are among those of a piece."""
    return all(abs(_scaled(piece, variable, p[k])) <= 1 for variable, k in parameters_of(piece))


def _scaled(piece: Piece, variable: int, value: float) -> Fraction:
    """A parameter on the scale [-1, 1] of its variable in the flowpipe, exactly."""
    centre, radius = scale_of(piece, variable)
    return (Fraction(float(value)) - Fraction(centre)) / Fraction(radius)


class Substitution:
    """Parameters p (k,) put into polynomials over a piece, which must hold p.

    A parameter is c + r eta, eta the variable of the piece; eta = (p - c) / r is rounded to nearest. The
    variable disappears: what is left is a polynomial over the same table.
    """

    def __init__(self, bounds: PolynomialBounds, p: Floats) -> None:
        exponents = bounds.exponents
        size = len(exponents)
        factor = np.ones(size)
        rest = exponents.copy()
        for variable, k in parameters_of(bounds.piece):
            eta = _scaled(bounds.piece, variable, p[k])
            assert abs(eta) <= 1
            factor = factor * float(eta) ** exponents[:, variable]
            rest[:, variable] = 0
        index = {tuple(e): j for j, e in enumerate(exponents.tolist())}
        self._matrix = np.zeros((size, size))
        self._matrix[np.arange(size), [index[tuple(e)] for e in rest.tolist()]] = factor
        # Each factor is off by one rounding of eta for each of its powers, by those of the powers (two ulp
        # each) and of their product; a dot product of ``size`` terms follows.
        top = int(exponents.sum(axis=1).max(initial=0))
        self._error = 2.0 * (size + 6 * top + 2 * len(p) + 8) * UNIT

    def __call__(self, reach: ReachSet) -> ReachSet:
        """A set with the parameters fixed; its box also holds what rounding loses."""
        lost = self._error * np.abs(reach.p).sum(axis=1) + TINY
        return replace(reach, p=reach.p @ self._matrix, box=(reach.box + lost) * (1.0 + 4.0 * UNIT))
