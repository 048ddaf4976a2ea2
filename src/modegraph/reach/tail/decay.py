"""Quadratic norms that decay along a settled loop, with a disturbance (method, section 6).

Let rho(x) = |A^-1 (x - c)|_2 and V = rho^2. On the ellipsoid {rho <= s}

    V' <= z' (K + K' + sum_j g_j g_j' / m_j) z + sum_j m_j,    z = A^-1 (x - c), K = A^-1 J A,

where J is a mean of df/dx on the segment from c to x, and f(c) lies in the zonotope of the columns A g_j.
If the largest eigenvalue of the bracket is at most -alpha for every df/dx on the ellipsoid (it is convex,
and the eigenvalue is a convex function of J), then V' <= -alpha V + mu with mu = sum_j m_j.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from modegraph.deadline import NEVER, Deadline
from modegraph.enclosure.monomials import monomial_count, monomials
from modegraph.enclosure.rounding import TINY, UNIT
from modegraph.reach.field import Field, cover
from modegraph.reach.inverse import near_inverse
from modegraph.reach.pointwise import evaluate_over
from modegraph.reach.quadric import Quadric

Floats = NDArray[np.float64]

DEGREE = 3
MOST_MONOMIALS = 220
COARSE = 0.1
"""A polynomial enclosure that misses more than this share of the margin is cut."""
MOST_PARTS, MOST_ENCLOSURES = 400, 1600
"""Parts a region is cut into, and enclosures computed for them in all."""
MOST_CELLS = 60000
"""Cells the ellipsoid is cut into, in all, to bound one rate."""


@dataclass(frozen=True)
class Norm:
    """rho(x) = |A^-1 (x - centre)|_2, given by the columns of ``axes`` A (n, n).

    ``inverse`` N is near A^-1 and ``off`` bounds |N A - I| in the infinity norm.
    """

    centre: Floats
    axes: Floats
    inverse: Floats
    off: float

    @classmethod
    def of(cls, centre: Floats, axes: Floats) -> Norm | None:
        """None where the axes are too nearly dependent."""
        n = len(centre)
        if not np.isfinite(axes).all() or not np.linalg.cond(axes) < 1e8:
            return None
        found = near_inverse(axes)
        if found is None:
            return None
        N, off = found
        return cls(centre, axes, N, off) if off * math.sqrt(n) < 1e-3 else None

    @property
    def quadric(self) -> Quadric:
        """rho, bounded upward: |A^-1 y| = |(N A)^-1 N y| <= |N y| / (1 - |N A - I|_2)."""
        n = len(self.centre)
        return Quadric(self.centre, self.inverse, 1.0 + 1.01 * self.off * math.sqrt(n) + 4.0 * UNIT)


@dataclass(frozen=True)
class SettledLoop:
    """A loop that no longer depends on time, for all its disturbances and unknown constants.

    fld : its field; w_centre, w_radius (q,); unknown_lo, unknown_hi (d,).
    """

    fld: Field
    w_centre: Floats
    w_radius: Floats
    unknown_lo: Floats
    unknown_hi: Floats

    def _inputs(self, m: int, size: int, first: int, linear: NDArray[np.int64]) -> Floats:
        """Polynomials of the tape variables but the states; unknowns and disturbance from variable ``first`` on."""
        fld = self.fld
        inputs = np.zeros((fld.variables, size))
        inputs[fld.time_index, 0] = fld.start
        centre, radius = cover(self.unknown_lo, self.unknown_hi)
        inputs[fld.first_w : fld.first_d, 0] = self.w_centre
        inputs[fld.first_d :, 0] = centre
        v = first
        for row, r in [(fld.first_d + k, r) for k, r in enumerate(radius)] + [
            (fld.first_w + k, r) for k, r in enumerate(self.w_radius)
        ]:
            if r > 0.0:
                inputs[row, linear[v]] = r
                v += 1
        assert v == m
        return inputs

    @property
    def uncertain(self) -> int:
        """Number of disturbances and unknowns that are not known exactly."""
        return int((self.unknown_lo < self.unknown_hi).sum() + (self.w_radius > 0.0).sum())

    def push(self, centre: Floats) -> tuple[Floats, Floats] | None:
        """Columns (k, n) and a box (n,) whose sum holds f(centre) for all disturbances and unknowns."""
        m = self.uncertain
        table = monomials((1,) * m, 2 if m <= 8 else 1)
        inputs = self._inputs(m, table.size, 0, table.linear)
        inputs[: self.fld.states, 0] = centre
        p, off, bad = evaluate_over(self.fld.rates, table, table.order, inputs, np.zeros(self.fld.variables))
        if bad >= 0 or not np.isfinite(off).all():
            return None
        columns = p[:, table.linear].T if m else np.zeros((0, self.fld.states))
        rest = np.abs(p).sum(axis=1) - np.abs(columns).sum(axis=0)
        slack = 8.0 * (table.size + 4) * UNIT * np.abs(p).sum(axis=1)
        return np.ascontiguousarray(columns), np.maximum(rest, 0.0) + slack + off + TINY

    def slopes(self, norm: Norm, radius: float, lo: Floats, hi: Floats) -> Slopes | None:
        """K + K', K = A^-1 (df/dx) A, at centre + radius A xi for lo <= xi <= hi; None where undefined."""
        fld, n = self.fld, self.fld.states
        m = n + self.uncertain
        degree = 1 if fld.steady else DEGREE
        while degree > 1 and monomial_count((1,) * m, degree) > MOST_MONOMIALS:
            degree -= 1
        table = monomials((1,) * m, degree)
        inputs = self._inputs(m, table.size, n, table.linear)
        inputs[:n, 0] = norm.centre + norm.axes @ (radius * 0.5 * (lo + hi))
        inputs[:n, table.linear[:n]] = norm.axes * (radius * 0.5 * (hi - lo))
        off = np.zeros(fld.variables)
        off[:n] = 8.0 * (n + 4) * UNIT * (np.abs(norm.centre) + radius * np.abs(norm.axes).sum(axis=1)) + TINY
        p, lost, bad = evaluate_over(fld.jacobian, table, degree, inputs, off)
        if bad >= 0 or not np.isfinite(lost).all() or not np.isfinite(p).all():
            return None
        J = p[: n * n].reshape(n, n, -1)
        N, A = norm.inverse, norm.axes
        K = np.einsum("ij,jkl,km->iml", N, J, A, optimize=True)
        size = np.abs(N) @ (np.abs(J).sum(axis=2) + lost[: n * n].reshape(n, n)) @ np.abs(A)
        rest = np.abs(N) @ lost[: n * n].reshape(n, n) @ np.abs(A)
        # A^-1 = (N A)^-1 N: the rows of K are off by at most off / (1 - off) of its largest entries.
        largest = np.abs(K).sum(axis=2).max(axis=0) + rest.max(axis=0)
        rest = rest * (1.0 + 1e-12) + 16.0 * (n + 4) * UNIT * size + 1.01 * norm.off * largest
        S = np.moveaxis(K + np.swapaxes(K, 0, 1), 2, 0)
        return Slopes(table.exponents, np.ascontiguousarray(S), (rest + rest.T) * (1.0 + 4.0 * UNIT), lo, hi)


