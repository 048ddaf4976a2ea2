"""How far start sets reach beyond a target, from below and from above, over boxes of pairs of references.

Numbers are rounded outward by more than formula and set in floats differ: what is below 0 or above it is so for
both. What is astride 0 is left to exact arithmetic.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from fractions import Fraction
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.switching.start_family import Functions, StartFamily
from modegraph.certify.targets.region import Region
from modegraph.enclosure.inclusions import distances, excesses
from modegraph.enclosure.rounding import TINY, UNIT
from modegraph.expression.scalar import Expr
from modegraph.model.sets import Box, Polytope, Zonotope, exact

Floats = NDArray[np.float64]
Boxes = tuple[Floats, Floats]

ROUNDED = 1e-11
"""More than the roundings of a norm, relative."""
MOST_CORNERS = 256
"""Of a flat set in a round one that are looked at one by one."""
CHUNK = 2**20
HALVINGS = 60


class Never(Exception):
    """No pair of references has its start set inside the target."""


class Fit(Protocol):
    def excess(self, source: Boxes, target: Boxes) -> tuple[Floats, Floats]:
        """For boxes (B, ki) x (B, kj) bounds (B,): at most 0 from above where every pair of a box is inside,
        above 0 from below where none is."""

    def excess_of_pairs(self, source: Floats, target: Floats) -> tuple[Floats, Floats]:
        """The same of single pairs (B, ki), (B, kj), faster."""

    def gauges(self, source: Floats, target: Floats) -> Floats:
        """Upper bounds (B,) of how far the sets reach, in sizes of the target."""


def fit_of(source: StartFamily, target: StartFamily) -> Fit:
    """Raises `Never` where it is proved that no pair fits."""
    return RoundFit(source, target) if target.shape.round else FlatFit(source, target)


# -- flat targets ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Face:
    """direction'x <= bound(q); ``limit``: the distance from the centre; ``plain``: the bound is written in numbers."""

    direction: exact.Row
    bound: Expr
    limit: Expr
    plain: bool


class FlatFit:
    def __init__(self, source: StartFamily, target: StartFamily) -> None:
        open_: list[tuple[Expr, Expr, _Face]] = []
        settled = 0.0
        for face in _faces(target):
            low, high = _support(source, face.direction)
            used = [k for k, v in enumerate(face.direction) if v]
            numbers = face.plain and source.plain[used].all()
            if numbers and high.value <= face.bound.value:
                share = (high.value - face.bound.value) / face.limit.value if face.limit.value > 0 else Fraction(0)
                settled = max(settled, 1.0 + exact.round_up(share))
                continue
            if numbers and low.value > face.bound.value:
                raise Never
            open_.append((low, high, face))
        self.settled = settled
        self.count = len(open_)
        faces = [face for _, _, face in open_]
        size = np.array([[abs(float(v)) for v in face.direction] for face in faces]).reshape(-1, source.dim)
        self.allowance = (size @ (source.allowance + target.allowance)) * 2.0 + TINY
        self._lower = source.functions([low for low, _, _ in open_])
        same = all(low.same(high) for low, high, _ in open_)
        self._upper = self._lower if same else source.functions([high for _, high, _ in open_])
        self._bounds = target.functions([face.bound for face in faces])
        self._limits = target.functions([face.limit for face in faces])
        self._refuse_widths(source, target, open_)

    def _refuse_widths(self, source: StartFamily, target: StartFamily, open_: list[tuple[Expr, Expr, _Face]]) -> None:
        """What is wider than the target, wherever both are, fits nowhere."""
        pairs = [
            (a, b) for a, b in itertools.combinations(range(len(open_)), 2)
            if all(v == -w for v, w in zip(open_[a][2].direction, open_[b][2].direction, strict=True))
        ]  # fmt: skip
        if not pairs:
            return
        own = source.functions([open_[a][0] + open_[b][0] for a, b in pairs]).ranges(*source.bounds())[0]
        room = target.functions([open_[a][2].bound + open_[b][2].bound for a, b in pairs]).ranges(*target.bounds())[1]
        lost = np.array([self.allowance[a] + self.allowance[b] for a, b in pairs])
        if _beyond(own, room, -lost)[0].max() > 0.0:
            raise Never

    def excess(self, source: Boxes, target: Boxes) -> tuple[Floats, Floats]:
        if not self.count:
            return np.full(len(source[0]), -np.inf), np.full(len(source[0]), -np.inf)
        low, high = self._lower.ranges(*source)
        if self._upper is not self._lower:
            high = self._upper.ranges(*source)[1]
        least, most = self._bounds.ranges(*target)
        return _beyond(low, most, -self.allowance).max(axis=1), _beyond(high, least, self.allowance).max(axis=1)

    def excess_of_pairs(self, source: Floats, target: Floats) -> tuple[Floats, Floats]:
        line, bound = self._upper.line, self._bounds.line
        if not self.count or self._upper is not self._lower or line is None or bound is None:
            return self.excess((source, source), (target, target))
        low, high = excesses(np.ascontiguousarray(source), np.ascontiguousarray(target), *line, *bound, self.allowance)
        return low, high

    def gauges(self, source: Floats, target: Floats) -> Floats:
        gauge = np.full(len(source), self.settled)
        if self.count:
            over = _beyond(
                self._upper.ranges(source, source)[1], self._bounds.ranges(target, target)[0], self.allowance
            )
            limits = self._limits.ranges(target, target)[1]
            with np.errstate(divide="ignore", invalid="ignore"):
                own = np.where(limits > 0.0, 1.0 + over / limits, np.where(over > 0.0, np.inf, 0.0))
            gauge = np.maximum(gauge, (own + 4.0 * UNIT).max(axis=1))
        return gauge


