"""What no certified pair of references in a product of boxes can beat: bounds for planning, in floats.

A switch is certified at an instant; over boxes of references its inequality is easiest where every term is
least. What follows bounds the description R^ij, not the plant.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.moments import Moments
from modegraph.certify.relation import Part, Relation

Floats = NDArray[np.float64]

SLACK = 1e-9
"""Relative; more than the roundings here and in the inequalities."""


@dataclass(frozen=True)
class Least:
    """For products of boxes (Bi, Bj): lower bounds of the gauge, latest time and energy of any certified pair.

    Infinite times where no pair of the product can be certified.
    """

    gauge: Floats
    latest: Floats
    energy: Floats


def least(relation: Relation, source: tuple[Floats, Floats], target: tuple[Floats, Floats]) -> Least:
    """Bounds over products of boxes lo, hi (Bi, ki) of the source and (Bj, kj) of the target."""
    shape = len(source[0]), len(target[0])
    nothing = np.full(shape, np.inf)
    if not relation.parts:
        return Least(nothing, nothing, nothing)
    shift_lo, shift_hi, _, limits = relation.goal.over(*target)
    gauge, latest, energy = np.full(shape, -np.inf), np.zeros(shape), np.zeros(shape)
    for part in relation.parts:
        # A part that may have no starts for some of the references decides nothing.
        asked = _covers(part, *source)
        found, times, spent = [], [], []
        for flow in part.flows:
            y_lo, y_hi = flow.over(*source)
            low = y_lo[:, None] - shift_hi[None, :, None]
            high = y_hi[:, None] - shift_lo[None, :, None]
            found.append(_least_gauges(low, high, flow.spread, limits, relation.goal.round))
            times.append(flow.times)
            # Where no bound of the energy is known, any pair may have spent next to nothing.
            spent.append(np.where(np.isfinite(flow.energy), flow.energy, 0.0))
        g = np.concatenate(found, axis=2)
        possible = g <= 1.0 + SLACK
        first = possible.argmax(axis=2)
        some = possible.any(axis=2)
        best = np.where(asked[:, None], g.min(axis=2), -np.inf)
        gauge = np.maximum(gauge, best)
        for total, values in ((latest, np.concatenate(times)), (energy, np.concatenate(spent))):
            np.maximum(total, np.where(asked[:, None], np.where(some, values[first], np.inf), 0.0), out=total)
    if relation.zero is not None:
        rows, columns = np.indices(shape).reshape(2, -1)
        boxes = (source[0][rows], source[1][rows]), (target[0][columns], target[1][columns])
        at_once = ~relation.zero.excludes(*boxes).reshape(shape)
        gauge, latest, energy = (np.where(at_once, np.minimum(v, 0.0), v) for v in (gauge, latest, energy))
    return Least(gauge, latest, energy)


def _covers(part: Part, lo: Floats, hi: Floats) -> NDArray[np.bool_]:
    first = part.flows[0]
    return np.asarray(((lo >= first.lo) & (hi <= first.hi)).all(axis=1))


def _least_gauges(low: Floats, high: Floats, spread: Floats, limits: Floats, is_round: bool) -> Floats:
    """(Bi, Bj, K) from ranges (Bi, Bj, K, f), spreads (K, f or 1) and limits (Bj, f or 1)."""
    room = np.maximum(limits, 1e-300)
    if is_round:
        nearest = np.maximum(np.maximum(low, -high), 0.0)
        length = np.sqrt((nearest**2).sum(axis=3))
        return np.asarray((length + spread[:, 0]) / room[None, :, :1] * (1.0 - SLACK))
    return np.asarray(((low + spread - SLACK * np.abs(low)) / room[None, :, None]).max(axis=3))


@dataclass(frozen=True)
class Strides:
    """How far certified switches of one class to itself can carry the reference, instant by instant.

    A walk from p to p' costs at least max_h h.(S p' - S p) min_k cost_k / reach_k over unit vectors h, where
    the source allows the instant k to move S p by at most reach_k.

    Attributes
    ----------
    rows : (f, k) array
        S: the target's rows times the slopes of its centre.
    reach : (K,) or (K, f) array
        Along any unit vector of a round target; along each row, of a flat one.
    latest, energy : (K,) arrays
    """

    rows: Floats
    reach: Floats
    latest: Floats
    energy: Floats
    round: bool

    def cost(self, a: tuple[Floats, Floats], b: tuple[Floats, Floats], prices: Floats) -> Floats:
        """Least cost (Bi, Bj) of walks from boxes (Bi, k) to boxes (Bj, k), ``prices`` (K,) of one switch each."""
        up, down = np.maximum(self.rows, 0.0), np.minimum(self.rows, 0.0)
        a_lo, a_hi = a[0] @ up.T + a[1] @ down.T, a[1] @ up.T + a[0] @ down.T
        b_lo, b_hi = b[0] @ up.T + b[1] @ down.T, b[1] @ up.T + b[0] @ down.T
        ahead = np.maximum(b_lo[None] - a_hi[:, None], 0.0)
        behind = np.maximum(a_lo[:, None] - b_hi[None], 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            if self.round:
                each = np.where(self.reach > 0.0, prices / self.reach, np.inf).min()
                far = np.sqrt((np.maximum(ahead, behind) ** 2).sum(axis=2))
                return np.asarray(np.where(far > 0.0, far * each, 0.0) * (1.0 - SLACK))
            each = np.where(self.reach > 0.0, prices[:, None] / self.reach, np.inf).min(axis=0)
            return np.asarray(np.where(ahead > 0.0, ahead * each, 0.0).max(axis=2) * (1.0 - SLACK))


def strides(relation: Relation) -> Strides | None:
    """How a class may walk by its switches to itself; None where nothing is known of that."""
    goal = relation.goal
    if goal.affine is None or goal.region is None or not relation.parts:
        return None
    rows = goal.rows @ goal.affine[1]
    lo, hi = np.asarray(goal.region.lo, float)[None], np.asarray(goal.region.hi, float)[None]
    limits = goal.over(lo, hi)[3][0]
    reach: list[Floats] = []
    # Every reference is in some part, and its steps are proved there.
    flows = [flow for part in relation.parts for flow in part.flows]
    for flow in flows:
        drift = _drift(
            flow,
            rows,
            goal.rows @ goal.affine[0],
            np.maximum(lo, flow.lo),
            np.maximum(np.minimum(hi, flow.hi), flow.lo),
        )
        room = limits - flow.spread
        reach.append(room[:, 0] + np.sqrt((drift**2).sum(axis=1)) if goal.round else _opposite(goal.rows, room, drift))
    times, energy = (np.concatenate([getattr(f, name) for f in flows]) for name in ("times", "energy"))
    return Strides(rows, np.concatenate(reach), times, energy, goal.round)


def _drift(flow: Moments, rows: Floats, offset: Floats, lo: Floats, hi: Floats) -> Floats:
    """(K, f): how far rows m_k(p) - rows c(p) is from 0 at most, over the class."""
    changed = flow.rows.copy()
    constant = np.flatnonzero(flow.exponents.sum(axis=1) == 0)
    if len(constant):
        changed[:, :, constant[0]] -= offset + rows @ flow.middle
    extra: list[Floats] = []
    for v in range(len(flow.middle)):
        own = np.flatnonzero((flow.exponents[:, v] == 1) & (flow.exponents.sum(axis=1) == 1))
        if len(own):
            changed[:, :, own[0]] -= rows[:, v] * flow.scale[v]
        else:
            extra.append(np.abs(rows[:, v]) * np.abs(flow.scale[v]))
    low, high = replace(flow, rows=changed).over(lo, hi)
    return np.asarray(np.maximum(np.abs(low[0]), np.abs(high[0])) + sum(extra, np.zeros(len(rows))))


def _opposite(rows: Floats, room: Floats, drift: Floats) -> Floats:
    """(K, f): how far x may go along each row, limited by the face on the other side; infinite without one."""
    reach = np.full(room.shape, np.inf)
    for f, row in enumerate(rows):
        for g, other in enumerate(rows):
            if np.array_equal(row, -other):
                reach[:, f] = room[:, g] + drift[:, g]
    return reach
