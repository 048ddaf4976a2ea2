"""When is a whole piece of the starts inside a target, with the constraints proved until then?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.legal import proved_instants, slack_until
from modegraph.certify.samples import powers_at, sample_variables
from modegraph.certify.switching.base import Evidence, Nearest, least_slack
from modegraph.certify.targets.region import Region
from modegraph.expression.tape import Tape
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.flow.flow import Flow, generator_box
from modegraph.reach.start.piece import Piece
from modegraph.reach.start.restriction import Restriction

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
        self._targets: dict[int, tuple[Floats, list[Floats]]] = {}

    def sets(self, dim: int) -> tuple[Floats, list[Floats]]:
        """p (K, dim, N) and generators at the usable instants, in the space of a target.

        A target on (x, z) of its own memory is met by (x, reset(x)).
        """
        if dim not in self._targets:
            pairs = [self.flow.state_set(k) for k in range(self.usable + 1)]
            p = np.stack([pair[0] for pair in pairs]) if pairs else np.zeros((0, dim, 1))
            G = [pair[1] for pair in pairs]
            plant = dim - (len(self.reset.outputs) if self.reset is not None else 0)
            if self.reset is not None:
                p, G = self._with_reset(p[:, :plant], [g[:, :plant] for g in G])
            self._targets[dim] = p[:, :dim], [g[:, :dim] for g in G]
        return self._targets[dim]

    def _with_reset(self, p: Floats, generators: Sequence[Floats]) -> tuple[Floats, list[Floats]]:
        assert self.reset is not None
        joint, sets = [], []
        k = len(self.reset.outputs)
        for x, G in zip(p, generators, strict=True):
            inputs = np.zeros((len(self.reset.variables), x.shape[1]))
            inputs[: len(x)] = x
            radius = np.zeros(len(self.reset.variables))
            radius[: len(x)] = generator_box(G)
            z, off, _ = self.flow.evaluate(self.reset, inputs, radius)
            joint.append(np.vstack([x, z]))
            grown = np.zeros((len(G) + k, len(x) + k, G.shape[2]))
            grown[: len(G), : len(x)] = G
            grown[len(G) + np.arange(k), len(x) + np.arange(k), 0] = off
            sets.append(grown)
        return np.stack(joint), sets

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
    p, generators = reach.sets(region.dim)
    radius = np.zeros(p.shape[:2])
    return _cross(reach, region, flow.piece, flow.bounds, p, generators, radius, 0)


def _cross(
    reach: Reach,
    region: Region,
    piece: Piece,
    bounds: PolynomialBounds,
    p: Floats,
    generators: Sequence[Floats],
    lost: Floats,
    depth: int,
) -> list[Crossing] | Missed:
    gauges = region.swollen_gauges(bounds, p, generators, lost)
    inside = np.flatnonzero(gauges <= 1.0)
    best = int(np.argmin(gauges))
    nearest = Nearest(float(reach.times[best]), float(gauges[best]), bounds, p[best], generators[best], lost[best])
    if len(inside):
        return [_crossing(reach, region, bounds, p, gauges, int(inside[0]), nearest)]
    missed = Missed(nearest.gauge, nearest.time, False, piece.middle, nearest)
    if depth >= DEEPEST_CELL or piece.variables == 0:
        return missed
    hopeful, worst = _sampled(reach, region, piece, p, generators)
    if not hopeful:
        return replace(missed, start=worst, sampled=True)
    crossings: list[Crossing] = []
    variable = widest_variable(bounds, p[best])
    children = piece.split(variable)
    if not children:
        # No start is left in this cell: everything is true of it.
        return [Crossing(0, float(reach.times[0]), -np.inf, -np.inf, np.inf, 0.0)]
    table = reach.flow.table
    for child in children:
        restriction = Restriction(piece, child, table, p.shape[2])
        q, error = restriction.apply(p)
        cells = PolynomialBounds(child, table, p.shape[2])
        found = _cross(reach, region, child, cells, q, generators, (lost + error) * 1.0000001, depth + 1)
        if isinstance(found, Missed):
            return replace(found, hopeful=True)
        crossings += found
    return crossings


def _crossing(
    reach: Reach,
    region: Region,
    bounds: PolynomialBounds,
    p: Floats,
    gauges: Floats,
    instant: int,
    nearest: Nearest,
) -> Crossing:
    flow = reach.flow
    window = 0.0
    end = len(p) - 1
    # How far reset(x) strays between instants is not bounded.
    if reach.reset is None and instant < end and gauges[min(instant + 1, end)] <= 1.0:
        size = p.shape[1]
        steps = flow.steps[instant:end]
        out = np.stack([flow.swell(s)[:size] if len(s.tube) >= size else np.full(size, np.inf) for s in steps])
        for step, gauge in zip(steps, region.tube_gauges(bounds, p[instant:], out), strict=True):
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


def _sampled(
    reach: Reach, region: Region, piece: Piece, p: Floats, generators: Sequence[Floats]
) -> tuple[bool, Floats]:
    """Whether every sampled start is inside at some instant (floats: a guess), and the worst of them.

    Under a disturbance the remainder counts, for smaller parts do not make it smaller.
    """
    eta = sample_variables(piece)
    powers = powers_at(eta, reach.flow.table.exponents[: p.shape[2]])
    points = np.einsum("kin,sn->ksi", p, powers)
    z = np.stack([generator_box(G) for G in generators]) if len(generators) else np.zeros(p.shape[:2])
    gauges = region.point_gauges(points, z if reach.flow.w_radius.any() else None)
    each = gauges.min(axis=0)
    worst = int(np.argmax(each))
    return not piece.known or bool((each < 1.0).all()), piece.middle + piece.radius * eta[worst]


def widest_variable(bounds: PolynomialBounds, p: Floats) -> int:
    """The variable with the largest share in the width of a set p (n, N); nonlinear terms count twice."""
    weight = 1.0 / np.maximum(np.abs(p[:, 1:]).sum(axis=1), 1e-300)
    share = np.zeros(bounds.piece.variables)
    for v in range(len(share)):
        uses = bounds.exponents[:, v] > 0
        nonlinear = bounds.exponents.sum(axis=1) > 1
        size = np.abs(p[:, uses]).sum(axis=1) + np.abs(p[:, uses & nonlinear]).sum(axis=1)
        share[v] = float((size * weight).max())
    return int(np.argmax(share))
