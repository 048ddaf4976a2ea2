"""When is a whole piece of the starts inside a target, with the constraints proved until then?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.legal import proved_instants, slack_until
from modegraph.certify.samples import points_of, sample_variables
from modegraph.certify.switching.base import Evidence, Nearest, least_slack
from modegraph.certify.targets.region import Region
from modegraph.expression.tape import Tape
from modegraph.reach.flow.flow import Flow
from modegraph.reach.reach_set import ReachSet, ReachSets

Floats = NDArray[np.float64]

DEEPEST_CELL = 7
"""A piece is cut into at most 2**DEEPEST_CELL cells, each with its own switching time."""


@dataclass(frozen=True)
class Crossing:
    """Proof that every start of a cell is in the target at grid instant ``instant`` of its flow.

    ``gauge`` is the bound at that instant, ``best`` the least over all usable instants, ``window``
    the seconds (proved) inside from then on, ``energy`` the bound of int u'u until then.
    """

    instant: int
    time: float
    gauge: float
    best: float
    window: float
    energy: float
    nearest: Nearest | None = None


@dataclass(frozen=True, eq=False)
class CommonTimes(Evidence):
    """The cells of a flow's piece, each inside the target as a whole at an instant of its own.

    ``touched``: seconds on the clock of the flow at which a trajectory may first be in the target, if at any.
    """

    flow: Flow
    crossings: Sequence[Crossing]
    touched: float | None

    def __post_init__(self) -> None:
        if not self.crossings or any(not c.gauge <= 1.0 for c in self.crossings):
            raise ValueError("a crossing that is not one")

    @property
    def earliest(self) -> float:
        # Not later than the switch itself, however loose the bounds of whole steps are.
        own = [c.time for c in self.crossings] + ([] if self.touched is None else [self.touched])
        return float(min([*self.way.touched, *(self.way.sooner(t) for t in own)]))

    @property
    def latest(self) -> float:
        return max(c.time for c in self.crossings)

    @property
    def margin(self) -> float:
        return min(1.0 - c.best for c in self.crossings)

    @property
    def window(self) -> float:
        return min(c.window for c in self.crossings)

    @property
    def energy(self) -> float:
        return max(c.energy for c in self.crossings)

    @property
    def slack(self) -> dict[str, float]:
        return least_slack([self.way.slack, slack_until(self.flow, max(c.instant for c in self.crossings))])

    @property
    def parts(self) -> int:
        return len(self.crossings)

    @property
    def nearest(self) -> Nearest | None:
        return max(self.crossings, key=lambda c: c.best).nearest


@dataclass(frozen=True)
class Missed:
    """No proof: the least gauge found, when, and whether cutting the starts further could help."""

    gauge: float
    time: float
    hopeful: bool
    start: Floats
    """Worst start (scaled variables of the whole)."""
    nearest: Nearest | None = None
    sampled: bool = False
    """``start`` is the worst of the sampled ones, not the middle of the worst part."""


class Reach:
    """One flow seen from the targets: what of it can be used, and its sets in the target's space."""

    def __init__(self, flow: Flow, horizon: float | None, reset: Tape | None = None) -> None:
        self.flow = flow
        self.proved = proved_instants(flow)
        limit = np.inf if horizon is None else horizon
        times = flow.times
        self.times = times
        self.usable = min(self.proved, int(np.searchsorted(times, limit, side="right")) - 1)
        self.reset = reset
        self._targets: dict[int, ReachSets] = {}

    def sets(self, dim: int) -> ReachSets:
        """The sets at the usable instants, in the space of a target.

        A target on (x, z) of its own memory is met by (x, reset(x)).
        """
        if dim not in self._targets:
            sets = [self.flow.reach_set(k) for k in range(self.usable + 1)]
            if self.reset is not None:
                plant = dim - len(self.reset.outputs)
                sets = [self._with_reset(reach.project(plant), self.reset) for reach in sets]
            self._targets[dim] = ReachSets.of(self.flow.bounds, [reach.project(dim) for reach in sets], dim)
        return self._targets[dim]

    def _with_reset(self, reach: ReachSet, reset: Tape) -> ReachSet:
        """(x, reset(x)) over a set of plant states x."""
        n, k, G = reach.dim, len(reset.outputs), reach.G
        inputs = np.zeros((len(reset.variables), reach.p.shape[1]))
        inputs[:n] = reach.p
        radius = np.zeros(len(reset.variables))
        radius[:n] = reach.spread
        z, off, _ = self.flow.evaluate(reset, inputs, radius)
        grown = np.zeros((len(G) + k, n + k, G.shape[2]))
        grown[: len(G), :n] = G
        grown[len(G) + np.arange(k), n + np.arange(k), 0] = off
        return ReachSet(reach.bounds, np.vstack([reach.p, z]), grown, np.concatenate([reach.box, np.zeros(k)]))

    def earliest(self, region: Region, plant: int) -> float | None:
        """First instant (seconds) at which a trajectory may be in the target; None: at no time of the flow."""
        if not self.flow.steps:
            return float(self.times[0])
        lo, hi = self.flow.tubes()
        apart = region_separated(region, lo[:, :plant], hi[:, :plant])
        touching = np.flatnonzero(~apart)
        return float(self.times[touching[0]]) if len(touching) else None


