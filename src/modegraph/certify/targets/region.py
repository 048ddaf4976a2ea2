"""A convex target set as inequalities that reach sets are tested against.

A set with faces {x : a'x <= b} is tested face by face; a ball or ellipsoid through y = T (x - c),
|y|_2 <= 1. Gauges are 1 on the boundary and computed upward: gauge <= 1 is a proof of containment.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.rounding import UNIT
from modegraph.errors import ModegraphError
from modegraph.model.sets import Ball, Box, Ellipsoid, Polytope, Set, Zonotope, exact
from modegraph.reach.generators import generator_sizes
from modegraph.reach.quadric import Quadric
from modegraph.reach.reach_set import ReachSet, ReachSets

Floats = NDArray[np.float64]


class Region:
    """A target: gauges of reach sets (upper bounds) and separation of boxes from it.

    Attributes
    ----------
    set : Set
    dim : int
    """

    def __init__(self, target: Set) -> None:
        self.set = target
        self.dim = target.dim
        if isinstance(target, Ball) and target.radius == 0.0:
            target = Box(target.c, target.c)
        self._faces = target.faces()
        if self._faces is not None:
            self._prepare_faces(target)
        elif isinstance(target, (Ball, Ellipsoid)):
            self._prepare_quadric(target)
        elif isinstance(target, Zonotope):
            raise ModegraphError(
                f"the target is a Zonotope with {target.generators.shape[1]} generators in {target.dim} coordinates, "
                "which is flat or has too many faces to list: use fewer generators, a Polytope or a Box inside it"
            )
        else:
            raise ModegraphError(f"a {type(target).__name__} cannot be a target yet")

    def _prepare_faces(self, target: Set) -> None:
        assert self._faces is not None
        rows = [row for row, _ in self._faces]
        self.A = np.array([[float(v) for v in row] for row in rows]).reshape(len(rows), self.dim)
        # |A - exact normal|, rounded up; normals that are doubles are exact.
        self.dA = np.array([[exact.round_up(abs(Fraction(float(v)) - v)) for v in row] for row in rows]).reshape(
            len(rows), self.dim
        )
        self.b = np.array([exact.round_down(bound) for _, bound in self._faces])
        centre = target.chebyshev[0] if isinstance(target, Polytope) else np.asarray(target.center, float)
        self.centre = centre
        distance = self.b - self.A @ centre
        # A flat set has no margin: any positive slack would be infinitely good, any miss infinitely bad.
        self.distance = np.maximum(distance, 1e-300)

    def _prepare_quadric(self, target: Ball | Ellipsoid) -> None:
        n = self.dim
        self.centre = np.array(target.c, float)
        if isinstance(target, Ball):
            self.T = np.eye(n) * (1.0 / float(target.radius))
            self.grow = 1.0 + 4.0 * UNIT
            self.quadric = Quadric(self.centre, self.T, self.grow)
            return
        shape = np.array(target.shape, float)
        scale = np.sqrt(np.diag(shape))
        correlation = shape / np.outer(scale, scale)
        self.T = np.linalg.inv(np.linalg.cholesky(correlation)) / scale
        # shape^-1 <= T'T / lambda_min(T shape T').
        product = self.T @ shape @ self.T.T
        miss = np.abs(product - np.eye(n)) + 4.0 * n * UNIT * (np.abs(self.T) @ np.abs(shape) @ np.abs(self.T.T))
        off = float(miss.sum(axis=1).max()) * (1.0 + 8.0 * n * UNIT)
        if not off < 0.01:
            raise ModegraphError("the target ellipsoid's shape is too close to singular; scale its coordinates")
        self.grow = (1.0 + off) * (1.0 + 4.0 * UNIT)
        self.quadric = Quadric(self.centre, self.T, self.grow)

    # -- containment -----------------------------------------------------------------------------

    def gauge(self, reach: ReachSet) -> float:
        """Upper bound of the gauge of one set."""
        return float(self.gauges(ReachSets.one(reach))[0])

    def gauges(self, sets: ReachSets) -> Floats:
        """Upper bounds (K,) of the gauges of sets in the space of the target; infinite where a set is not bounded."""
        known = sets.are_finite
        if not known.all():
            out = np.full(len(sets), np.inf)
            if known.any():
                out[known] = self.gauges(sets[np.flatnonzero(known).tolist()])
            return out
        if self._faces is None:
            return self.quadric.gauges(sets)
        slack = self._slack(sets)
        worst = 1.0 - slack / self.distance
        # Rounding of the division must not turn a miss into a proof.
        worst = np.where(slack >= 0.0, np.minimum(worst, 1.0), np.maximum(worst, np.nextafter(1.0, 2.0)))
        gauges = np.asarray(np.where(np.isnan(worst), np.inf, worst).max(axis=1))
        return np.nextafter(gauges + self.box_gauges(sets.box), np.inf) if sets.box.any() else gauges

    def _slack(self, sets: ReachSets) -> Floats:
        """Lower bounds (K, f) of the distance of each set, without its box, from each face, in the face's unit."""
        n, p, generators = self.dim, sets.p, sets.generators
        size = np.abs(p).sum(axis=-1)
        q = np.einsum("fi,kin->kfn", self.A, p)
        spread = generator_sizes(self.A, generators)
        reach = sets.bounds.upper(q) + spread
        rounding = 4.0 * (n + 4) * UNIT * (size @ np.abs(self.A).T + spread)
        rounding += (size + generator_sizes(np.eye(n), generators)) @ self.dA.T * 1.001
        slack = self.b - (reach + rounding)
        return np.asarray(slack - 2.0 * UNIT * (np.abs(self.b) + np.abs(reach)))

    def binding(self, reach: ReachSet) -> tuple[int, float]:
        """The face that decides the gauge of one set.

        Returns
        -------
        (int, float)
            Its position, and how far the set reaches beyond it in its unit (negative: room); (-1, what is
            missing of the gauge) where the target has no faces.
        """
        if self._faces is None:
            return -1, self.gauge(reach) - 1.0
        slack = self._slack(ReachSets.one(reach))[0] - (np.abs(self.A) + self.dA) @ reach.box
        k = int(np.argmin(slack / self.distance))
        return k, -float(slack[k])

    def box_gauges(self, radius: Floats) -> Floats:
        """What adding a box of radii (K, n) can add to the gauge."""
        if self._faces is not None:
            reach = radius @ (np.abs(self.A) + self.dA).T * (1.0 + 4.0 * (self.dim + 2) * UNIT)
            return np.asarray((reach / self.distance).max(axis=1) * (1.0 + 4.0 * UNIT))
        return self.quadric.box_gauges(radius)

    def tube_gauges(self, sets: ReachSets, out: Floats) -> Floats:
        """Upper bounds (K - 1,) of the gauge on the way from each of K sets to the next.

        For each xi the way is within a box of radii out (K - 1, n) of the chord from p_k(xi) to
        p_k+1(xi), which a convex target contains with its ends; the p_k are known up to the boxes of the sets.
        """
        plain = self.gauges(sets.polynomials)
        return np.asarray(np.maximum(plain[:-1], plain[1:]) + self.box_gauges(out))

    def point_gauges(self, x: Floats, radius: Floats | None = None) -> Floats:
        """Float gauges (K, S) of points (K, S, n), or of boxes of radii (K, n) there: a proposal, not a bound."""
        if self._faces is not None:
            slack = self.b - x @ self.A.T
            gauges = (1.0 - slack / self.distance).max(axis=-1)
        else:
            gauges = np.sqrt((((x - self.centre) @ self.T.T) ** 2).sum(axis=-1))
        return np.asarray(gauges if radius is None else gauges + self.box_gauges(radius)[:, None])

    # -- separation ------------------------------------------------------------------------------

    def separated(self, lo: Floats, hi: Floats) -> NDArray[np.bool_]:
        """For boxes (K, n): True where the box provably has no point in the set."""
        known = np.asarray(np.isfinite(lo).all(axis=1) & np.isfinite(hi).all(axis=1))
        apart = self._separated(np.where(known[:, None], lo, 0.0), np.where(known[:, None], hi, 0.0))
        return np.asarray(known & apart)

    def _separated(self, lo: Floats, hi: Floats) -> NDArray[np.bool_]:
        n = self.dim
        if self._faces is not None:
            least = np.where(self.A > 0.0, self.A * lo[:, None, :], self.A * hi[:, None, :]).sum(axis=2)
            size = np.maximum(np.abs(lo), np.abs(hi))
            slack = 4.0 * (n + 2) * UNIT * (size @ np.abs(self.A).T) + size @ self.dA.T * 1.001
            up = np.nextafter(np.nextafter(self.b, np.inf), np.inf)
            return np.asarray((least - slack > up).any(axis=1))
        middle, radius = 0.5 * (lo + hi), 0.5 * (hi - lo)
        y = (middle - self.centre) @ self.T.T
        size = (np.maximum(np.abs(lo), np.abs(hi)) + np.abs(self.centre)) @ np.abs(self.T).T
        spread = radius @ np.abs(self.T).T + 8.0 * (n + 4) * UNIT * size
        nearest = np.maximum(0.0, np.abs(y) - spread)
        by_box = (nearest**2).sum(axis=1) * (1.0 - 8.0 * (n + 2) * UNIT)
        # The supporting half-space through the centre direction: |y| >= u'y for any unit u.
        length = np.maximum(np.sqrt((y**2).sum(axis=1)), 1e-300)
        along = length - (np.abs(y) * spread).sum(axis=1) / length * (1.0 + 8.0 * n * UNIT)
        along = np.maximum(0.0, along * (1.0 - 8.0 * (n + 4) * UNIT))
        return np.asarray(np.maximum(by_box, along**2 * (1.0 - 4.0 * UNIT)) > self.grow**2 * (1.0 + 4.0 * UNIT))
