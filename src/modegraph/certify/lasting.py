"""Why the constraints hold for all time from every start of a part (Assumption 1)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from modegraph.certify.legal import by_name, proved_instants, slack_until
from modegraph.certify.switching.base import least_slack
from modegraph.certify.verdict import Floats
from modegraph.reach.flow.flow import Flow
from modegraph.reach.tail.box import Tail


class LastingEvidence(ABC):
    """The constraints hold for all t >= 0 from every start of a part; made of the objects that show it."""

    @property
    @abstractmethod
    def slack(self) -> Mapping[str, float]:
        """Proved distance from each constraint, for all time."""

    @property
    @abstractmethod
    def start(self) -> float:
        """Seconds from which on nothing new happens."""

    @property
    @abstractmethod
    def tracking(self) -> Floats:
        """Bounds (m,) of |h(x) - r| for all time; infinite where none is known."""


@dataclass(frozen=True, eq=False)
class BehindFlows(LastingEvidence):
    """Flows, proved to their ends, that lead to where a tail begins."""

    flows: Sequence[Flow]
    tail: Tail

    def __post_init__(self) -> None:
        if any(proved_instants(f) < len(f.steps) or f.failure is not None for f in self.flows):
            raise ValueError("a tail behind a flow that is not proved")
        if not (self.tail.face_upper <= 0.0).all():
            raise ValueError("a tail in which a constraint is not proved")

    @cached_property
    def slack(self) -> Mapping[str, float]:
        after = by_name(self.flows[-1].fields[-1].faces, self.tail.face_upper)
        return least_slack([*(slack_until(f, len(f.steps)) for f in self.flows), after])

    @property
    def start(self) -> float:
        return self.tail.start

    @cached_property
    def tracking(self) -> Floats:
        steps = [step.tracking for flow in self.flows for step in flow.steps]
        return np.asarray(np.max([self.tail.tracking, *steps], axis=0))


@dataclass(frozen=True, eq=False)
class NothingToKeep(LastingEvidence):
    """A linear loop without constraints from the instant its reference rests: it has a solution for all time."""

    flow: Flow

    def __post_init__(self) -> None:
        last = self.flow.fields[-1]
        linear = all(f.linear for f in self.flow.fields)
        if not linear or any(f.faces for f in self.flow.fields) or self.flow.time < last.start:
            raise ValueError("a loop that is not linear, or has constraints")

    @property
    def slack(self) -> Mapping[str, float]:
        return {}

    @property
    def start(self) -> float:
        return self.flow.time

    @property
    def tracking(self) -> Floats:
        return np.full(self.flow.fields[-1].outputs, np.inf)