def _beyond(reach: Floats, bound: Floats, allowance: Floats) -> Floats:
    """reach - bound + allowance, rounded in the direction of the allowance."""
    error = 4.0 * UNIT * (np.abs(reach) + np.abs(bound))
    return np.asarray(reach - bound + (allowance + np.where(allowance >= 0.0, error, -error)))


def _faces(target: StartFamily) -> list[_Face]:
    shape, graph, n = target.shape, target.graph, target.dim
    if shape.kind is Box:
        found = []
        for k in range(n):
            for s in (1, -1):
                direction = [Fraction(s) if i == k else Fraction(0) for i in range(n)]
                half = shape.axes[k][k]
                found.append(_Face(direction, shape.centre[k] * s + half, half, bool(target.plain[k])))
        return found
    if shape.kind is Polytope:
        faces, middle = target.own(np.zeros(0)).faces(), [e.value for e in shape.centre]
    else:
        if not all(e.is_constant and Fraction(float(e.value)) == e.value for row in shape.axes for e in row):
            raise Never
        faces = Zonotope(np.zeros(n), [[float(e.value) for e in row] for row in shape.axes]).faces()
        middle = [Fraction(0)] * n
    if faces is None:
        raise Never
    found = []
    for direction, bound in faces:
        shift = graph.constant(0) if shape.kind is Polytope else _along(direction, shape.centre)
        plain = all(target.plain[k] for k, v in enumerate(direction) if v)
        limit = graph.constant(bound - exact.dot(direction, middle))
        found.append(_Face(direction, shift + graph.constant(bound), limit, plain))
    return found


def _along(direction: exact.Row, vector: list[Expr]) -> Expr:
    total = vector[0].graph.constant(0)
    for v, e in zip(direction, vector, strict=True):
        if v:
            total = total + e * v
    return total


def _support(source: StartFamily, direction: exact.Row) -> tuple[Expr, Expr]:
    """Bounds of the largest direction'x over the set; the same where it is rational."""
    shape, graph = source.shape, source.graph
    middle = _along(direction, shape.centre)
    if not shape.round:
        reach = graph.constant(0)
        for k in range(len(shape.axes[0])):
            column = _along(direction, [row[k] for row in shape.axes])
            only = [row[k] for row, v in zip(shape.axes, direction, strict=True) if v]
            # A box has half-widths, which are not negative.
            reach = reach + (_along([abs(v) for v in direction if v], only) if shape.kind is Box else abs(column))
        return middle + reach, middle + reach
    if shape.ellipsoid is None:
        low, high = _root(exact.dot(direction, direction))
        return middle + shape.axes[0][0] * low, middle + shape.axes[0][0] * high
    low, high = _root(exact.quadratic_form(exact.matrix(shape.ellipsoid.shape), direction))
    return middle + graph.constant(low), middle + graph.constant(high)


def _root(square: Fraction) -> tuple[Fraction, Fraction]:
    above = exact.sqrt_up(square)
    return (square / above if above else above), above


# -- round targets -----------------------------------------------------------------------------------


