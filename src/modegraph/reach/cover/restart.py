"""Start a flowpipe again from a zonotope around its end.

The set variables are given up for new ones: what was remainder becomes polynomial. Under a
disturbance the remainder is as large as the set after a while, and only boxes of it feed the
nonlinear terms; a contracting loop forgets the loss of the new start. (Without disturbance
restarting only widens.)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.rounding import UNIT
from modegraph.reach.compiled import CompiledMode
from modegraph.reach.cover.degrees import restart_order
from modegraph.reach.field import Field
from modegraph.reach.flow.flow import RESTART_STEPS, Flow, Order
from modegraph.reach.generators import with_box
from modegraph.reach.parallelotope import half_widths, mode_gap, principal_axes, tightest
from modegraph.reach.reach_set import ReachSet
from modegraph.reach.start.piece import Piece

Floats = NDArray[np.float64]

WIDE_GAP = 8.0
"""Ratio of neighbouring decay rates from which the frame of the modes is used at the first restart."""


def again(
    compiled: CompiledMode,
    flows: Sequence[Flow],
    end: float,
    *,
    first: bool,
    common: bool = False,
    legal: Callable[[Flow], bool] = lambda flow: True,
) -> Flow | None:
    """Restart around the ends of flows: in the coordinates of the plant, then in the frame of the modes.

    The first holds out longer while the set is large, the second is tighter in the end, and at once where fast and
    slow modes are far apart (measured on the arm: 5 against 16). None where the restart breaks down at once, or is
    not ``legal`` after a step; then the first of the flows waits until it asks again.

    Parameters
    ----------
    first : the flows have not been restarted before
    common : of one flow too only a box is kept, as of several
    """
    flow = flows[0]
    framed = not first or mode_gap(flow.slope) > WIDE_GAP
    compact = common and (flow.generation == 0 or filled_share(flow) > 1.0)
    following = restarted(flows, compiled.framed_fields if framed else compiled.fields, compact=compact)
    if following is not None and following.time < end and following.advance(end) and legal(following):
        return following
    flow.next_restart = len(flow.steps) + RESTART_STEPS
    return None


def restarted(flows: Sequence[Flow], fields: Sequence[Field], *, compact: bool = False) -> Flow | None:
    """A flow that continues ``flows`` from a zonotope around their ends; None if none is found.

    One flow keeps the largest columns of its linear part, unless ``compact``: then one parallelotope holds
    all. Several are enclosed so together, and start at the latest of their instants: valid only where the
    loop does not depend on time. ``fields`` may be in another frame than those of the flows.
    """
    piece = None if compact or len(flows) > 1 else _around_one(flows[0], fields)
    if piece is None:
        piece = _around_all(flows, fields)
    if piece is None:
        return None
    first = flows[0]
    spent = [float(f.seen_bounds.upper(f.steps[-1].energy) + f.steps[-1].energy_radius) for f in flows]
    return _like(
        first,
        piece,
        fields=fields,
        order=restart_order(piece.variables),
        t0=max(flow.time for flow in flows),
        energy=max(spent),
        generation=first.generation + 1,
    )


def filled_share(flow: Flow) -> float:
    """How large the remainder is relative to the polynomial part, in the state where it is least.

    Above 1 the polynomial part is not worth variables of its own.
    """
    last = flow.last_set
    return float((last.spread / np.maximum(np.abs(last.p[:, 1:]).sum(axis=1), 1e-300)).min())


def halved(flow: Flow, variable: int) -> list[Flow]:
    """Flows that start where a restarted one does, from the halves of its piece: together they hold all of it."""
    same: dict[str, Any] = {"fields": flow.fields, "order": flow.order, "generation": flow.generation}
    begin = float(flow.times[0])
    return [_like(flow, half, **same, t0=begin, energy=flow.spent) for half in flow.piece.split(variable)]


def _like(
    flow: Flow, piece: Piece, *, fields: Sequence[Field], order: Order, t0: float, energy: float, generation: int
) -> Flow:
    """A flow of the same loop and disturbance, from another piece in the coordinates of the states."""
    return Flow(
        fields,
        piece,
        flow.w_centre,
        flow.w_radius,
        order,
        names=flow.names,
        t0=t0,
        energy=energy,
        longest_step=flow.longest_step,
        generation=generation,
        lean=flow.lean,
    )


def _candidates(fields: Sequence[Field], reach: ReachSet) -> list[Floats]:
    frame = fields[0].frame
    return [np.eye(reach.dim), principal_axes(reach), *([] if frame is None else [frame.V])]


def _around_one(flow: Flow, fields: Sequence[Field]) -> Piece | None:
    """The linear part of p as it is in the unknowns and its n largest columns, a parallelotope around the rest."""
    last = flow.last_set
    p, G = last.p, with_box(last.G, last.box) if last.box.any() else last.G
    n, free = len(p), flow.piece.chart.free
    if free == 0 and not len(flow.piece.uncertain):
        return None
    linear = flow.bounds.linear_part(p)
    size = np.abs(linear).sum(axis=1) + last.spread
    length = np.linalg.norm(linear[:, :free] / np.maximum(size, 1e-300)[:, None], axis=0)
    kept, small = np.split(np.argsort(-length, kind="stable"), [n])
    below, above = flow.bounds.nonlinear_radius(p)
    middle = 0.5 * (below + above)
    centre = p[:, 0] + middle
    rest = 0.5 * (above - below) * (1.0 + 1e-12) + 8.0 * UNIT * (np.abs(centre) + np.abs(middle))
    added = np.zeros((n + len(small), n, G.shape[2]))
    added[np.arange(n), np.arange(n), 0] = rest
    added[n:, :, 0] = linear[:, small].T
    around = ReachSet.of(flow.bounds, np.zeros_like(p), np.concatenate([G, added]))
    origin = np.zeros(n)
    found = tightest([around], _candidates(fields, around), origin)
    if found is None:
        return None
    M = found[0] * (found[1] * (1.0 + 1e-9))
    # The products are rounded entry by entry: what counts is that this very M holds the rest.
    if not (half_widths(around, M, origin) <= 1.0).all():
        return None
    chart = flow.piece.chart.around(centre, np.hstack([linear[:, np.sort(kept)], M]), original=False)
    # The same variables: the unknowns on the scale of their ranges in this piece.
    lo, hi = flow.piece.unknown_ranges
    return Piece.whole(replace(chart, unknown_lo=lo, unknown_hi=hi, tilt=linear[:, free:]))


def _around_all(flows: Sequence[Flow], fields: Sequence[Field]) -> Piece | None:
    """One parallelotope around the ends of all flows."""
    sets = [flow.last_set for flow in flows]
    hulls = [reach.ranges() for reach in sets]
    centre = 0.5 * (np.min([lo for lo, _ in hulls], axis=0) + np.max([hi for _, hi in hulls], axis=0))
    found = tightest(sets, _candidates(fields, sets[0]), centre)
    if found is None:
        return None
    M = found[0] * (found[1] * (1.0 + 1e-9))
    if not all((half_widths(reach, M, centre) <= 1.0).all() for reach in sets):
        return None
    chart = flows[0].piece.chart.around(centre, M, original=False)
    # Each piece scales its unknowns to a range of its own: what all hold is known in their units only.
    ranges = np.array([flow.piece.unknown_ranges for flow in flows])
    return Piece.whole(replace(chart, unknown_lo=ranges[:, 0].min(axis=0), unknown_hi=ranges[:, 1].max(axis=0)))
