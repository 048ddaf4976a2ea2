"""Upper bounds of polynomials over a piece of the start set, vectorised over many polynomials."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.monomials import Monomials
from modegraph.enclosure.ranges import EVEN, ODD, piece_bounds, upper_bound
from modegraph.enclosure.rounding import TINY, UNIT
from modegraph.reach.start.piece import Piece

Floats = NDArray[np.float64]


class PolynomialBounds:
    """Ranges of polynomials over the variables of one piece.

    The linear part is bounded exactly (on the ball where the start is round), even powers by [0, 1],
    all others by [-1, 1].
    """

    def __init__(self, piece: Piece, table: Monomials, size: int) -> None:
        self.piece = piece
        self.exponents = np.ascontiguousarray(table.exponents[:size])
        total = self.exponents.sum(axis=1)
        self.linear = np.array([k for k in table.linear if 0 <= k < size], np.int64)
        self.variables = np.array([v for v, k in enumerate(table.linear) if 0 <= k < size], np.int64)
        higher = total >= 2
        even = higher & (self.exponents % 2 == 0).all(axis=1)
        self.even = np.flatnonzero(even)
        self.odd = np.flatnonzero(higher & ~even)
        self.rounding = 4.0 * (size + 8) * UNIT
        kinds = np.where(even, EVEN, np.where(higher, ODD, 0))
        linear = np.where(table.linear < size, table.linear, -1)
        self.arrays = (kinds, linear, *piece.ball, self.rounding)
        """What the kernels take."""

    def linear_part(self, polynomials: Floats) -> Floats:
        """Coefficients (..., m) of the variables themselves."""
        out = np.zeros((*polynomials.shape[:-1], self.piece.variables))
        out[..., self.variables] = polynomials[..., self.linear]
        return out

    def upper(self, polynomials: Floats) -> Floats:
        """Upper bounds (...) of polynomials (..., N) over the piece."""
        rows = np.ascontiguousarray(polynomials).reshape(-1, polynomials.shape[-1])
        return np.asarray(piece_bounds(rows, *self.arrays).reshape(polynomials.shape[:-1]))

    def ranges(self, polynomials: Floats) -> tuple[Floats, Floats]:
        """Lower and upper bounds (...) of polynomials (..., N)."""
        return -self.upper(-polynomials), self.upper(polynomials)

    def nonlinear_radius(self, polynomials: Floats) -> tuple[Floats, Floats]:
        """Range (lo, hi) of everything of degree two and more."""
        odd = np.abs(polynomials[..., self.odd]).sum(axis=-1)
        even = polynomials[..., self.even]
        slack = self.rounding * np.abs(polynomials).sum(axis=-1) + TINY
        return np.minimum(even, 0.0).sum(axis=-1) - odd - slack, np.maximum(even, 0.0).sum(axis=-1) + odd + slack

    def refined_upper(self, polynomial: Floats, limit: float, cells: int = 200) -> float:
        """A better bound of one polynomial by bisection, until it is at most ``limit``."""
        m = self.exponents.shape[1]
        c = np.ascontiguousarray(polynomial)
        return float(upper_bound(c, self.exponents, -np.ones(m), np.ones(m), limit, cells))
