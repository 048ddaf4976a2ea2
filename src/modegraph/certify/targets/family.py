"""The start sets S_j(p) of one node as inequalities whose right-hand sides depend on its reference p.

Round sets: |T (x - c(p))|_2 <= s(p). Flat ones: A (x - c(p)) <= b(p), face by face. T and A do not
depend on p: that is what makes R^ij a closed formula (design, decision 8).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.targets.region import Region
from modegraph.enclosure.intervals import IntervalEvaluator
from modegraph.enclosure.pairs import affine_centres
from modegraph.errors import ModegraphError
from modegraph.expression.derivative import derivative
from modegraph.expression.scalar import Expr
from modegraph.expression.tape import compile_tape
from modegraph.model.class_start import StartClass, class_start
from modegraph.model.mode import Mode
from modegraph.model.sets import Ball, Box, Ellipsoid, Set, Zonotope
from modegraph.model.start import mode_start
from modegraph.model.target import Target
from modegraph.reach.start.class_chart import class_chart, require_same_start

Floats = NDArray[np.float64]

PLAIN_LOOKS = 10
"""References at which a start function is compared with its formula."""
ROUNDED = 1e-12
"""Relative allowance: a start set written with floats may differ so much from its exact formula."""


@dataclass(frozen=True)
class TargetClass:
    """S_j(p) for p in ``region`` (None: one set).

    Attributes
    ----------
    rows : (f, n) array
        T of a round set, A of a flat one; ``d_rows`` bounds their rounding, ``grow`` that of the norm.
    round : bool
    """

    dim: int
    region: Box | None
    round: bool
    rows: Floats
    d_rows: Floats
    grow: float
    _centre: Floats | StartClass
    _limits: Floats

    @property
    def parameters(self) -> int:
        return 0 if self.region is None else self.region.dim

    @cached_property
    def slack(self) -> Floats:
        """(f,): what a row may miss, for each unit of |x - c|."""
        return np.asarray(self.d_rows.sum(axis=1))

    @cached_property
    def _tape(self) -> IntervalEvaluator:
        assert isinstance(self._centre, StartClass)
        return IntervalEvaluator(compile_tape(_numbers(self._centre), self._centre.parameters))

    @cached_property
    def affine(self) -> tuple[Floats, Floats] | None:
        """c(p) = c0 + C p, (n,) and (n, k), where c is affine and the limits are fixed; None elsewhere."""
        return None if self._line is None else self._line[:2]

    def over(self, lo: Floats, hi: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Over boxes (B, k) of references: ranges (B, f) of rows c(p), the least and the largest limits (B, f or 1)."""
        if self._line is not None:
            c0, C, _, low, high = self._line
            middle = 0.5 * (lo + hi) @ C.T + c0
            about = middle @ self.rows.T
            slopes = np.abs(self.rows @ C)
            reach = 0.5 * (hi - lo) @ slopes.T + self._lost(lo, hi) @ np.abs(self.rows).T
            return about - reach, about + reach, np.tile(low, (len(lo), 1)), np.tile(high, (len(lo), 1))
        below, above = self.states_over(lo, hi)
        middle, radius = 0.5 * (below + above), 0.5 * (above - below)
        about = middle @ self.rows.T
        reach = (radius + 4.0 * ROUNDED * (np.abs(middle) + radius)) @ np.abs(self.rows).T
        _, _, small, large = self._evaluated(lo, hi)
        return about - reach, about + reach, small, large

    def states_over(self, lo: Floats, hi: Floats) -> tuple[Floats, Floats]:
        """Boxes (B, n) around the centres for boxes (B, k) of references."""
        if self._line is not None:
            c0, C, _, _, _ = self._line
            middle, radius = 0.5 * (lo + hi) @ C.T + c0, 0.5 * (hi - lo) @ np.abs(C).T + self._lost(lo, hi)
        else:
            middle, radius, _, _ = self._evaluated(lo, hi)
        return middle - radius, middle + radius

    def _lost(self, lo: Floats, hi: Floats) -> Floats:
        """(B, n): what an affine centre over boxes may be off by."""
        assert self._line is not None
        c0, C, off, _, _ = self._line
        return off + 4.0 * ROUNDED * (np.maximum(np.abs(lo), np.abs(hi)) @ np.abs(C).T + np.abs(c0))

    @property
    def middle(self) -> Floats:
        """The middle (1, k) of the class."""
        return np.zeros((1, 0)) if self.region is None else np.asarray(self.region.center, float)[None]

    @cached_property
    def about(self) -> tuple[Floats, Floats]:
        """c(p) near c0 + C p, (n,) and (n, k): exact where c is affine, else secants through the class, a guess."""
        if self.affine is not None:
            return self.affine
        assert self.region is not None
        middle, reach = self.middle[0], 0.5 * (self.region.hi - self.region.lo)
        ends = np.array([[self.at((middle + s * step)[None])[0][0] for s in (-1.0, 1.0)] for step in np.diag(reach)])
        C = ((ends[:, 1] - ends[:, 0]) / np.maximum(2.0 * reach, 1e-300)[:, None]).T
        return self.at(self.middle)[0][0] - C @ middle, C

    @cached_property
    def _line(self) -> tuple[Floats, Floats, Floats, Floats, Floats] | None:
        """c0, C, what c0 may be off by, and the limits from below and from above."""
        if not isinstance(self._centre, StartClass):
            nothing = np.zeros((self.dim, self.parameters))
            return self._centre, nothing, np.zeros(self.dim), self._limits, self._limits
        exprs = _numbers(self._centre)
        slopes = derivative(exprs, self._centre.parameters)
        if not all(e.is_constant for row in slopes for e in row) or not all(e.is_constant for e in exprs[self.dim :]):
            return None
        centre, radius, low, high = self._evaluated(*[np.zeros((1, self.parameters))] * 2)
        C = np.array([[float(e.value) for e in row] for row in slopes[: self.dim]])
        return centre[0], C, radius[0], low[0], high[0]

    def _evaluated(self, p: Floats, to: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Over boxes [p, to]: centres (B, n), what they may be off by, limits from below and above (B, f or 1)."""
        n = self.dim
        low, high, _ = self._tape(np.ascontiguousarray(p.T), np.ascontiguousarray(to.T))
        low, high = low.T, high.T
        centre = 0.5 * low[:, :n] + 0.5 * high[:, :n]
        radius = np.maximum(high[:, :n] - centre, centre - low[:, :n])
        own = [np.maximum(side[:, n:], 0.0) for side in (low, high)]
        radius = radius + ROUNDED * (np.abs(centre) + own[1].max(axis=1, initial=0.0)[:, None])
        if not own[0].shape[1]:
            own = [np.tile(self._limits, (len(p), 1))] * 2
        elif not self.round:
            own = [np.concatenate([side, side], axis=1) for side in own]
        return centre, radius, np.ascontiguousarray(own[0]), np.ascontiguousarray(own[1])

    def at(self, p: Floats, outer: bool = False) -> tuple[Floats, Floats, Floats]:
        """Centres (B, n), radii (B, n) around the true ones and limits (B, f or 1) for references p (B, k).

        S_j contains the set with these limits around the true centre; with ``outer`` it is contained in it.
        """
        if self._line is None:
            centre, radius, low, high = self._evaluated(p, p)
            return centre, radius, high if outer else low
        c0, C, off, low, high = self._line
        found = affine_centres(np.ascontiguousarray(p, float), c0, C, off, high if outer else low)
        return found[0], found[1], found[2]


def target_class(mode: Mode | Target, p: Floats | None, plant: int) -> TargetClass:
    """The start sets of a node: of a Target, of a mode under the reference p, or under a whole continuous class.

    Raises
    ------
    ModegraphError
        For sets that are not round or flat, and those on a memory as well.
    """
    if isinstance(mode, Target):
        mode.settle(plant)
        return _fixed(mode.set, mode.name)
    if mode.reference.region is None or p is not None:
        return _fixed(mode_start(mode, p), mode.name, plant)
    start = class_start(mode)
    if isinstance(start, Set):
        return _fixed(start, mode.name, plant, mode.reference.region)
    if start.dim != plant:
        raise ModegraphError(f"mode {mode.name!r}: a target over a memory cannot depend on a continuous class yet")
    require_plain(mode, start)
    n, traced = start.dim, start.set
    eye = np.eye(n)
    nothing = np.zeros((n, n))
    if traced.kind is Ball:
        return TargetClass(n, start.region, True, eye, nothing, 1.0, start, np.zeros(0))
    if traced.ellipsoid is not None:
        region = Region(traced.ellipsoid)
        return TargetClass(n, start.region, True, region.T, nothing, region.grow, start, np.ones(1))
    if traced.kind is Box:
        both = np.vstack([eye, -eye])
        return TargetClass(n, start.region, False, both, np.zeros_like(both), 1.0, start, np.zeros(0))
    if traced.kind is Zonotope and all(e.is_constant for row in traced.axes for e in row):
        shape = Region(Zonotope(np.zeros(n), [[float(e.value) for e in row] for row in traced.axes]))
        return TargetClass(n, start.region, False, shape.A, shape.dA, 1.0, start, shape.b)
    raise ModegraphError(
        f"mode {mode.name!r}: a Zonotope whose generators depend on the reference cannot be a target; use a Box"
    )


def require_plain(mode: Mode, start: StartClass) -> None:
    """The start function gives in floats what its formula says, at some references of the class.

    A formula that cancels does not: a run would enter another set than was proved.
    """
    region = start.region
    rng = np.random.default_rng(11)
    nothing = np.zeros(0)
    chart = class_chart(start, nothing, nothing)
    for p in [region.lo, region.hi, *rng.uniform(region.lo, region.hi, (PLAIN_LOOKS, region.dim))]:
        require_same_start(start, chart, mode_start(mode, p), p, mode.label)


def _fixed(target: Set, name: str, plant: int | None = None, region: Box | None = None) -> TargetClass:
    if plant is not None and target.dim != plant:
        raise ModegraphError(f"mode {name!r}: a target over a memory cannot be met for a continuous class yet")
    if not isinstance(target, (Ball, Ellipsoid)) and target.faces() is None:
        raise ModegraphError(f"mode {name!r}: a {type(target).__name__} cannot be a target of a continuous class yet")
    shape = Region(target)
    centre = np.asarray(shape.centre, float)
    if hasattr(shape, "quadric"):
        return TargetClass(target.dim, region, True, shape.T, np.zeros_like(shape.T), shape.grow, centre, np.ones(1))
    distance = shape.b - shape.A @ centre
    slack = 1e-14 * (np.abs(shape.b) + np.abs(shape.A) @ np.abs(centre))
    return TargetClass(target.dim, region, False, shape.A, shape.dA, 1.0, centre, distance - slack)


def _numbers(start: StartClass) -> list[Expr]:
    """Centre, then the sizes that depend on p: a Ball's radius, a Box's half-widths."""
    traced = start.set
    if traced.kind is Ball:
        return [*traced.centre, traced.axes[0][0]]
    if traced.kind is Box:
        return [*traced.centre, *(traced.axes[k][k] for k in range(traced.dim))]
    return list(traced.centre)
