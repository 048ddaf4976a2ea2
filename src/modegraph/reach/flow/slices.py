"""Boxes around what a flow passes, at instants and over intervals of time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.ranges import linear_bound
from modegraph.enclosure.rounding import UNIT
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.flow.flow import Flow
from modegraph.reach.reach_set import ReachSet

Floats = NDArray[np.float64]

CELL_WORK = 2e6
"""Bisections of one face times the size of the polynomial: the work spent on one bound."""
MOST_CELLS, LEAST_CELLS = 400, 20
DIRECTIONS = 64
"""Half-planes around a section that is drawn; a multiple of four."""
STRAIGHT = 1e-3
"""A polynomial whose nonlinear part has less than this share in its width is not bisected."""


class Slicer:
    """Slices of one flow, {p(xi) + e : |e| <= box}, in the coordinates of the states.

    Inside a step p(s) lies within ``bend`` of the chord of its ends, for the same xi, and the rest
    within ``tube``. On a part of a step the chord is within the hull of its own two ends.
    """

    def __init__(self, flow: Flow) -> None:
        self.flow = flow
        self.times = np.array([flow.steps[0].start, *(s.end for s in flow.steps)]) if flow.steps else np.zeros(1)
        sets = [flow.reach_set(k) for k in range(len(flow.steps) + 1)]
        self.p = np.stack([reach.p for reach in sets])
        self.z = np.stack([reach.spread for reach in sets])
        n = self.p.shape[1]
        lost = np.zeros((len(sets), n))
        if flow.frame is not None:
            # The last n generators are what rounding lost on the way out of the frame.
            lost = np.stack([np.abs(reach.G[-n:]).sum(axis=(0, 2)) for reach in sets])
        swell = np.array([flow.swell(step) for step in flow.steps]).reshape(-1, n)
        size = np.abs(self.p).sum(axis=2)
        # 16: the weight of a chord has two roundings, a combination of coefficients four more.
        rounding = 16.0 * UNIT * (size[:-1] + size[1:])
        self.swell = (swell + np.maximum(lost[:-1], lost[1:]) + rounding) * (1.0 + 8.0 * UNIT)

    def _slice(self, p: Floats, box: Floats) -> ReachSet:
        return ReachSet.of(self.flow.bounds, p).plus_box(box)

    def instant(self, k: int) -> ReachSet:
        return self._slice(self.p[k], self.z[k])

    def _chord(self, step: int, t: float) -> Floats:
        a, b = self.times[step], self.times[step + 1]
        if t in (a, b):
            return np.asarray(self.p[step if t == a else step + 1])
        return np.asarray(self.p[step] + (t - a) / (b - a) * (self.p[step + 1] - self.p[step]))

    def at(self, t: float) -> ReachSet:
        """The slice at an instant the flow covers."""
        k = int(np.searchsorted(self.times, t))
        if self.times[k] == t:
            return self.instant(k)
        return self._slice(self._chord(k - 1, t), self.swell[k - 1])

    def support(self, k: int, dims: tuple[int, int], directions: Floats) -> Floats:
        """Upper bounds (h,) of u . (two states) at instant k over vectors u (h, 2)."""
        return self.flow.reach_set(k).select(dims).support(directions)

    def over(self, t0: float, t1: float) -> list[ReachSet]:
        """Slices whose common hull holds everything passed in [t0, t1], t0 < t1, within the flow."""
        first = int(np.searchsorted(self.times, t0, side="right")) - 1
        last = int(np.searchsorted(self.times, t1)) - 1
        slices = [self._slice(self._chord(first, t0), self.swell[first])]
        slices += [
            self._slice(self.p[k], np.maximum(self.swell[k - 1], self.swell[k])) for k in range(first + 1, last + 1)
        ]
        return [*slices, self._slice(self._chord(last, t1), self.swell[last])]

    def steps(self) -> tuple[Floats, Floats]:
        """Quick boxes (steps, n) of each closed step."""
        lo, hi = self.flow.bounds.ranges(self.p)
        below = np.minimum(lo[:-1], lo[1:]) - self.swell
        above = np.maximum(hi[:-1], hi[1:]) + self.swell
        return np.nextafter(below, -np.inf), np.nextafter(above, np.inf)


def outline(slicer: Slicer, k: int, dims: tuple[int, int]) -> Floats:
    """A polygon (v, 2) around two states at instant k: where half-planes in many directions meet."""
    from scipy.spatial import ConvexHull, HalfspaceIntersection

    angles = np.arange(DIRECTIONS) * (2.0 * np.pi / DIRECTIONS)
    u = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    h = slicer.support(k, dims, u)
    middle = 0.5 * np.array([h[0] - h[DIRECTIONS // 2], h[DIRECTIONS // 4] - h[3 * DIRECTIONS // 4]])
    # A set without width is drawn with a little.
    h = np.maximum(h - u @ middle, 1e-9 * (np.abs(h).max() + 1e-300))
    corners = HalfspaceIntersection(np.column_stack([u, -h]) / h.max() * [h.max(), h.max(), 1.0], np.zeros(2))
    points = corners.intersections * h.max()
    return np.asarray(points[ConvexHull(points).vertices] + middle)


def hull(slices: Sequence[ReachSet]) -> tuple[Floats, Floats]:
    """Box (lo, hi), each (n,), around slices of any flows; only what decides a face is bisected."""
    n = slices[0].dim
    lo, hi = np.zeros(n), np.zeros(n)
    lows, highs = [], []
    straight = []
    for s in slices:
        below, above = s.bounds.ranges(s.p)
        lows.append(-below)
        highs.append(above)
        nl, nh = s.bounds.nonlinear_radius(s.p)
        straight.append(nh - nl <= STRAIGHT * (above - below))
    for i in range(n):
        flat = [bool(row[i]) for row in straight]
        hi[i] = _face(slices, i, 1.0, [float(row[i]) for row in highs], flat)
        lo[i] = -_face(slices, i, -1.0, [float(row[i]) for row in lows], flat)
    return lo, hi


def _face(slices: Sequence[ReachSet], i: int, sign: float, quick: Sequence[float], flat: Sequence[bool]) -> float:
    """The largest of sign * state i over all slices, rounded up."""
    out = [float(s.box[i]) for s in slices]
    tops = [float(np.nextafter(q + o, np.inf)) for q, o in zip(quick, out, strict=True)]
    best = -np.inf
    for k in sorted(range(len(slices)), key=lambda k: -tops[k]):
        if tops[k] <= best:
            break
        top = tops[k]
        if not flat[k]:
            finer = _refined(slices[k].bounds, sign * slices[k].p[i], best - out[k])
            top = min(top, float(np.nextafter(finer + out[k], np.inf)))
        best = max(best, top)
    return best


def _refined(bounds: PolynomialBounds, p: Floats, limit: float) -> float:
    """Upper bound of one polynomial (N,), bisected until it is at most ``limit``."""
    m = bounds.piece.variables
    cells = int(np.clip(CELL_WORK / (len(bounds.exponents) * max(1, m * m)), LEAST_CELLS, MOST_CELLS))
    best = bounds.refined_upper(p, limit, cells)
    if bounds.piece.chart.round:
        # Bisection knows the box around the ball only.
        linear = bounds.linear_part(p)
        rest = p.copy()
        rest[bounds.linear] = 0.0
        straight = float(linear_bound(linear, *bounds.piece.ball))
        total = straight + bounds.refined_upper(rest, limit - straight, cells)
        best = min(best, float(np.nextafter(total, np.inf)))
    return best
