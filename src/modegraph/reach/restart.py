"""Start a flowpipe again from a parallelotope around its end.

The set variables are given up for new ones: what was remainder becomes polynomial. Under a
disturbance the remainder is as large as the set after a while, and only boxes of it feed the
nonlinear terms; a contracting loop forgets the loss of the new start. (Without disturbance
restarting only widens: recipe, section 5.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .field import Field
from .flow import Flow, Order
from .parallelotope import half_widths, principal_axes, tightest
from .start import Piece


def restarted(flows: Sequence[Flow], fields: Sequence[Field], order: Order) -> Flow | None:
    """A flow that continues ``flows`` from a parallelotope around their ends; None if none is found.

    It starts at the latest of their instants: valid for several only where the loop does not depend
    on time. ``fields`` may be in another frame than those of the flows.
    """
    sets = [(flow.bounds, *flow.state_set(len(flow.steps))) for flow in flows]
    n = len(sets[0][1])
    hulls = [flow.end_box() for flow in flows]
    centre = 0.5 * (np.min([lo for lo, _ in hulls], axis=0) + np.max([hi for _, hi in hulls], axis=0))
    candidates = [np.eye(n), principal_axes(*sets[0])]
    if fields[0].frame is not None:
        candidates.append(fields[0].frame.V)
    found = tightest(sets, candidates, centre)
    if found is None:
        return None
    axes, widths = found
    M = axes * (widths * (1.0 + 1e-9))
    # The products are rounded entry by entry: what counts is that this very M holds the sets.
    if not all((half_widths(bounds, p, G, M, centre) <= 1.0).all() for bounds, p, G in sets):
        return None
    first = flows[0]
    chart = replace(first.piece.chart, centre=centre, axes=M, round=False, faces=None)
    m = first.piece.chart.free
    lo = np.concatenate([-np.ones(n), np.min([flow.piece.lo[m:] for flow in flows], axis=0)])
    hi = np.concatenate([np.ones(n), np.max([flow.piece.hi[m:] for flow in flows], axis=0)])
    spent = [float(f.seen_bounds.upper(f.steps[-1].energy) + f.steps[-1].energy_radius) for f in flows]
    return Flow(
        fields,
        Piece(chart, lo, hi),
        first.w_centre,
        first.w_radius,
        order,
        names=first.names,
        stops=first.stops,
        t0=max(flow.time for flow in flows),
        energy=max(spent),
        longest_step=first.longest_step,
    )
