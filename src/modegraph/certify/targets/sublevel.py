"""A sublevel set as a target: its function is composed with the polynomials of a reach set.

fn(p(xi) + e), e the remainder, is enclosed as a polynomial in xi again, so what the coordinates have in
common is kept, and no shape of the target is assumed. The gauge is (fn - least) / (level - least),
``least`` the smallest value found: one minus the margin.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.samples import points_of, sample_variables
from modegraph.certify.targets.region import Region
from modegraph.enclosure.monomials import monomial_count, monomials
from modegraph.enclosure.rounding import TINY, UNIT
from modegraph.errors import ModegraphError
from modegraph.expression.evaluate import Evaluator
from modegraph.expression.tape import Tape
from modegraph.model.sets import Set, Sublevel
from modegraph.model.sets.level_search import all_outside
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.generators import generator_box
from modegraph.reach.pointwise import evaluate_over
from modegraph.reach.reach_set import ReachSet, ReachSets

Floats = NDArray[np.float64]

DEGREES, MOST_MONOMIALS = (4, 3, 2), 500
"""Degrees of the composition that are tried, the first that makes no more monomials than this."""
REFINED = 3
"""Instants for which a bound that misses is bisected."""
ABOVE_ONE = float(np.nextafter(1.0, 2.0))


def target_region(target: Set) -> Region:
    """The region of any target set."""
    return SublevelRegion(target) if isinstance(target, Sublevel) else Region(target)


class SublevelRegion(Region):
    """Gauges and separation for {x : fn(x) <= level}."""

    def __init__(self, target: Sublevel) -> None:
        if target.is_empty():
            raise ModegraphError(f"the target {target!r} is empty: no point with fn <= level was found")
        self.set = target
        self.dim = target.dim
        self.function = target.function
        self.level = target.level
        self.centre = target.center
        self.distance = np.array([max(target.level - target.lowest, 1e-300)])
        self._inner = None if target.ellipsoids is None else Region(target.ellipsoids[0])
        self._offsets = np.array([float(part.offset) for part in self.function.parts])

    # -- containment -----------------------------------------------------------------------------

    def gauges(self, sets: ReachSets) -> Floats:
        sets = sets.without_boxes
        out = self._sampled(sets)
        hopeful = np.flatnonzero(out <= 1.0).tolist()
        if not hopeful:
            return out
        if self._inner is not None:
            # |y| <= 1 in the ellipsoid within is a proof; fn grows with its square.
            inner = self._inner.gauges(sets[hopeful])
            out[hopeful] = np.where(inner <= 1.0, np.minimum(inner * inner * (1.0 + 4.0 * UNIT), 1.0), inner)
            return out
        composed = _Composition(self, sets.bounds)
        missed: list[tuple[float, int, Floats, Floats]] = []
        for k in hopeful:
            tops, polynomials, rest = composed.tops(sets[k])
            out[k] = self._gauge(tops)
            if out[k] > 1.0:
                missed.append((float(out[k]), k, polynomials, rest))
        if len(missed) == len(hopeful):
            for _, k, polynomials, rest in sorted(missed, key=lambda m: m[:2])[:REFINED]:
                out[k] = min(out[k], self._gauge(composed.refined(polynomials, rest, self.function.bounds[0])))
        return out

    def _sampled(self, sets: ReachSets) -> Floats:
        """Float gauges (K,) of the worst sampled point, none at or below 1 unless all samples are inside."""
        points = points_of(sets, np.vstack([np.zeros((1, sets.piece.variables)), sample_variables(sets.piece)]))
        known = np.asarray(np.isfinite(points).all(axis=(1, 2)))
        gauges = self.point_gauges(np.where(known[:, None, None], points, 0.0)).max(axis=1)
        return np.where(known & (gauges <= 1.0), 0.0, np.where(known, np.maximum(gauges, ABOVE_ONE), np.inf))

    def _gauge(self, tops: Floats) -> float:
        """Gauge from upper bounds (parts,) of the parts: at most 1 only where each is proved to hold."""
        inside = bool((tops <= self.function.bounds[0]).all())
        value = float(self.function.totals(tops[:, None], self._offsets)[0])
        gauge = 1.0 - (self.level - value) / float(self.distance[0])
        if inside:
            return min(gauge, 1.0) if np.isfinite(gauge) else 1.0
        return max(gauge, ABOVE_ONE) if np.isfinite(gauge) else np.inf

    def binding(self, reach: ReachSet) -> tuple[int, float]:
        return -1, (self.gauge(reach) - 1.0) * float(self.distance[0])

    def tube_gauges(self, sets: ReachSets, out: Floats) -> Floats:
        # No convexity: the chord itself is a generator around its middle.
        p = sets.p
        middle, half = 0.5 * (p[:-1] + p[1:]), 0.5 * (p[1:] - p[:-1])
        lost = 4.0 * UNIT * (np.abs(p[:-1]) + np.abs(p[1:])).sum(axis=2)
        if sets.box.any():
            lost = lost + np.maximum(sets.box[:-1], sets.box[1:]) * (1.0 + 8.0 * UNIT)
        return self.gauges(ReachSets(sets.bounds, middle, [h[None] for h in half], out + lost))

    def point_gauges(self, x: Floats, radius: Floats | None = None) -> Floats:
        flat = x.reshape(-1, self.dim)
        value = self.function.values(flat)
        if radius is not None and self._slopes is not None:
            slopes = np.abs(self._slopes(np.ascontiguousarray(flat.T))).reshape(len(self._offsets), self.dim, -1)
            spread = np.repeat(radius, x.shape[1], axis=0)
            value = value + np.nan_to_num((slopes * spread.T).sum(axis=1).max(axis=0))
        return np.asarray(1.0 - (self.level - value) / self.distance[0]).reshape(x.shape[:-1])

    @cached_property
    def _slopes(self) -> Evaluator | None:
        return None if self.function.gradient is None else Evaluator(self.function.gradient)

    # -- separation ------------------------------------------------------------------------------

    def _separated(self, lo: Floats, hi: Floats) -> NDArray[np.bool_]:
        apart = self.function.outside(lo, hi)
        for k in np.flatnonzero(~apart):
            apart[k] = all_outside(self.function, lo[k], hi[k])
        return apart


class _Composition:
    """fn after the polynomials of one piece, in a table that holds its nonlinear terms too."""

    def __init__(self, region: SublevelRegion, bounds: PolynomialBounds) -> None:
        m = bounds.piece.variables
        degree = int(bounds.exponents.sum(axis=1).max(initial=0))
        fitting = [d for d in DEGREES if monomial_count((1,) * m, d) <= MOST_MONOMIALS]
        table = monomials((1,) * m, max([degree, *fitting[:1]]))
        function = region.function
        self.parts, self.dim = len(function.parts), region.dim
        self.size = table.size
        self.bounds = PolynomialBounds(bounds.piece, table, table.size)
        self.value, self.slope = function.tape, function.gradient
        self.table = table
        self.limit = function.bounds[0]

    def tops(self, reach: ReachSet) -> tuple[Floats, Floats, Floats]:
        """Upper bounds (parts,) over a set without a box, from polynomials and radii, returned too."""
        G = reach.G
        inputs = np.zeros((self.dim, self.size))
        inputs[:, : reach.p.shape[1]] = reach.p
        box = generator_box(G) if len(G) else np.zeros(self.dim)
        polynomials, rest, undefined = self._over(self.value, inputs, box)
        polynomials, rest = polynomials[: self.parts], rest[: self.parts]
        if undefined >= 0:
            return np.full(self.parts, np.inf), polynomials, np.full(self.parts, np.inf)
        tops = self._tops(polynomials, rest)
        if box.any() and self.slope is not None and not (tops <= self.limit).all():
            along, without = self._first_order(inputs, G, box)
            better = self._tops(along, without)
            # Keep the pair with the smaller bound, part by part.
            chosen = better < tops
            tops = np.where(chosen, better, tops)
            polynomials = np.where(chosen[:, None], along, polynomials)
            rest = np.where(chosen, without, rest)
        return tops, polynomials, rest

    def _over(self, tape: Tape, inputs: Floats, radius: Floats) -> tuple[Floats, Floats, int]:
        return evaluate_over(tape, self.table, self.table.order, inputs, radius)

    def _tops(self, polynomials: Floats, rest: Floats) -> Floats:
        tops = self.bounds.upper(polynomials) + rest
        tops = tops + 4.0 * UNIT * (np.abs(tops) + rest) + TINY
        return np.asarray(np.where(np.isnan(tops), np.inf, tops))

    def _first_order(self, inputs: Floats, G: Floats, box: Floats) -> tuple[Floats, Floats]:
        """fn(p) and |fn'(p + [0, 1] e) e|, e the remainder: generators keep what coordinates have in common."""
        assert self.slope is not None
        polynomials, rest, _ = self._over(self.value, inputs, np.zeros(self.dim))
        slopes, off, _ = self._over(self.slope, inputs, box)
        slopes, off = slopes.reshape(self.parts, self.dim, -1), off.reshape(self.parts, self.dim)
        head = slopes[:, :, 0]
        straight = np.abs(np.einsum("fi,gin->fgn", head, G)).sum(axis=(1, 2))
        bent = (np.abs(slopes[:, :, 1:]).sum(axis=2) + off) @ box
        rounding = 8.0 * (self.dim + G.size + self.size + 8) * UNIT * (np.abs(head) @ box + bent + straight)
        total = rest[: self.parts] + straight + bent + rounding
        return polynomials[: self.parts], np.where(np.isnan(total), np.inf, total * (1.0 + 8.0 * UNIT) + TINY)

    def refined(self, polynomials: Floats, rest: Floats, limits: Floats) -> Floats:
        """Better upper bounds (parts,) by bisection over the piece."""
        tops = self._tops(polynomials, rest)
        for i in np.flatnonzero(~(tops <= limits)):
            if np.isfinite(rest[i]) and np.isfinite(limits[i]) and np.isfinite(polynomials[i]).all():
                room = limits[i] - rest[i]
                room -= 8.0 * UNIT * (abs(limits[i]) + rest[i])
                top = self.bounds.refined_upper(polynomials[i], room)
                if top <= room:
                    tops[i] = min(tops[i], limits[i])
        return tops
