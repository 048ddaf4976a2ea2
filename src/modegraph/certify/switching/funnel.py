"""What a funnel proves of the trajectories that a flow brings into it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from modegraph.certify.legal import slack_until
from modegraph.certify.samples import sample_powers
from modegraph.certify.switching.base import Evidence, Nearest, least_slack
from modegraph.certify.switching.common_time import Missed
from modegraph.certify.targets.region import Region
from modegraph.certify.verdict import Floats
from modegraph.deadline import Deadline
from modegraph.reach.failure import Mechanism
from modegraph.reach.flow.flow import Flow
from modegraph.reach.tail.base import Tail
from modegraph.reach.tail.decay import SettledLoop
from modegraph.reach.tail.funnel import Funnel, FunnelBuilder, NoFunnel, NormBall

BISECTIONS = 10
"""Halvings of the radius at which a target is reached."""
ROOM = 1.05
"""How much wider than the sampled set the mouth of a funnel is asked to be."""
TRIES = 3


@dataclass(frozen=True)
class Arrival:
    """Everything is in the target ``seconds`` after the flow has ended, and stays there."""

    seconds: float
    best: float
    energy: float
    """Bound of int u'u after the flow."""
    nearest: Nearest | None = None


@dataclass(frozen=True)
class Sinking:
    """From ``start`` on all trajectories of a flow sink in a funnel: in rung ``rung``, rho <= ``radius``."""

    funnel: Funnel
    rung: int
    radius: float
    start: float

    def tail(self) -> Tail:
        """All time after ``start``: the rung the flow ends in contains those after it."""
        rungs = self.funnel.rungs[self.rung :]
        boxes = [self.funnel.ball(self.rung, self.radius).box()]
        boxes += [self.funnel.ball(k, r.radius).box() for k, r in enumerate(rungs[1:], self.rung + 1)]
        return Tail(
            self.start,
            np.max([r.face_upper for r in rungs], axis=0),
            np.max([r.tracking for r in rungs], axis=0),
            np.min([lo for lo, _ in boxes], axis=0),
            np.max([hi for _, hi in boxes], axis=0),
            0.5 * min(r.alpha for r in rungs),
        )

    def arrival(self, region: Region, limit: float) -> Arrival | Missed:
        """When the target is reached, if that is within ``limit`` seconds after entry of the mode."""
        # Room for the rounding of sums of times.
        left = (limit - self.start) * (1.0 - 1e-8)
        elapsed = energy = 0.0
        best, at = math.inf, (self.rung, self.radius, 0.0)
        arrived: tuple[float, float] | None = None
        radius = self.radius
        for k in range(self.rung, len(self.funnel.rungs)):
            rung = self.funnel.rungs[k]
            radius = min(radius, rung.radius)
            seconds = rung.seconds(radius, rung.lower)
            in_time = elapsed + seconds <= left
            low = rung.lower
            if not in_time:
                seconds = max(0.0, left - elapsed)
                low = rung.after(radius, seconds)
            gauge = self._gauge(k, low, region)
            if gauge < best:
                best, at = gauge, (k, low, elapsed + seconds)
            if arrived is None and gauge <= 1.0:
                taken = self._within(k, radius, low, seconds, region)
                arrived = elapsed + taken, energy + taken * rung.power
            if not in_time:
                # What follows is not entered before the limit.
                break
            elapsed += seconds
            energy += seconds * rung.power
            # The next rung is entered with rho <= its own radius, in its own norm.
            radius = rung.lower if k + 1 < len(self.funnel.rungs) and self._same(k) else math.inf
        nearest = Nearest(self.start + at[2], best, self.funnel.ball(*at[:2]).set.project(region.dim))
        if arrived is None:
            return Missed(best, self.start + elapsed, False, np.zeros(0), nearest)
        slack = 1.0 + 1e-9
        return Arrival(arrived[0] * slack, best, arrived[1] * slack, nearest)

    def _same(self, k: int) -> bool:
        return self.funnel.rungs[k].norm is self.funnel.rungs[k + 1].norm

    def _gauge(self, k: int, radius: float, region: Region) -> float:
        return gauge_of(self.funnel.ball(k, radius), region)

    def _within(self, k: int, radius: float, low: float, seconds: float, region: Region) -> float:
        """Seconds from rho <= radius until the target holds {rho <= some radius between}."""
        rung = self.funnel.rungs[k]
        if self._gauge(k, radius, region) <= 1.0:
            return 0.0
        high = radius
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            if self._gauge(k, middle, region) <= 1.0:
                low = middle
            else:
                high = middle
        return min(seconds, rung.seconds(radius, low))

    def slack(self) -> dict[str, float]:
        """Slack of the constraints from the entry on."""
        rungs = self.funnel.rungs[self.rung :]
        names = self.funnel.loop.fld.faces
        return least_slack({name: -float(v)} for r in rungs for name, v in zip(names, r.face_upper, strict=True))


