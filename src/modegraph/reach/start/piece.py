"""Start sets as polynomials: every start is c + L xi for one xi in the domain of a piece.

A piece is a box of xi (and of the unknown constants), cut with the unit ball for Ball and Ellipsoid
starts, with the faces for Polytopes, and to what may be inside for Sublevels. Pieces are what
splitting makes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.rounding import UNIT
from modegraph.errors import ModegraphError
from modegraph.expression.tape import Tape
from modegraph.model.sets.ball import Ball
from modegraph.model.sets.base import Set
from modegraph.model.sets.box import Box
from modegraph.model.sets.ellipsoid import Ellipsoid
from modegraph.model.sets.polytope import Polytope
from modegraph.model.sets.sublevel import Sublevel
from modegraph.model.sets.zonotope import Zonotope
from modegraph.reach.field import cover

Floats = NDArray[np.float64]

POINTS = 48
"""Points of a Sublevel that are looked for in a piece."""
UNDERFLOW = 2.0**-1000
"""More than any sum of products can lose below the normal range."""


@dataclass(frozen=True)
class Chart:
    """{c + L xi : xi in [-1, 1]^m}, optionally |xi|_2 <= 1, encloses a start set; plus the unknowns.

    ``faces`` (A, b): A xi <= b holds for every start, for Polytopes (rounded outward).
    """

    centre: Floats
    axes: Floats
    round: bool
    faces: tuple[Floats, Floats] | None
    unknown_lo: Floats
    unknown_hi: Floats
    original: bool = True
    """The starts themselves, not a later reach set."""
    sublevel: Sublevel | None = None
    """Only points of this set count; the axes are then parallel to the coordinates."""
    parameters: int = 0
    """How many of the unknowns, the last ones, are parameters of a class of references."""
    form: Tape | None = None
    """The starts as a function of xi and the parameters; centre and axes are then those of one reference."""
    rounded: Floats | None = None
    """(n,): with a form, what the starts may differ by when they are computed in floats."""
    tilt: Floats | None = None
    """(n, uncertain unknowns): c moves by this for each of them scaled to [-1, 1]."""

    @property
    def free(self) -> int:
        """Number m of variables of the start itself."""
        return self.axes.shape[1]

    def around(self, centre: Floats, axes: Floats, original: bool) -> Chart:
        """A chart of the parallelotope centre + axes [-1, 1]^k, with the same unknowns."""
        return Chart(centre, axes, False, None, self.unknown_lo, self.unknown_hi, original, parameters=self.parameters)

    def box(self, lo: Floats, hi: Floats) -> tuple[Floats, Floats]:
        """A box of states that holds c + L xi for lo <= xi <= hi, for axes parallel to the coordinates."""
        weight = self.axes.sum(axis=1)
        place = np.abs(self.axes) > 0.0
        low, high = (np.where(place, side, 0.0).sum(axis=1) for side in (lo, hi))
        slack = np.where(place.any(axis=1), 4.0 * UNIT * (np.abs(self.centre) + weight), 0.0)
        return self.centre + weight * low - slack, self.centre + weight * high + slack


@dataclass(frozen=True)
class Piece:
    """A part of the start set and of the unknowns: lo <= (xi, unknowns scaled to [-1, 1]) <= hi.

    Unknown constants with lo = hi are no variables.
    """

    chart: Chart
    lo: Floats
    hi: Floats
    depth: int = 0

    @classmethod
    def whole(cls, chart: Chart) -> Piece:
        """All of a chart."""
        m = chart.free + int((chart.unknown_lo < chart.unknown_hi).sum())
        return cls(chart, -np.ones(m), np.ones(m))

    @cached_property
    def uncertain(self) -> NDArray[np.int64]:
        """Indices of the unknown constants that are not known exactly."""
        return np.flatnonzero(self.chart.unknown_lo < self.chart.unknown_hi)

    @property
    def variables(self) -> int:
        return len(self.lo)

    @cached_property
    def middle(self) -> Floats:
        return cover(self.lo, self.hi)[0]

    @cached_property
    def radius(self) -> Floats:
        return cover(self.lo, self.hi)[1]

    @cached_property
    def points(self) -> Floats:
        """Some starts (k, m) of a Sublevel in this piece, scaled to [-1, 1] (floats); k = 0: none was found."""
        chart = self.chart
        assert chart.sublevel is not None
        m, axis = chart.free, chart.axes.argmax(axis=0)
        box = chart.box(self.lo[:m], self.hi[:m])
        xi = chart.sublevel.draw_within(POINTS, np.random.default_rng(7), *box)[:, axis] - chart.centre[axis]
        eta = (xi / chart.axes.sum(axis=0) - self.middle[:m]) / np.maximum(self.radius[:m], 1e-300)
        return np.asarray(np.clip(eta, -1.0, 1.0))

    def polynomials(self, linear: NDArray[np.int64], size: int) -> tuple[Floats, Floats, Floats]:
        """States (n, size), unknowns (nd, size) over the monomial table, and a rounding box (n,).

        The variables of the table are the piece scaled to [-1, 1]; ``linear`` are their monomials.
        """
        chart = self.chart
        m = chart.free
        n = len(chart.centre)
        states = np.zeros((n, size))
        states[:, 0] = chart.centre + chart.axes @ self.middle[:m]
        for v in range(m):
            states[:, linear[v]] = chart.axes[:, v] * self.radius[v]
        extent = np.abs(chart.centre) + np.abs(chart.axes).sum(axis=1)
        used = m
        if chart.tilt is not None:
            used = self.variables
            states[:, 0] += chart.tilt @ self.middle[m:]
            for v in range(m, used):
                states[:, linear[v]] = chart.tilt[:, v - m] * self.radius[v]
            extent = extent + np.abs(chart.tilt).sum(axis=1)
        slack = extent * (used + 4) * 2.0 * UNIT
        exact = (self.middle[:used] == 0.0) & (self.radius[:used] == 1.0)
        if exact.all():
            slack = np.zeros(n)
        unknowns = np.zeros((len(chart.unknown_lo), size))
        unknowns[:, 0] = chart.unknown_lo
        for k, i in enumerate(self.uncertain):
            lo, hi = self.unknown_range(int(i))
            centre, radius = cover(np.array([lo]), np.array([hi]))
            unknowns[i, 0] = centre[0]
            unknowns[i, linear[m + k]] = radius[0]
        return states, unknowns, slack

    def unknown_range(self, i: int) -> tuple[float, float]:
        """Interval of unknown i in this piece, rounded outward."""
        lo, hi = float(self.chart.unknown_lo[i]), float(self.chart.unknown_hi[i])
        if lo == hi:
            return lo, hi
        k = self.chart.free + int(np.searchsorted(self.uncertain, i))
        a, b = float(self.lo[k]), float(self.hi[k])
        left = lo if a == -1.0 else np.nextafter(lo + 0.5 * (a + 1.0) * (hi - lo), -np.inf)
        right = hi if b == 1.0 else np.nextafter(lo + 0.5 * (b + 1.0) * (hi - lo), np.inf)
        slack = 4.0 * UNIT * max(abs(lo), abs(hi))
        left = lo if a == -1.0 else max(lo, left - slack)
        right = hi if b == 1.0 else min(hi, right + slack)
        return float(left), float(right)

    @cached_property
    def unknown_ranges(self) -> tuple[Floats, Floats]:
        """Intervals (lo, hi), each (nd,), of all unknowns in this piece, rounded outward."""
        ranges = np.array([self.unknown_range(i) for i in range(len(self.chart.unknown_lo))]).reshape(-1, 2)
        return ranges[:, 0], ranges[:, 1]

    @property
    def known(self) -> bool:
        """Whether a start in this piece is known: of a Sublevel, that one was found (floats)."""
        return self.chart.sublevel is None or len(self.points) > 0

    def split(self, variable: int) -> list[Piece]:
        """Two halves along one variable, tightened; a half that holds no start is left out."""
        middle = 0.5 * (self.lo[variable] + self.hi[variable])
        halves = []
        for side in (0, 1):
            lo, hi = self.lo.copy(), self.hi.copy()
            (hi if side == 0 else lo)[variable] = middle
            piece = replace(self, lo=lo, hi=hi, depth=self.depth + 1).tightened()
            if piece is not None:
                halves.append(piece)
        return halves

    def tightened(self) -> Piece | None:
        """The smallest box around what the ball or the faces leave of it; None if nothing is left."""
        m = self.chart.free
        lo, hi = self.lo.copy(), self.hi.copy()
        if self.chart.round:
            nearest = np.maximum(0.0, np.maximum(lo[:m], -hi[:m]))
            square = nearest**2 * (1.0 - 4.0 * UNIT)
            total = square.sum() * (1.0 - 2.0 * m * UNIT)
            if total > 1.0:
                return None
            room = np.sqrt(np.maximum(0.0, 1.0 - (total - square) * (1.0 - 4.0 * UNIT) + 8.0 * m * UNIT))
            room = room * (1.0 + 4.0 * UNIT)
            lo[:m] = np.maximum(lo[:m], -room)
            hi[:m] = np.minimum(hi[:m], room)
        if self.chart.faces is not None:
            A, b = self.chart.faces
            for _ in range(3):
                for a, bound in zip(A, b, strict=True):
                    low = np.where(a > 0.0, a * lo[:m], a * hi[:m])
                    slack = 4.0 * (m + 2) * UNIT * (np.abs(a).sum() + abs(bound)) + UNDERFLOW
                    if low.sum() - slack > bound:
                        return None
                    for v in np.flatnonzero(np.abs(a) > np.sqrt(UNDERFLOW)):
                        rest = (bound + slack - (low.sum() - low[v])) / a[v]
                        rest += np.sign(a[v]) * 4.0 * UNIT * (abs(rest) + 1.0)
                        if a[v] > 0.0:
                            hi[v] = min(hi[v], rest)
                        else:
                            lo[v] = max(lo[v], rest)
        if self.chart.sublevel is not None and not self._cut_to(self.chart.sublevel, lo, hi):
            return None
        if (lo > hi).any():
            return None
        return replace(self, lo=lo, hi=hi)

    def _cut_to(self, start: Sublevel, lo: Floats, hi: Floats) -> bool:
        """Shrink lo, hi (in place) around what may lie in the set; False if that is nothing."""
        chart = self.chart
        below, above = chart.box(lo[: chart.free], hi[: chart.free])
        hull = start.hull_within(below, above)
        if hull is None:
            return False
        for v, k in enumerate(chart.axes.argmax(axis=0).tolist()):
            centre, radius = chart.centre[k], chart.axes[k, v]
            slack = 8.0 * UNIT * (abs(centre) + radius) / radius
            if hull[0][k] > below[k]:
                lo[v] = max(lo[v], (hull[0][k] - centre) / radius - slack)
            if hull[1][k] < above[k]:
                hi[v] = min(hi[v], (hull[1][k] - centre) / radius + slack)
        return True

    @cached_property
    def ball(self) -> tuple[Floats, Floats]:
        """(radius, middle): the variables of a round start are middle + radius eta, in the unit ball; else nothing."""
        m = self.chart.free if self.chart.round else 0
        return np.maximum(self.radius[:m], 1e-300), self.middle[:m].copy()


def whole(start: Set, unknowns: Sequence[tuple[float, float]], parameters: int = 0) -> Piece:
    """The piece that covers a bounded start set and all unknown constants, of which the last may be parameters."""
    cut: Sublevel | None = None
    if isinstance(start, Sublevel):
        if start.ellipsoids is None:
            cut = start
        else:
            start = start.ellipsoids[1]
    centre, axes, ball, faces = _chart(start)
    lo = np.array([u[0] for u in unknowns], float)
    hi = np.array([u[1] for u in unknowns], float)
    chart = Chart(centre, axes, ball, faces, lo, hi, sublevel=cut, parameters=parameters)
    piece = Piece.whole(chart).tightened()
    if piece is None:
        raise ModegraphError("the start set is empty: no edge can be proved from it")
    return piece


def point(x0: Floats, unknowns: Sequence[float] | Floats) -> Piece:
    """One start with known constants: no variable at all."""
    values = np.asarray(unknowns, float)
    chart = Chart(np.asarray(x0, float), np.zeros((len(x0), 0)), False, None, values, values)
    return Piece(chart, np.zeros(0), np.zeros(0))


def _chart(start: Set) -> tuple[Floats, Floats, bool, tuple[Floats, Floats] | None]:
    if isinstance(start, Ball):
        n = start.dim
        axes = np.eye(n) * float(start.radius)
        return np.array(start.c, float), axes if start.radius > 0 else np.zeros((n, 0)), True, None
    if isinstance(start, Ellipsoid):
        return np.array(start.c, float), ellipsoid_axes(start), True, None
    if isinstance(start, Zonotope):
        generators = np.array(start.generators, float)
        return np.array(start.c, float), generators[:, np.abs(generators).sum(axis=0) > 0], False, None
    lo, hi = (np.asarray(side, float) for side in start.bounding_box())
    centre, radius = cover(lo, hi)
    free = np.flatnonzero(radius > 0.0)
    axes = np.diag(radius)[:, free]
    faces = None
    if isinstance(start, Polytope):
        A, b = _scaled_faces(np.array(start.A, float), np.array(start.b, float))
        scaled = A @ axes
        size = np.abs(A) @ (np.abs(centre) + radius)
        bound = b - A @ centre
        # Relative rounding, and an absolute allowance for products below the normal range.
        faces = scaled, bound + 8.0 * (len(lo) + 4) * UNIT * (size + np.abs(b)) + UNDERFLOW
    elif not isinstance(start, (Box, Sublevel)):
        raise ModegraphError(
            f"a {type(start).__name__} cannot be a start set; use a Box, Ball, Ellipsoid, Zonotope, Polytope or "
            "Sublevel"
        )
    return centre, axes, False, faces


def _scaled_faces(A: Floats, b: Floats) -> tuple[Floats, Floats]:
    """The same faces with rows of size near one: exact multiplications by powers of two."""
    top = np.abs(A).max(axis=1, initial=0.0)
    keep = top > 0.0
    A, b = A[keep], b[keep]
    shift = -np.frexp(top[keep])[1]
    with np.errstate(over="ignore"):
        scaled, bound = np.ldexp(A, shift[:, None]), np.ldexp(b, shift)
    # A bound too large for a double cuts nothing; entries lost far below the largest are an allowance.
    lost = np.abs(np.ldexp(scaled, -shift[:, None]) - A).max(axis=1) > 0.0
    fine = np.isfinite(bound) & ~lost
    return scaled[fine], bound[fine]


def ellipsoid_axes(start: Ellipsoid) -> Floats:
    """L with shape <= L L' (so that c + L (unit ball) covers the ellipsoid), floats checked upward."""
    shape = np.array(start.shape, float)
    diagonal = np.diag(shape)
    if not (shape - np.diag(diagonal)).any():
        return np.diag(np.nextafter(np.sqrt(diagonal), np.inf))
    scale = np.sqrt(diagonal)
    L = scale[:, None] * np.linalg.cholesky(shape / np.outer(scale, scale))
    T = np.linalg.inv(L)
    # lambda_max(T shape T') <= |T shape T'|_inf; the product itself is off by gamma(2 n) |T||shape||T'|.
    n = len(scale)
    product = T @ shape @ T.T
    error = 4.0 * n * UNIT * (np.abs(T) @ np.abs(shape) @ np.abs(T.T))
    largest = float((np.abs(product) + error).sum(axis=1).max()) * (1.0 + 8.0 * n * UNIT)
    # |L^-1 y| <= |(T L)^-1| |T y| and |(T L)^-1|_2 <= 1 / (1 - |T L - I|_2).
    miss = np.abs(T @ L - np.eye(n)) + 2.0 * n * UNIT * (np.abs(T) @ np.abs(L))
    off = float(miss.sum(axis=1).max()) * np.sqrt(n) * (1.0 + 8.0 * n * UNIT)
    growth = 1.0 / (1.0 - off) if off < 0.01 else np.nan
    if not np.isfinite(growth):
        raise ModegraphError("the ellipsoid's shape is too close to singular; scale its coordinates")
    return np.asarray(L * (np.sqrt(largest) * growth * (1.0 + 1e-12)))
