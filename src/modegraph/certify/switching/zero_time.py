"""S_i inside S_j: a switch in zero time, decided exactly on the sets themselves."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from modegraph.certify.legal import slack_until
from modegraph.certify.switching.base import Evidence, Nearest
from modegraph.certify.targets.region import Region
from modegraph.model.sets import Set, is_subset
from modegraph.reach.flow.flow import Flow


@dataclass(frozen=True, eq=False)
class InZeroTime(Evidence):
    """The start set is inside the target, the constraints are proved at t = 0.

    Attributes
    ----------
    start : the start set, on the plant state
    flow : a flow from all of it, of which only the start is looked at
    region : the target
    """

    start: Set
    flow: Flow
    region: Region

    def __post_init__(self) -> None:
        flow = self.flow
        legal = flow.failure is None and (flow.faces_at(0.0, flow.p0, flow.G0, 0) <= 0.0).all()
        if not legal or not is_subset(self.start, self.region.set):
            raise ValueError("a start set that is not inside the target, or breaks a constraint")

    @property
    def earliest(self) -> float:
        return 0.0

    @property
    def latest(self) -> float:
        return 0.0

    @property
    def margin(self) -> float:
        assert self.nearest is not None
        return max(0.0, 1.0 - self.nearest.gauge)

    @property
    def window(self) -> float:
        return 0.0

    @property
    def energy(self) -> float:
        return 0.0

    @property
    def slack(self) -> dict[str, float]:
        return slack_until(self.flow, 0)

    @cached_property
    def nearest(self) -> Nearest | None:
        n, flow = self.region.dim, self.flow
        gauge = float(self.region.gauges(flow.bounds, flow.p0[None, :n], [flow.G0[:, :n]])[0])
        return Nearest(0.0, gauge, flow.bounds, flow.p0, flow.G0, np.zeros(len(flow.p0)))