@dataclass(frozen=True, eq=False)
class Sunk(Evidence):
    """A flow ends in a funnel that leads into the target, and stays there for ever.

    ``touched``: seconds on the clock of the flow at which a trajectory may first be in the target, if at any.
    """

    flow: Flow
    sinking: Sinking
    arrival: Arrival
    touched: float | None

    def __post_init__(self) -> None:
        if self.sinking.start != self.flow.time or not self.arrival.best <= 1.0:
            raise ValueError("a funnel that the flow does not lead into, or that does not lead into the target")

    @property
    def earliest(self) -> float:
        own = self.sinking.start if self.touched is None else self.touched
        return float(min([*self.way.touched, self.way.sooner(own)]))

    @property
    def latest(self) -> float:
        return float(np.nextafter(self.sinking.start + self.arrival.seconds, np.inf))

    @property
    def margin(self) -> float:
        return 1.0 - self.arrival.best

    @property
    def window(self) -> float:
        return math.inf

    @property
    def energy(self) -> float:
        step = self.flow.steps[-1]
        spent = float(self.flow.seen_bounds.upper(step.energy) + step.energy_radius)
        return float(np.nextafter(spent + self.arrival.energy, np.inf))

    @property
    def slack(self) -> dict[str, float]:
        own = slack_until(self.flow, len(self.flow.steps))
        return least_slack([self.way.slack, own, self.sinking.slack()])

    @property
    def sinks(self) -> bool:
        return True

    @property
    def nearest(self) -> Nearest | None:
        return self.arrival.nearest


def gauge_of(ball: NormBall, region: Region) -> float:
    """Gauge of the states in {rho <= radius} in a target on the first of them."""
    return region.gauge(ball.set.project(region.dim))


class Funnels:
    """The funnels of one settled loop, built where a flow has got small enough; for one chain of flows alone."""

    def __init__(self, loop: SettledLoop, deadline: Deadline) -> None:
        self.builder = FunnelBuilder(loop, deadline)
        self.known: list[Funnel] = []

    def enter(self, flow: Flow, regions: Sequence[Region]) -> Sinking | NoFunnel:
        """How the end of a flow sinks: in a known funnel or a new one, leading into the regions if possible."""
        last = flow.last_set
        for funnel in self.known:
            hit = funnel.enter(last)
            if hit is not None and all(gauge_of(funnel.end, region) <= 1.0 for region in regions):
                return Sinking(funnel, *hit, flow.time)
        if not last.is_finite:
            return NoFunnel(Mechanism.NOT_BOUNDED)
        points = sample_powers(flow.piece, flow.bounds.exponents) @ last.p.T
        rng = np.random.default_rng(11)
        points += np.sign(rng.uniform(-1.0, 1.0, (len(points), len(last.G)))) @ last.G[:, :, 0]
        middle = points.mean(axis=0)
        fit = np.maximum(np.abs(points - middle).max(axis=0), 1e-12)
        room = ROOM
        for _ in range(TRIES):
            mouth = middle + room * (points - middle)
            found = self.builder.build(mouth, fit, lambda s: True)
            if isinstance(found, NoFunnel):
                return found
            if found.enter(last) is not None:
                return self._whole(flow, mouth, fit, regions)
            # Samples seldom reach the corners of what the remainder fills.
            room *= ROOM * found.gauge(last)
        return NoFunnel(Mechanism.NOT_IN_ELLIPSOID)

    def _whole(self, flow: Flow, mouth: Floats, fit: Floats, regions: Sequence[Region]) -> Sinking | NoFunnel:
        """The funnel with this mouth, followed until everything is in the regions."""
        found = self.builder.build(mouth, fit, lambda s: all(gauge_of(s, region) <= 1.0 for region in regions))
        if isinstance(found, NoFunnel):
            return found
        hit = found.enter(flow.last_set)
        if hit is None:
            return NoFunnel(Mechanism.NOT_IN_ELLIPSOID)
        self.known.append(found)
        return Sinking(found, *hit, flow.time)
