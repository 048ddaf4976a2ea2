"""R^ij over continuous classes: certified inequalities in both references (method, sections 2 and 3).

R^ij = intersection over the parts of S_i (and of the unknowns) of the union over instants of the
pairs for which that part is inside S_j. A union over parts would be unsound.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.moments import Moments
from modegraph.certify.switching.zero_time import ZeroTime
from modegraph.certify.targets.family import TargetClass
from modegraph.enclosure.arguments import Instants, Rows, Targets
from modegraph.enclosure.pairs import ROUNDED, first_crossings, part_gauges
from modegraph.model.sets import Box

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Part:
    """One part of the starts of the source: the flows that carry it on, each with its instants."""

    flows: tuple[Moments, ...]
    offset: Floats | None = None
    """(n,): from the centre of the start set to the middle of this part (floats, for messages)."""

    def meets(self, lo: Floats, hi: Floats) -> NDArray[np.bool_]:
        """For boxes (B, ki) of references: whether this part may have starts for some of them."""
        first = self.flows[0]
        return np.asarray(((lo <= first.hi) & (hi >= first.lo)).all(axis=1))


@dataclass(frozen=True)
class Crossings:
    """What is proved of pairs of references: arrays (B,) over the pairs.

    ``gauge``: of the worst part at its best instant, at most 1 where the switch is certified.
    ``latest`` seconds and ``energy`` (infinite where it is not): of the first instant that proves it.
    """

    gauge: Floats
    latest: Floats
    energy: Floats

    @property
    def certified(self) -> NDArray[np.bool_]:
        return self.gauge <= 1.0


@dataclass(frozen=True)
class Relation:
    """The switch i -> j for all pairs of references at once.

    Attributes
    ----------
    region : Box or None
        The class of references of the source (None: a single one); that of the target is in ``goal``.
    parts : tuple of Part
        They cover all starts; none where some part has no usable instant: nothing is proved then.
    rest : TargetClass or None
        The centres of the start sets of the source, where each is an equilibrium of its own: a start
        that stays there for ever.
    slack : mapping
        Proved distance from each constraint, up to any instant of the parts.
    zero : ZeroTime or None
        Pairs certified at t = 0 whatever the parts prove; only where the constraints are proved there.
    """

    region: Box | None
    goal: TargetClass
    parts: tuple[Part, ...]
    rest: TargetClass | None
    slack: Mapping[str, float] = field(default_factory=dict)
    zero: ZeroTime | None = None

    @property
    def source(self) -> int:
        """Number of parameters of the source."""
        return 0 if self.region is None else self.region.dim

    @property
    def target(self) -> int:
        """Number of parameters of the target."""
        return self.goal.parameters

    @property
    def extremes(self) -> tuple[float, float]:
        """Bounds of the time and the energy of any certified pair."""
        flows = [flow for part in self.parts for flow in part.flows]
        return float(max(f.times.max() for f in flows)), float(max(f.energy.max() for f in flows))

    @property
    def ignores(self) -> tuple[bool, bool]:
        """Whether what is certified does not depend on the source's reference, or not on the target's."""
        flows = [flow for part in self.parts for flow in part.flows]
        fixed = self.goal.affine is not None and not self.goal.affine[1].any()
        if self.zero is not None:
            return False, False
        return all(flow.is_constant for flow in flows), fixed

    @cached_property
    def arrival(self) -> tuple[Floats, Floats, Floats]:
        """Where the middle of the starts ends up, against the target, in gauges: y + Y p - Z p' (f,), (f, ki), (f, kj).

        Linearised, in floats, and a guess for planning: 0 is the centre of the target.
        """
        ends = [part.flows[-1] for part in self.parts]
        y = np.mean([end.rows[-1] @ (end.exponents.sum(axis=1) == 0) for end in ends], axis=0)
        slopes = []
        for end in ends:
            first = [end.rows[-1] @ ((end.exponents[:, v] == 1) & (end.exponents.sum(axis=1) == 1))
                     for v in range(self.source)]  # fmt: skip
            slopes.append(np.array(first).reshape(self.source, len(y)).T / end.scale)
        Y = np.mean(slopes, axis=0)
        y = y - np.mean([slope @ end.middle for slope, end in zip(slopes, ends, strict=True)], axis=0)
        c0, C = self.goal.about
        limits = np.maximum(self.goal.at(self.goal.middle)[2][0], 1e-12)
        return (y - self.goal.rows @ c0) / limits, Y / limits[:, None], self.goal.rows @ C / limits[:, None]

    @cached_property
    def stays(self) -> bool:
        """Of a class to itself: the mode ends where it starts, as at a set-point; else it carries the state along."""
        _, Y, Z = self.arrival
        return bool(np.abs(Y - Z).max(initial=0.0) <= 0.05 * np.abs(Z).max(initial=0.0))

    def crossings(self, source: Floats, target: Floats, quick: bool = False) -> Crossings:
        """Decide pairs: source (B, ki) and target (B, kj) references; outside their classes nothing is certified.

        With ``quick``, of a gauge it only counts whether it is at most 1.
        """
        if not self.parts:
            nothing = np.full(len(source), np.inf)
            return Crossings(nothing, nothing, nothing)
        gauge, instant = self._decided(source, target, quick)
        table, found = self._seconds, gauge <= 1.0
        # The last row stands for a part that has no starts for a reference.
        known = np.where(instant == -2, len(table) - 1, instant)
        worst = np.where(found[:, None], table[known].max(axis=1), np.inf)
        if self.zero is not None:
            later = np.flatnonzero(worst[:, 0] > 0.0)
            at_once = later[self.zero.decides(source[later], target[later])]
            gauge[at_once] = np.minimum(gauge[at_once], self.zero.gauges(source[at_once], target[at_once]))
            worst[at_once] = 0.0
        return Crossings(gauge, worst[:, 0], worst[:, 1])

    def worst(self, source: Floats, target: Floats) -> tuple[int, float]:
        """For one pair (1, ki), (1, kj) with a finite gauge: the part that decides it, and its best instant (s)."""
        there = Targets(*self.goal.at(target))
        found: list[tuple[float, int, float]] = []
        for k, part in enumerate(self.parts):
            if part.meets(source, source)[0]:
                gauges = part_gauges(k, source, there, self._rows, self._table)[0]
                best = int(np.argmin(gauges))
                found.append((float(gauges[best]), k, float(np.concatenate([f.times for f in part.flows])[best])))
        return max(found)[1:]

    def certified(self, source: Floats, target: Floats) -> NDArray[np.bool_]:
        """Which pairs are certified, as fast as can be."""
        if not self.parts:
            return np.zeros(len(source), bool)
        found = np.asarray(self._decided(source, target, True)[0] <= 1.0)
        if self.zero is not None and not found.all():
            left = np.flatnonzero(~found)
            found[left] = self.zero.decides(source[left], target[left])
        return found

    def _decided(self, source: Floats, target: Floats, quick: bool) -> tuple[Floats, NDArray[np.int64]]:
        found = first_crossings(
            np.ascontiguousarray(source), np.ascontiguousarray(target), self._classes, Targets(*self.goal.at(target)),
            self._rows, self._table, quick,
        )  # fmt: skip
        return found[0], found[1]

    @cached_property
    def _classes(self) -> tuple[tuple[Floats, Floats], ...]:
        sides = [(np.zeros(0), np.zeros(0)) if s is None else (s.lo, s.hi) for s in (self.region, self.goal.region)]
        return tuple((np.array(lo, float)[None], np.array(hi, float)[None]) for lo, hi in sides)

    @cached_property
    def _seconds(self) -> Floats:
        """Times and energies (T + 1, 2) of the instants in the table; the last row counts nothing."""
        flows = [flow for part in self.parts for flow in part.flows]
        rows = np.stack([np.concatenate([f.times for f in flows]), np.concatenate([f.energy for f in flows])], axis=1)
        return np.vstack([rows, np.zeros((1, 2))])

    @cached_property
    def _rows(self) -> Rows:
        goal = self.goal
        return Rows(np.ascontiguousarray(goal.rows, float), goal.slack, goal.round, goal.grow)

    @cached_property
    def _table(self) -> Instants:
        """The instants of all parts, as the kernels of `enclosure.pairs` want them."""
        flows = [flow for part in self.parts for flow in part.flows]

        def firsts(counts: Sequence[int]) -> NDArray[np.int64]:
            return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)

        return Instants(
            part_flows=firsts([len(part.flows) for part in self.parts]),
            lo=np.stack([part.flows[0].lo for part in self.parts]),
            hi=np.stack([part.flows[0].hi for part in self.parts]),
            middle=np.stack([f.middle for f in flows]),
            scale=np.stack([f.scale for f in flows]),
            flow_terms=firsts([len(f.exponents) for f in flows]),
            exponents=np.concatenate([f.exponents for f in flows]),
            flow_instants=firsts([len(f.times) for f in flows]),
            flow_coefficients=firsts([f.rows.size for f in flows]),
            coefficients=np.concatenate([f.rows.ravel() for f in flows]),
            farthest=np.array([f.farthest for f in flows]),
            size=np.concatenate([f.size for f in flows]),
            spread=np.concatenate([f.spread for f in flows]),
        )

    def refuted(self, source: Floats, target: Floats) -> NDArray[np.bool_]:
        """Pairs (B,) for which a start of i is proved to rest outside S_j for ever."""
        if self.rest is None:
            return np.zeros(len(source), bool)
        x, blur, _ = self.rest.at(source)
        centre, radius, limits = self.goal.at(target, outer=True)
        rows = self.goal.rows
        y = (x - centre) @ rows.T
        size = (np.abs(x) + np.abs(centre)) @ np.abs(rows).T
        error = (blur + radius) @ np.abs(rows).T + 1e-12 * size
        error = error + (np.abs(x) + np.abs(centre)).sum(axis=1, keepdims=True) * self.goal.slack
        if self.goal.round:
            least = np.maximum(np.abs(y) - error, 0.0)
            return np.asarray(np.sqrt((least**2).sum(axis=1)) * (1.0 - 1e-12) > limits[:, 0] * self.goal.grow)
        return np.asarray((y - error > limits * (1.0 + 1e-12)).any(axis=1))

    def cells(
        self, lo: tuple[Floats, Floats], hi: tuple[Floats, Floats]
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Which products of boxes (B, ki) x (B, kj) are certified, and which refuted, as a whole."""
        certified, refuted = self._cells(lo, hi)
        if self.zero is not None:
            certified = certified | self.zero.boxes((lo[0], hi[0]), (lo[1], hi[1]))
        return certified, refuted

    def _cells(
        self, lo: tuple[Floats, Floats], hi: tuple[Floats, Floats]
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        straight = self.goal.affine is not None and (self.rest is None or self.rest.affine is not None)
        if not straight or not all(f.affine for part in self.parts for f in part.flows):
            return self._cells_by_ranges(lo, hi)
        # Gauges are convex in both references: largest at a corner.
        joint_lo, joint_hi = np.concatenate(lo, axis=1), np.concatenate(hi, axis=1)
        B = len(joint_lo)
        z = corners(joint_lo, joint_hi)
        count = z.shape[1]
        flat = z.reshape(-1, z.shape[2])
        source, target = np.ascontiguousarray(flat[:, : self.source]), flat[:, self.source :]
        certified = np.full(B, bool(self.parts))
        there = Targets(*self.goal.at(target))
        for k, part in enumerate(self.parts):
            found = part_gauges(k, source, there, self._rows, self._table)
            worst = found.reshape(B, count, -1).max(axis=1)
            apart = ~part.meets(lo[0], hi[0])
            certified &= (worst.min(axis=1) <= 1.0) | apart
        separated = self._separated(source, target).reshape(B, count, -1)
        refuted: NDArray[np.bool_] = np.logical_or.reduce(np.logical_and.reduce(separated, axis=1), axis=1)
        return certified, refuted

    def _cells_by_ranges(
        self, lo: tuple[Floats, Floats], hi: tuple[Floats, Floats]
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Where something is curved: every term over the boxes."""
        goal = self.goal
        shift_lo, shift_hi, limits, _ = goal.over(lo[1], hi[1])
        largest = np.abs(np.stack(goal.states_over(lo[1], hi[1]))).max(axis=(0, 2))
        certified = np.full(len(lo[0]), bool(self.parts))
        for part in self.parts:
            best = np.full(len(lo[0]), np.inf)
            for flow in part.flows:
                low, high = flow.over(np.maximum(lo[0], flow.lo), np.minimum(hi[0], flow.hi))
                error = (
                    4.0 * ROUNDED * (flow.size + np.abs(high) + np.abs(low))
                    + 4.0 * ROUNDED * (np.abs(shift_lo) + np.abs(shift_hi))[:, None]
                )
                error = error + ((flow.farthest + largest)[:, None] * goal.slack)[:, None]
                best = np.minimum(best, _gauges(goal, low - shift_hi[:, None] - error,
                                                high - shift_lo[:, None] + error, flow.spread, limits))  # fmt: skip
            certified &= (best <= 1.0) | ~part.meets(lo[0], hi[0])
        return certified, self._apart(lo, hi)

    def _apart(self, lo: tuple[Floats, Floats], hi: tuple[Floats, Floats]) -> NDArray[np.bool_]:
        """Products of boxes for which a resting start is proved outside S_j by one half-space."""
        if self.rest is None:
            return np.zeros(len(lo[0]), bool)
        below, above = self.rest.states_over(lo[0], hi[0])
        shift_lo, shift_hi, _, limits = self.goal.over(lo[1], hi[1])
        rows = self.goal.rows
        up, down = np.maximum(rows, 0.0), np.minimum(rows, 0.0)
        size = np.abs(np.stack([below, above])).max(axis=0)
        error = 8.0 * ROUNDED * (size @ np.abs(rows).T + np.abs(shift_lo) + np.abs(shift_hi))
        error = (
            error
            + (size.sum(axis=1) + np.abs(np.stack(self.goal.states_over(lo[1], hi[1]))).sum(axis=(0, 2)))[:, None]
            * self.goal.slack
        )
        least = below @ up.T + above @ down.T - shift_hi - error
        if self.goal.round:
            most = above @ up.T + below @ down.T - shift_lo + error
            nearest = np.maximum(np.maximum(least, -most), 0.0)
            length = np.sqrt((nearest**2).sum(axis=1)) * (1.0 - 1e-12)
            return np.asarray(length > limits[:, 0] * self.goal.grow)
        return np.asarray((least > limits * (1.0 + 1e-12)).any(axis=1))

    def _separated(self, source: Floats, target: Floats) -> NDArray[np.bool_]:
        """For pairs (B,): by which of some fixed half-spaces (B, h) a resting start is proved outside S_j."""
        if self.rest is None:
            return np.zeros((len(source), 1), bool)
        x, blur, _ = self.rest.at(source)
        centre, radius, limits = self.goal.at(target, outer=True)
        rows = self.goal.rows
        size = np.abs(x) + np.abs(centre)
        if self.goal.round:
            turns = directions(len(rows))
            rows, limits = turns @ rows, limits[:, :1] * self.goal.grow * np.ones((1, len(turns)))
        y = (x - centre) @ rows.T
        error = (blur + radius + 1e-12 * size) @ np.abs(rows).T
        error = error + size.sum(axis=1, keepdims=True) * self.goal.slack.max(initial=0.0)
        return np.asarray(y - error > limits * (1.0 + 1e-12))


def _gauges(goal: TargetClass, low: Floats, high: Floats, spread: Floats, limits: Floats) -> Floats:
    """(B,): the largest gauge over ranges (B, K, f) at the best instant."""
    with np.errstate(divide="ignore", invalid="ignore"):
        if goal.round:
            # In units of the limit: the square of a tiny length would be 0.
            part = np.maximum(np.abs(low), np.abs(high)) / limits[:, :, None]
            reach = np.sqrt((part**2).sum(axis=2)) * goal.grow * (1.0 + ROUNDED)
            found = (reach + spread[:, 0] / limits) * (1.0 + ROUNDED)
        else:
            reach = high + spread
            reach = reach + ROUNDED * np.abs(reach)
            found = np.where(limits[:, None] > 0.0, reach / limits[:, None], np.inf).max(axis=2)
    return np.asarray(np.where(np.isnan(found), np.inf, found).min(axis=1))


def directions(n: int) -> Floats:
    """Unit vectors (h, n), rounded downward in length: of the axes, and between two of them."""
    found = [s * row for row in np.eye(n) for s in (1.0, -1.0)]
    for i in range(n):
        for j in range(i):
            for angle in np.arange(1, 8) * np.pi / 4 if n > 2 else np.arange(1, 64) * np.pi / 32:
                row = np.zeros(n)
                row[i], row[j] = np.cos(angle), np.sin(angle)
                found.append(row)
    return np.array(found) * (1.0 - 1e-12)


def corners(lo: Floats, hi: Floats) -> Floats:
    """Corners (B, 2^k, k) of boxes (B, k)."""
    k = lo.shape[1]
    signs = np.array(list(itertools.product([0.0, 1.0], repeat=k))).reshape(-1, k)
    return np.where(signs[None] > 0.0, hi[:, None], lo[:, None])


def whole_relation(
    region: Box | None, goal: TargetClass, parts: Sequence[Part | None], rest: TargetClass | None
) -> Relation:
    """The relation of all parts; without a usable instant in some part nothing is proved."""
    known = [part for part in parts if part is not None]
    return Relation(region, goal, tuple(known) if known and len(known) == len(parts) else (), rest)
