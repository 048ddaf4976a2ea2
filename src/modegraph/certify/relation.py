"""R^ij over continuous classes: certified inequalities in both references (method, sections 2 and 3).

R^ij = intersection over the parts of S_i (and of the unknowns) of the union over instants of the
pairs for which that part is inside S_j. A union over parts would be unsound.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .moments import Moments
from .target_class import TargetClass

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Part:
    """One part of the starts of the source: the flows that carry it on, each with its instants."""

    flows: tuple[Moments, ...]

    def holds(self, source: Floats) -> NDArray[np.bool_]:
        """For which references (B, ki) of the source this part has starts."""
        return self.flows[0].holds(source)

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
    source, target : int
        Numbers of parameters.
    parts : tuple of Part
        They cover all starts; none where some part has no usable instant: nothing is proved then.
    rest : TargetClass or None
        The centres of the start sets of the source, where each is an equilibrium of its own: a start
        that stays there for ever.
    """

    source: int
    goal: TargetClass
    parts: tuple[Part, ...]
    rest: TargetClass | None

    @property
    def target(self) -> int:
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
        return all(flow.is_constant for flow in flows), fixed

    def crossings(self, source: Floats, target: Floats) -> Crossings:
        """Decide pairs: source (B, ki) and target (B, kj) references, inside their classes."""
        B = len(source)
        gauge = np.full(B, -np.inf) if self.parts else np.full(B, np.inf)
        latest, energy = np.zeros(B), np.zeros(B)
        met = np.zeros(B, bool)
        for part in self.parts:
            here = np.flatnonzero(part.holds(source))
            if not len(here):
                continue
            met[here] = True
            found = [flow.gauges(source[here], target[here]) for flow in part.flows]
            g = np.concatenate(found, axis=1)
            times = np.concatenate([flow.times for flow in part.flows])
            spent = np.concatenate([flow.energy for flow in part.flows])
            first = np.argmax(g <= 1.0, axis=1)
            proved = (g <= 1.0).any(axis=1)
            gauge[here] = np.maximum(gauge[here], g.min(axis=1))
            latest[here] = np.maximum(latest[here], np.where(proved, times[first], np.inf))
            energy[here] = np.maximum(energy[here], np.where(proved, spent[first], np.inf))
        gauge[~met] = np.inf
        latest[gauge > 1.0] = np.inf
        energy[gauge > 1.0] = np.inf
        return Crossings(gauge, latest, energy)

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
        """Which products of boxes (B, ki) x (B, kj) are certified, and which refuted, as a whole.

        Where centre and moments are affine, gauges are convex in both references: largest at a corner.
        """
        k = self.source
        joint_lo, joint_hi = np.concatenate(lo, axis=1), np.concatenate(hi, axis=1)
        B = len(joint_lo)
        straight = self.goal.affine is not None and (self.rest is None or self.rest.affine is not None)
        if not straight or not all(f.affine for part in self.parts for f in part.flows):
            return np.zeros(B, bool), np.zeros(B, bool)
        z = corners(joint_lo, joint_hi)
        count = z.shape[1]
        flat = z.reshape(-1, z.shape[2])
        source, target = flat[:, :k], flat[:, k:]
        certified = np.full(B, bool(self.parts))
        for part in self.parts:
            found = [flow.gauges(source, target) for flow in part.flows]
            worst = np.concatenate(found, axis=1).reshape(B, count, -1).max(axis=1)
            apart = ~part.meets(lo[0], hi[0])
            certified &= (worst.min(axis=1) <= 1.0) | apart
        separated = self._separated(source, target).reshape(B, count, -1)
        refuted: NDArray[np.bool_] = np.logical_or.reduce(np.logical_and.reduce(separated, axis=1), axis=1)
        return certified, refuted

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


def whole_relation(source: int, goal: TargetClass, parts: Sequence[Part | None], rest: TargetClass | None) -> Relation:
    """The relation of all parts; without a usable instant in some part nothing is proved."""
    known = [part for part in parts if part is not None]
    return Relation(source, goal, tuple(known) if known and len(known) == len(parts) else (), rest)
