"""How far a reach set is from a centre in a quadratic norm |T (x - c)|_2, bounded upward."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.rounding import UNIT
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.generators import generator_sizes
from modegraph.reach.reach_set import ReachSet, ReachSets

Floats = NDArray[np.float64]

MOST_CORNERS = 8
"""Boxes of up to this many variables are bounded corner by corner in a quadric."""


class Quadric:
    """The norm |T (x - centre)|_2, T (n, n); ``grow`` covers what T itself is off by."""

    def __init__(self, centre: Floats, T: Floats, grow: float = 1.0) -> None:
        self.centre, self.T, self.grow = centre, T, grow
        self.dim = len(centre)

    def gauge(self, reach: ReachSet) -> float:
        """Upper bound over one set."""
        return float(self.gauges(ReachSets.one(reach))[0])

    def gauges(self, sets: ReachSets) -> Floats:
        """Upper bounds (K,) over sets that are finite."""
        gauges = self._of_zonotopes(sets.bounds, sets.p, sets.generators)
        return np.nextafter(gauges + self.box_gauges(sets.box), np.inf) if sets.box.any() else gauges

    def box_gauges(self, radius: Floats) -> Floats:
        """What adding boxes of radii (K, n) can add to the gauge."""
        y = radius @ np.abs(self.T).T
        return np.asarray(np.sqrt((y**2).sum(axis=1)) * self.grow * (1.0 + 8.0 * (self.dim + 4) * UNIT))

    def _of_zonotopes(self, bounds: PolynomialBounds, p: Floats, generators: Sequence[Floats]) -> Floats:
        gauge = self._gauges(bounds, p, generators, [self.T] * len(p))
        # The norm does not change under a rotation, but boxes around zonotopes do: try their own axes too.
        # They gain at most the square root of n: nothing, where that would not bring a set to the least.
        near = np.flatnonzero(~(gauge > np.sqrt(self.dim) * max(1.0, np.nanmin(gauge, initial=np.inf))))
        some = [generators[k] for k in near.tolist()]
        rotated, loose = self._principal(p[near], some)
        if rotated:
            turned = self._gauges(bounds, p[near], some, rotated) * loose
            gauge[near] = np.fmin(gauge[near], turned)
        return np.asarray(np.where(np.isnan(gauge), np.inf, gauge))

    def _principal(self, p: Floats, generators: Sequence[Floats]) -> tuple[list[Floats], Floats]:
        """Q T for each set, Q nearly orthogonal along the axes of its zonotope, and bounds of |Q^-1|_2."""
        n = self.dim
        turns, loose = [], np.ones(len(p))
        for k, G in enumerate(generators):
            columns = np.moveaxis(G[:, :n], 1, 0).reshape(n, -1)
            spread = self.T @ (p[k, :, 1:] @ p[k, :, 1:].T + columns @ columns.T) @ self.T.T
            if not np.isfinite(spread).all():
                return [], loose
            Q = np.linalg.eigh(spread)[1].T
            miss = float(np.abs(Q @ Q.T - np.eye(n)).sum(axis=1).max()) + 8.0 * n * n * UNIT
            turns.append(Q @ self.T)
            loose[k] = 1.0 + miss + 8.0 * n * UNIT
        return turns, loose

    def _gauges(
        self, bounds: PolynomialBounds, p: Floats, generators: Sequence[Floats], turns: Sequence[Floats]
    ) -> Floats:
        n = self.dim
        T = np.stack(turns) if len(turns) else np.zeros((0, n, n))
        size = np.abs(p).sum(axis=-1)
        shifted = p.copy()
        shifted[:, :, 0] -= self.centre
        y = T @ shifted
        # The factor 2 n covers the rounding of a rotation of T itself.
        error = 8.0 * (n + 4) * UNIT * np.einsum("kfi,ki->kf", np.abs(T), size + np.abs(self.centre)) * (1 + n)
        z = [generator_sizes(t, [G])[0] for t, G in zip(turns, generators, strict=True)]
        z = np.array(z).reshape(len(p), n) * (1.0 + 16.0 * n * n * UNIT) + error
        lo, hi = bounds.ranges(y)
        hull = np.sqrt((np.maximum(np.abs(lo - z), np.abs(hi + z)) ** 2).sum(axis=1))
        linear = self._linear_gauge(bounds, y, z)
        return np.asarray(np.fmin(hull, linear) * self.grow * (1.0 + 8.0 * (n + 4) * UNIT))

    def _linear_gauge(self, bounds: PolynomialBounds, y: Floats, z: Floats) -> Floats:
        """sup |y0 + Y eta + rest|_2 with the linear part kept together; inf where that is too costly."""
        piece = bounds.piece
        Y = bounds.linear_part(y)
        below, above = bounds.nonlinear_radius(y)
        middle = 0.5 * (below + above)
        constant = y[:, :, 0] + middle
        rest = 0.5 * (above - below) + z + 4.0 * UNIT * (np.abs(constant) + np.abs(middle))
        m = piece.chart.free
        if piece.chart.round and m > 0:
            others = np.abs(Y[:, :, m:]).sum(axis=2)
            with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
                plain = Y[:, :, :m] / piece.radius[:m]
                start = constant - plain @ piece.middle[:m]
            head = np.full(len(y), np.inf)
            fine = np.isfinite(plain).all(axis=(1, 2)) & (np.abs(plain).max(axis=(1, 2), initial=0.0) < 1e100)
            if fine.any():
                size = np.abs(plain[fine]).sum(axis=(1, 2)) + np.abs(constant[fine]).sum(axis=1)
                head[fine] = np.sqrt((start[fine] ** 2).sum(axis=1)) + largest_singular_value(plain[fine])
                head[fine] += 16.0 * (m + self.dim + 4) * UNIT * size
            total = head + np.sqrt(((rest + others) ** 2).sum(axis=1))
            if m <= MOST_CORNERS and piece.depth > 0:
                total = np.fmin(total, self._corner_gauge(constant, Y, rest))
            return np.asarray(total)
        return self._corner_gauge(constant, Y, rest)

    def _corner_gauge(self, constant: Floats, Y: Floats, rest: Floats) -> Floats:
        m = Y.shape[2]
        if m > MOST_CORNERS:
            return np.full(len(Y), np.inf)
        # |y0 + Y eta|_2 is convex: largest at a corner; eta and -eta both count.
        corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * m, indexing="ij")).reshape(m, -1) if m else np.zeros((0, 1))
        values = constant[:, :, None] + Y @ corners
        size = np.abs(constant).sum(axis=1) + np.abs(Y).sum(axis=(1, 2))
        head = np.sqrt((values**2).sum(axis=1)).max(axis=1) + 8.0 * (m + self.dim + 4) * UNIT * size
        return np.asarray(head + np.sqrt((rest**2).sum(axis=1)))


def largest_singular_value(Y: Floats) -> Floats:
    """Upper bounds (K,) of the largest singular value of matrices (K, a, b).

    With B = Y'Y and any V near orthogonal, lambda_max(B) <= |V'BV|_inf / (1 - |V'V - I|_inf).
    """
    b = Y.shape[2]
    B = np.swapaxes(Y, 1, 2) @ Y
    V = np.linalg.eigh(B)[1]
    rotated = np.swapaxes(V, 1, 2) @ B @ V
    size = (Y**2).sum(axis=(1, 2))
    top = np.abs(rotated).sum(axis=2).max(axis=1) + 16.0 * b * b * (b + Y.shape[1] + 4) * UNIT * size
    miss = np.abs(np.swapaxes(V, 1, 2) @ V - np.eye(b)).sum(axis=2).max(axis=1) + 8.0 * b * b * UNIT
    bound = np.sqrt(top / (1.0 - np.minimum(miss, 0.5))) * (1.0 + 8.0 * UNIT)
    frobenius = np.sqrt(size) * (1.0 + 4.0 * (b * Y.shape[1] + 2) * UNIT)
    return np.asarray(np.where(miss < 0.5, np.fmin(bound, frobenius), frobenius))