def region_separated(region: Region, lo: Floats, hi: Floats) -> NDArray[np.bool_]:
    """Separation of plant boxes from a target that may also live on a memory (then only if plain)."""
    if region.dim != lo.shape[1]:
        return np.zeros(len(lo), bool)
    return region.separated(lo, hi)


def find_crossings(reach: Reach, region: Region) -> list[Crossing] | Missed:
    """One crossing for each cell of the flow's piece, or the cell that could not be decided."""
    flow = reach.flow
    if reach.usable < 0:
        return Missed(np.inf, 0.0, False, np.zeros(flow.piece.variables))
    return _cross(reach, region, reach.sets(region.dim), 0)


def _cross(reach: Reach, region: Region, sets: ReachSets, depth: int) -> list[Crossing] | Missed:
    gauges = region.gauges(sets)
    inside = np.flatnonzero(gauges <= 1.0)
    best = int(np.argmin(gauges))
    nearest, piece = Nearest(float(reach.times[best]), float(gauges[best]), sets[best]), sets.piece
    if len(inside):
        return [_crossing(reach, region, sets, gauges, int(inside[0]), nearest)]
    missed = Missed(nearest.gauge, nearest.time, False, piece.middle, nearest)
    if depth >= DEEPEST_CELL or piece.variables == 0:
        return missed
    hopeful, worst = _sampled(reach, region, sets)
    if not hopeful:
        return replace(missed, start=worst, sampled=True)
    crossings: list[Crossing] = []
    children = piece.split(widest_variable(sets[best]))
    if not children:
        # No start is left in this cell: everything is true of it.
        return [Crossing(0, float(reach.times[0]), -np.inf, -np.inf, np.inf, 0.0)]
    for child in children:
        found = _cross(reach, region, sets.restricted(child, reach.flow.table), depth + 1)
        if isinstance(found, Missed):
            return replace(found, hopeful=True)
        crossings += found
    return crossings


def _crossing(
    reach: Reach, region: Region, sets: ReachSets, gauges: Floats, instant: int, nearest: Nearest
) -> Crossing:
    flow = reach.flow
    window = 0.0
    end = len(sets) - 1
    # How far reset(x) strays between instants is not bounded.
    if reach.reset is None and instant < end and gauges[min(instant + 1, end)] <= 1.0:
        size = sets.dim
        steps = flow.steps[instant:end]
        out = np.stack([flow.swell(s)[:size] if len(s.tube) >= size else np.full(size, np.inf) for s in steps])
        for step, gauge in zip(steps, region.tube_gauges(sets[instant:], out), strict=True):
            if not gauge <= 1.0:
                break
            window += step.end - step.start
    energy = 0.0
    if instant > 0:
        step = flow.steps[instant - 1]
        energy = float(flow.seen_bounds.upper(step.energy) + step.energy_radius)
    return Crossing(
        instant, float(reach.times[instant]), float(gauges[instant]), nearest.gauge, window, energy, nearest
    )


def _sampled(reach: Reach, region: Region, sets: ReachSets) -> tuple[bool, Floats]:
    """Whether every sampled start is inside at some instant (floats: a guess), and the worst of them.

    Under a disturbance the remainder counts, for smaller parts do not make it smaller.
    """
    piece = sets.piece
    eta = sample_variables(piece)
    gauges = region.point_gauges(points_of(sets, eta), sets.spread if reach.flow.w_radius.any() else None)
    each = gauges.min(axis=0)
    worst = int(np.argmax(each))
    return not piece.known or bool((each < 1.0).all()), piece.middle + piece.radius * eta[worst]


def widest_variable(reach: ReachSet) -> int:
    """The variable with the largest share in the width of a set; nonlinear terms count twice."""
    p, exponents = reach.p, reach.bounds.exponents
    weight = 1.0 / np.maximum(np.abs(p[:, 1:]).sum(axis=1), 1e-300)
    share = np.zeros(reach.piece.variables)
    for v in range(len(share)):
        uses = exponents[:, v] > 0
        nonlinear = exponents.sum(axis=1) > 1
        size = np.abs(p[:, uses]).sum(axis=1) + np.abs(p[:, uses & nonlinear]).sum(axis=1)
        share[v] = float((size * weight).max())
    return int(np.argmax(share))
