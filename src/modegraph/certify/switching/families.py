"""Switches between classes of references: evidence out of their relation, for one pair or for all that it certifies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.relation import Crossings, Relation
from modegraph.certify.switching.base import Evidence

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class OfPair(Evidence):
    """One pair of references that a relation certifies: ``source`` (1, ki) and ``target`` (1, kj)."""

    relation: Relation
    source: Floats
    target: Floats

    def __post_init__(self) -> None:
        if not self._crossing.certified[0]:
            raise ValueError("a pair of references that the relation does not certify")

    @cached_property
    def _crossing(self) -> Crossings:
        return self.relation.crossings(self.source, self.target)

    @property
    def earliest(self) -> float:
        return 0.0

    @property
    def latest(self) -> float:
        return float(self._crossing.latest[0])

    @property
    def margin(self) -> float:
        return 1.0 - float(self._crossing.gauge[0])

    @property
    def window(self) -> float:
        return 0.0

    @property
    def energy(self) -> float:
        return float(self._crossing.energy[0])

    @property
    def slack(self) -> Mapping[str, float]:
        return self.relation.slack

    @property
    def parts(self) -> int:
        return len(self.relation.parts)


@dataclass(frozen=True, eq=False)
class OfEveryPair(OfPair):
    """All pairs that a relation certifies, of which (``source``, ``target``) is one: what holds for each of them."""

    @property
    def latest(self) -> float:
        return self.relation.extremes[0]

    @property
    def margin(self) -> float:
        # At the boundary of the relation nothing is left.
        return 0.0

    @property
    def energy(self) -> float:
        return self.relation.extremes[1]
