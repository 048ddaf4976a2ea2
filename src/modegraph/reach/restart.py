"""Start a flowpipe again from a parallelotope around its end.

The set variables are given up for new ones: what was remainder becomes polynomial. Under a
disturbance the remainder is as large as the set after a while, and only its box feeds the nonlinear
terms; a contracting loop forgets the loss of the new start. (Without disturbance restarting only
widens: recipe, section 5.)
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .flow import Flow, Order
from .parallelotope import half_widths, modal_axes, principal_axes, tightest
from .start import Piece


def restarted(flow: Flow, order: Order) -> Flow | None:
    """A flow that continues ``flow`` from a parallelotope around its last set; None if none is found."""
    p, _ = flow.set_at(len(flow.steps))
    n = len(p)
    centre = p[:, 0].copy()
    found = tightest(flow, (np.eye(n), modal_axes(flow.slope), principal_axes(flow)), centre)
    if found is None:
        return None
    axes, widths = found
    M = axes * (widths * (1.0 + 1e-9))
    # The products are rounded entry by entry: what counts is that this very M holds the set.
    if not (half_widths(flow, M, centre, range(n)) <= 1.0).all():
        return None
    chart = replace(flow.piece.chart, centre=centre, axes=M, round=False, faces=None)
    m = flow.piece.chart.free
    lo = np.concatenate([-np.ones(n), flow.piece.lo[m:]])
    hi = np.concatenate([np.ones(n), flow.piece.hi[m:]])
    step = flow.steps[-1]
    spent = float(flow.small_bounds.upper(step.energy) + step.energy_radius)
    return Flow(
        flow.fields,
        Piece(chart, lo, hi),
        flow.w_centre,
        flow.w_radius,
        order,
        names=flow.names,
        stops=flow.stops,
        t0=flow.time,
        energy=spent,
    )
