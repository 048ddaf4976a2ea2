"""Restrict the polynomials of a flowpipe to a part of the starts, without integrating again."""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.monomials import Monomials
from modegraph.enclosure.rounding import UNIT
from modegraph.reach.start.piece import Piece

Floats = NDArray[np.float64]


class Restriction:
    """The substitution eta = middle + radius eta' that maps a child piece into its parent.

    ``apply`` maps polynomials (..., size) over the parent to polynomials over the child. Rounding:
    the coefficients of each substituted monomial sum to at most 1 in absolute value (a little more
    after outward rounding), so the error of a polynomial is at most ``error`` times its 1-norm.
    """

    def __init__(self, parent: Piece, child: Piece, table: Monomials, size: int) -> None:
        radius = np.where(parent.radius > 0.0, parent.radius, 1.0)
        # Widened so that float rounding of the map cannot lose a part of the child.
        middle = (child.middle - parent.middle) / radius
        spread = child.radius / radius * (1.0 + 8.0 * UNIT) + 8.0 * UNIT * (np.abs(middle) + 1.0)
        spread = np.where(parent.radius > 0.0, spread, 1.0)
        exponents = table.exponents[:size]
        index = {tuple(e): k for k, e in enumerate(exponents.tolist())}
        matrix = np.eye(size)
        for v in range(len(middle)):
            if middle[v] == 0.0 and spread[v] == 1.0:
                continue
            step = np.zeros((size, size))
            for k, alpha in enumerate(exponents.tolist()):
                e = alpha[v]
                for i in range(e + 1):
                    beta = list(alpha)
                    beta[v] = i
                    step[k, index[tuple(beta)]] = comb(e, i) * middle[v] ** (e - i) * spread[v] ** i
            matrix = matrix @ step
        self.matrix = matrix
        top = int(exponents.sum(axis=1).max(initial=0))
        self.error = 16.0 * (size + 8) * (top + len(middle) + 2) * UNIT

    def apply(self, polynomials: Floats) -> tuple[Floats, Floats]:
        """Restricted polynomials (..., size) and the radius (...) of what rounding may have lost."""
        return polynomials @ self.matrix, self.error * np.abs(polynomials).sum(axis=-1)