class DecayRegion:
    """The matrices K + K' over {rho <= radius}, cut until what their polynomials miss is small."""

    def __init__(self, loop: SettledLoop, norm: Norm, radius: float, deadline: Deadline = NEVER) -> None:
        self.loop, self.norm, self.radius, self.deadline = loop, norm, radius, deadline
        self.enclosures = 1
        n = loop.fld.states
        self.parts: list[Slopes | None] = [loop.slopes(norm, radius, -np.ones(n), np.ones(n))]

    def sample(self, count: int) -> Floats | None:
        """Some of the matrices (floats: a guess); None where something is not defined."""
        part = self.parts[0]
        return None if part is None else part.sample(count)

    def negative(self, M: Floats) -> bool:
        """Whether K + K' + M is proved negative definite on the whole region."""
        budget = MOST_CELLS
        settled: list[Slopes | None] = []
        left = self.parts
        while left:
            part = left.pop()
            spent = budget <= 0 or self.enclosures > MOST_ENCLOSURES or len(settled) + len(left) > MOST_PARTS
            if part is None or spent or self.deadline.is_over:
                self.parts = [*settled, *left, part]
                return False
            if part.coarse(M):
                # At a kink no part gets less coarse: the work is counted, the depth is not.
                halves = [self.loop.slopes(self.norm, self.radius, lo, hi) for lo, hi in part.halves()]
                self.enclosures += len(halves)
                left += halves
                continue
            settled.append(part)
            used = part.negative(M, budget)
            if used < 0:
                self.parts = settled + left
                return False
            budget -= used
        self.parts = settled
        return True


