"""What every way to show a switch yields: evidence, from which alone a proof is made."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.legal import slack_until
from modegraph.reach.flow.flow import Flow
from modegraph.reach.reach_set import ReachSet

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Nearest:
    """The set of one part of the starts when it is nearest to a target: ``time`` in seconds, ``gauge`` its bound."""

    time: float
    gauge: float
    set: ReachSet


def least_slack(many: Iterable[Mapping[str, float]]) -> dict[str, float]:
    """Smallest slack of each constraint."""
    least: dict[str, float] = {}
    for slack in many:
        for name, value in slack.items():
            least[name] = min(value, least.get(name, np.inf))
    return least


@dataclass(frozen=True, eq=False)
class Way:
    """The flows that all starts of a part have passed, legally, before the flow that shows the switch begins.

    Attributes
    ----------
    flows : flows passed from their starts to their ends
    touched : (float, ...)
        Seconds after entry: of each flow, the first instant at which a trajectory may have been in the target.
    ahead : float
        Seconds by which some trajectories are earlier than the clock of the flow that shows the switch says.
    """

    flows: Sequence[Flow] = ()
    touched: Sequence[float] = ()
    ahead: float = 0.0

    @property
    def slack(self) -> dict[str, float]:
        """Of the constraints on the way."""
        return least_slack(slack_until(flow, len(flow.steps)) for flow in self.flows)

    def sooner(self, seconds: float) -> float:
        """An instant on the clock of the flow, on that of the trajectory that is furthest ahead; rounded down."""
        return seconds if self.ahead == 0.0 else max(0.0, float(np.nextafter(seconds - self.ahead, -np.inf)))


@dataclass(frozen=True, eq=False)
class Evidence(ABC):
    """Every start of a part of S_i, for all its unknowns and every disturbance, is in S_j by ``latest``, legally.

    One class for each way to show it; each is made from the objects that show it, never from numbers.
    """

    way: Way = field(default_factory=Way, kw_only=True)

    @property
    @abstractmethod
    def earliest(self) -> float:
        """Seconds after entry: no trajectory is in the target before."""

    @property
    @abstractmethod
    def latest(self) -> float:
        """Seconds after entry: every trajectory has been in the target by then."""

    @property
    @abstractmethod
    def margin(self) -> float:
        """1 - gauge of the worst piece at its best instant."""

    @property
    @abstractmethod
    def window(self) -> float:
        """Seconds: the shortest stay in the target from the switch on."""

    @property
    @abstractmethod
    def energy(self) -> float:
        """Upper bound of int u'u up to the switch."""

    @property
    @abstractmethod
    def slack(self) -> Mapping[str, float]:
        """Proved distance from each constraint up to the switch."""

    @property
    def parts(self) -> int:
        """Pieces with an instant of their own."""
        return 1

    @property
    def sinks(self) -> bool:
        """Whether some starts are there only when they have sunk in a funnel."""
        return False

    @property
    def nearest(self) -> Nearest | None:
        """The worst piece at its best instant; None where it is not kept."""
        return None
