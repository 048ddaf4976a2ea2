"""R^ij over continuous classes: certified inequalities in both references (method, sections 2 and 3).

R^ij = intersection over the parts of S_i (and of the unknowns) of the union over instants of the
pairs for which that part is inside S_j. A union over parts would be unsound.
"""

from __future__ import annotations

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


def whole_relation(source: int, goal: TargetClass, parts: Sequence[Part | None], rest: TargetClass | None) -> Relation:
    """The relation of all parts; without a usable instant in some part nothing is proved."""
    known = [part for part in parts if part is not None]
    return Relation(source, goal, tuple(known) if known and len(known) == len(parts) else (), rest)