@dataclass(frozen=True)
class Slopes:
    """Symmetric matrices S(eta) = sum_k S_k eta^k, up to ``rest`` (n, n) in every entry, for eta in
    [-1, 1]^m: the first n scale lo <= xi <= hi in the unit ball, the others unknowns and disturbance."""

    exponents: NDArray[np.int64]
    S: Floats
    rest: Floats
    lo: Floats
    hi: Floats

    @property
    def round(self) -> int:
        return len(self.lo)

    def sample(self, count: int) -> Floats:
        """Some S(xi) (count, n, n), most at the boundary (floats: a guess)."""
        rng = np.random.default_rng(5)
        xi = np.sign(rng.uniform(-1.0, 1.0, (count, self.exponents.shape[1])))
        xi[:, : self.round] = rng.normal(size=(count, self.round))
        xi[:, : self.round] /= np.linalg.norm(xi[:, : self.round], axis=1)[:, None]
        xi[: count // 4] *= rng.uniform(0.0, 1.0, (count // 4, 1))
        return np.tensordot(self._powers(xi), self.S, axes=1)

    def coarse(self, M: Floats) -> bool:
        """Whether what the polynomials miss is too large for a proof (seen from the centre)."""
        values, V = np.linalg.eigh(-(self.S[0] + M))
        if values[0] <= 0.0:
            return False
        T = np.abs(V / np.sqrt(values))
        return bool(_norm((T.T @ self.rest @ T)[None])[0] > COARSE)

    def halves(self) -> list[tuple[Floats, Floats]]:
        """The box of xi cut where it is most nonlinear; a half outside the ball is left out."""
        higher = self.exponents.sum(axis=1) > 1
        weight = np.sqrt((self.S[higher] ** 2).sum(axis=(1, 2)))
        v = int(np.argmax(weight @ self.exponents[higher, : self.round]))
        lo, hi = _cut(self.lo[None], self.hi[None], np.array([v]), self.round)
        return list(zip(lo, hi, strict=True))

    def negative(self, M: Floats, budget: int) -> int:
        """Number of cells that prove S(xi) + M negative definite for every xi; -1: no proof. M (n, n) symmetric.

        Cell by cell: with Q = -(S + M) at the centre of a cell and any T, T'(Q - E)T is positive
        definite, hence Q - E, if |I - T'QT| + |T'ET| < 1 for all E of the cell.
        """
        n, m = self.S.shape[1], self.exponents.shape[1]
        S = self.S.copy()
        S[0] += M
        size = np.abs(S).sum(axis=0)
        # Roundings of values and slopes at the centre of a cell.
        rest = self.rest + 64.0 * (len(S) + 16) * UNIT * size
        jet = self._jet(S)
        bend = self._bend()
        middle, radius = 0.5 * (self.lo + self.hi), 0.5 * (self.hi - self.lo)
        lo, hi = -np.ones((1, m)), np.ones((1, m))
        used = 0
        while len(lo):
            used += len(lo)
            if used > budget:
                return -1
            c, r = 0.5 * (lo + hi), 0.5 * (hi - lo)
            values_and_slopes = (self._powers(c) @ jet).reshape(len(c), m + 1, n, n)
            Q = -values_and_slopes[:, 0]
            values, V = np.linalg.eigh(Q)
            inside = ((middle + radius * c[:, :n]) ** 2).sum(axis=1) <= 1.0
            if (values[inside] <= 0.0).any():
                return -1
            T = V / np.sqrt(np.maximum(values, 1e-12 * np.abs(values).max()))[:, None, :]
            Tt = np.swapaxes(T, 1, 2)
            aT, aTt = np.abs(T), np.abs(Tt)
            D = Tt[:, None] @ values_and_slopes[:, 1:] @ T[:, None] * r[:, :, None, None]
            share = np.sqrt((D**2).sum(axis=(2, 3)))
            square = (D @ D).sum(axis=1)
            # |sum_v x_v D_v| <= |x|_2 |sum_v D_v^2|^(1/2)
            reach = np.minimum(share.sum(axis=1), np.sqrt(m * _norm(square)))
            curved = 0.5 * np.einsum("kv,kw,vwij->kij", r, r, bend, optimize=True)
            around = _norm(aTt @ (curved + rest + 8.0 * (n + 4) * UNIT * size) @ aT)
            own = _norm(np.eye(n) - Tt @ Q @ T)
            fine = (own + reach + around) * (1.0 + 1e-12) < 1.0
            lo, hi = _cut(lo[~fine], hi[~fine], np.argmax(share[~fine], axis=1), n, middle, radius)
        return used

    @cached_property
    def _lower(self) -> NDArray[np.int64]:
        """(m, N): index of each monomial divided by a variable; the monomial itself where that does not divide it."""
        index = {tuple(row): k for k, row in enumerate(self.exponents.tolist())}
        out = np.tile(np.arange(len(self.exponents)), (self.exponents.shape[1], 1))
        for k, row in enumerate(self.exponents.tolist()):
            for v, d in enumerate(row):
                if d:
                    out[v, k] = index[(*row[:v], d - 1, *row[v + 1 :])]
        return out

    def _jet(self, S: Floats) -> Floats:
        """(N, (m + 1) n^2): coefficients of S and of its derivative by each variable."""
        m = self.exponents.shape[1]
        out = np.zeros((len(S), m + 1, S.shape[1] * S.shape[2]))
        out[:, 0] = S.reshape(len(S), -1)
        for v in range(m):
            np.add.at(out[:, v + 1], self._lower[v], self.exponents[:, [v]] * S.reshape(len(S), -1))
        return out.reshape(len(S), -1)

    def _powers(self, xi: Floats) -> Floats:
        """Values (K, N) of the monomials."""
        out = np.ones((len(self.exponents), len(xi)))
        columns = np.ascontiguousarray(xi.T)
        for k, (v, lower) in enumerate(self._factors, 1):
            np.multiply(out[lower], columns[v], out=out[k])
        return out.T

    @cached_property
    def _factors(self) -> list[tuple[int, int]]:
        """Each monomial but the first as a variable times an earlier monomial."""
        first = np.argmax(self.exponents > 0, axis=1).tolist()
        return [(v, int(self._lower[v, k])) for k, v in enumerate(first)][1:]

    def _bend(self) -> Floats:
        """Bounds (m, m, n, n) of the second derivatives of S, entry by entry."""
        e = self.exponents
        m = e.shape[1]
        out = np.zeros((m, m, *self.S.shape[1:]))
        for v in range(m):
            for w in range(m):
                weight = (e[:, v] * (e[:, w] - (1 if v == w else 0))).astype(float)
                out[v, w] = np.tensordot(weight, np.abs(self.S), axes=1)
        return out


def _norm(E: Floats) -> Floats:
    """Infinity norms of (K, n, n): bounds of the 2-norms where E is symmetric."""
    return np.asarray(np.abs(E).sum(axis=2).max(axis=1))


def _cut(
    lo: Floats, hi: Floats, v: NDArray[np.int64], free: int, middle: Floats | float = 0.0, radius: Floats | float = 1.0
) -> tuple[Floats, Floats]:
    """Boxes (K, m) halved, each along its v; halves with middle + radius eta outside the unit ball are left out."""
    if not len(lo):
        return lo, hi
    rows = np.arange(len(lo))
    half = 0.5 * (lo[rows, v] + hi[rows, v])
    upper_lo, lower_hi = lo.copy(), hi.copy()
    upper_lo[rows, v] = half
    lower_hi[rows, v] = half
    lo, hi = np.concatenate([lo, upper_lo]), np.concatenate([lower_hi, hi])
    nearest = np.maximum(0.0, np.maximum(middle + radius * lo[:, :free], -(middle + radius * hi[:, :free])))
    keep = (nearest**2).sum(axis=1) <= 1.0 + 1e-9
    return lo[keep], hi[keep]