class RoundFit:
    """|T (x - c(q))|_2 <= s(q), for all x of S(p)."""

    def __init__(self, source: StartFamily, target: StartFamily) -> None:
        shape, n = source.shape, source.dim
        if target.shape.ellipsoid is None:
            self.T, self.grow, limit = np.eye(n), 1.0, target.shape.axes[0][0]
        else:
            region = Region(target.shape.ellipsoid)
            self.T, self.grow, limit = region.T, region.grow, target.graph.constant(1)
        self.off = 2.0 * (source.allowance + target.allowance)
        self.limit_off = 2.0 * float(target.allowance.max()) if target.shape.ellipsoid is None else 0.0
        columns = [] if shape.round else list(zip(*shape.axes, strict=True))
        self.columns = [k for k, g in enumerate(columns) if not all(e.is_constant and e.value == 0 for e in g)]
        sizes = [shape.axes[0][0]] if shape.round and shape.ellipsoid is None else []
        own = sizes or [row[k] for row in shape.axes for k in self.columns]
        self._source: Functions = source.functions([*shape.centre, *own])
        self._target: Functions = target.functions([*target.shape.centre, limit])
        self.round, self.sized = shape.round, bool(sizes)
        self._lines = [
            None if f.line is None else (f.line[0][:n].copy(), f.line[1][:n].copy())
            for f in (self._source, self._target)
        ]
        own_shape = np.eye(n) if shape.ellipsoid is None else np.array(shape.ellipsoid.shape, float)
        self.values, self.vectors = np.linalg.eigh(self.T @ own_shape @ self.T.T)
        # The product is off by gamma(2 n) |T||shape||T'|, its eigenvalues by a few units of the largest.
        product = np.abs(self.T) @ np.abs(own_shape) @ np.abs(self.T.T)
        self.blur = 8.0 * n * UNIT * float(product.sum(axis=1).max())
        self._largest = np.inf
        self._refuse_sizes(source, target)

    def _refuse_sizes(self, source: StartFamily, target: StartFamily) -> None:
        """A set reaches farther than its own size, wherever its centre is."""
        low, high = self._source.ranges(*source.bounds())
        n = source.dim
        low[:, :n] = high[:, :n] = 0.0
        y, lost, axes = self._placed(low, high, np.zeros((1, n)), np.zeros((1, n)))
        least = self._farthest(y, lost, axes, 0.5 * (low[:, n:] + high[:, n:]))[0]
        _, most = self._target.ranges(*target.bounds())
        self._largest = float((most[0, n] + self.limit_off) * self.grow * (1.0 + ROUNDED))
        if least[0] > self._largest:
            raise Never

    def _placed(self, low: Floats, high: Floats, c_low: Floats, c_high: Floats) -> tuple[Floats, Floats, Floats]:
        """y = T (c_i - c_j) (B, n), a bound (B,) of the length by which points may be off, and T L (B, n, m)."""
        n = c_low.shape[1]
        middle, radius = 0.5 * (low + high), 0.5 * (high - low)
        centre, reach = 0.5 * (c_low + c_high), 0.5 * (c_high - c_low)
        lost = radius[:, :n] + reach + self.off
        size = np.abs(middle[:, :n]) + np.abs(centre)
        axes = np.zeros((len(low), n, 0))
        if self.columns:
            table = middle[:, n:].reshape(len(low), n, len(self.columns))
            lost = lost + radius[:, n:].reshape(table.shape).sum(axis=2)
            size = size + np.abs(table).sum(axis=2)
            axes = np.einsum("ij,bjm->bim", self.T, table)
        lost = (lost + 8.0 * (n + 4) * UNIT * size) @ np.abs(self.T).T
        if self.sized:
            lost = lost + radius[:, n:] * np.sqrt(self.values[-1] + self.blur) * (1.0 + ROUNDED)
        return (middle[:, :n] - centre) @ self.T.T, lengths(lost) * (1.0 + ROUNDED) + TINY, axes

    def _farthest(self, y: Floats, lost: Floats, axes: Floats, size: Floats) -> tuple[Floats, Floats]:
        """Bounds (B,) of the largest |y + z| over what the source adds."""
        if self.round:
            radius = size[:, 0] if self.sized else np.ones(len(y))
            found = farthest_of_ellipsoid(y @ self.vectors, self.values, self.blur, radius)
        else:
            found = farthest_corner(y, axes)
        return found[0] * (1.0 - ROUNDED) - lost, found[1] * (1.0 + ROUNDED) + lost

    def _lengths(self, source: Boxes, target: Boxes) -> tuple[Floats, Floats, Floats, Floats]:
        n = self.T.shape[0]
        low, high = self._source.ranges(*source)
        c_low, c_high = self._target.ranges(*target)
        y, lost, axes = self._placed(low, high, c_low[:, :n], c_high[:, :n])
        least, most = self._farthest(y, lost, axes, 0.5 * (low[:, n:] + high[:, n:]))
        return least, most, c_low[:, n] - self.limit_off, c_high[:, n] + self.limit_off

    def excess(self, source: Boxes, target: Boxes) -> tuple[Floats, Floats]:
        least, most, small, large = self._lengths(source, target)
        return least - large * self.grow * (1.0 + ROUNDED), most * self.grow - small * (1.0 - ROUNDED)

    def excess_of_pairs(self, source: Floats, target: Floats) -> tuple[Floats, Floats]:
        line, other = self._lines
        if line is None or other is None:
            return self.excess((source, source), (target, target))
        apart = distances(np.ascontiguousarray(source), np.ascontiguousarray(target), *line, *other, self.T, self.off)
        # A set whose centre is outside is not inside.
        low = apart - self._largest
        left = np.flatnonzero(~(low > 0.0))
        high = np.full(len(low), np.inf)
        if len(left):
            low[left], high[left] = self.excess((source[left],) * 2, (target[left],) * 2)
        return low, high

    def gauges(self, source: Floats, target: Floats) -> Floats:
        _, most, small, _ = self._lengths((source, source), (target, target))
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.where(small > 0.0, most * self.grow * (1.0 + ROUNDED) / small, np.inf))


def lengths(y: Floats) -> Floats:
    """Euclidean lengths along the last axis, also where squares would underflow."""
    unit = np.maximum(np.abs(y).max(axis=-1, initial=0.0), np.finfo(float).tiny)
    return np.asarray(unit * np.sqrt(((y / unit[..., None]) ** 2).sum(axis=-1)))


def farthest_corner(y: Floats, axes: Floats) -> tuple[Floats, Floats]:
    """Bounds (B,) of the largest |y + axes z| over |z_k| <= 1, but for roundings; y (B, n), axes (B, n, m)."""
    m = axes.shape[2]
    alone = (np.count_nonzero(axes, axis=2) <= 1).all() and (np.count_nonzero(axes, axis=1) <= 1).all()
    above = lengths(np.abs(y) + np.abs(axes).sum(axis=2))
    if alone:
        return above, above
    if 2**m <= MOST_CORNERS:
        signs = np.array(list(itertools.product((1.0, -1.0), repeat=m)))
        step = max(1, CHUNK // (len(signs) * y.shape[1]))
        parts = [
            lengths(y[k : k + step, None] + np.einsum("bnm,sm->bsn", axes[k : k + step], signs)).max(axis=1)
            for k in range(0, len(y), step)
        ]
        found = np.concatenate(parts) if parts else np.zeros(0)
        return found, found
    ahead = np.where(np.einsum("bn,bnm->bm", y, axes) >= 0.0, 1.0, -1.0)
    return lengths(y + np.einsum("bnm,bm->bn", axes, ahead)), above


def farthest_of_ellipsoid(y: Floats, values: Floats, blur: float, size: Floats) -> tuple[Floats, Floats]:
    """Bounds (B,) of the largest |y + size z| over z'diag(v)^-1 z <= 1, v within blur of values; y (B, n).

    From above by any l > max m, m = size^2 v: |y + z|^2 <= l + sum l y_k^2 / (l - m_k); its least value is the
    answer, and z = m y / (l - m) there.
    """
    small, large = np.maximum(values - blur, 0.0), values + blur
    length = lengths(y)
    simple = length + np.sqrt(large[-1]) * size
    least = np.maximum(length + np.sqrt(small[0]) * size, np.sqrt(small[-1]) * size)
    if not values[-1] > values[0] + 4.0 * blur:
        return least, simple
    # In units of the answer: squares of tiny numbers would be 0.
    unit = np.maximum(simple, np.finfo(float).tiny)
    y = y / unit[:, None]
    less, m = (side * (size / unit)[:, None] ** 2 for side in (small, large))
    low = m.max(axis=1)
    high = low + np.sqrt((m * y**2).sum(axis=1))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            falls = (m * y**2 / (middle[:, None] - m) ** 2).sum(axis=1) > 1.0
            low, high = np.where(falls, middle, low), np.where(falls, high, middle)
        gap = high[:, None] - m
        above = unit * np.sqrt(high + np.where(y != 0.0, high[:, None] * y**2 / gap, 0.0).sum(axis=1))
        z = np.where(y != 0.0, less * y / gap, 0.0)
        own = np.sqrt(np.where(less > 0.0, z**2 / less, 0.0).sum(axis=1))
        below = unit * lengths(y + z / own[:, None])
    below = np.where(np.isfinite(below), np.maximum(below, least), least)
    return below, np.where(np.isfinite(above), np.minimum(above, simple), simple)
