"""What is observed along a step: constraints, the energy of the inputs, tracking errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.arguments import program
from modegraph.enclosure.observe import observe_step, observed_bounds
from modegraph.enclosure.rounding import UNIT
from modegraph.reach.field import Field

if TYPE_CHECKING:
    from modegraph.reach.flow.flow import Flow

Floats = NDArray[np.float64]


def observed_along(flow: Flow, fld: Field, h: float, tube: Floats) -> tuple[Floats, Floats, float, Floats]:
    """Along the step just tried: upper bounds of the faces, u'u over its time (polynomial, radius), tracking errors."""
    faces = len(fld.faces)
    ends, slack = _ends(flow, fld, h, tube, flow.seen, 3)
    upper, tracking = observed_bounds(ends, slack, np.int64(faces), *flow.seen_bounds.arrays)
    if faces and not (upper <= 0.0).all():
        fine_ends, fine_slack = _ends(flow, fld, h, tube, flow.order.degree, flow.time_degree)
        fine = flow.bounds.upper(fine_ends[:2, :faces]).max(axis=0) + fine_slack[:faces, 0]
        for i in np.flatnonzero(~(fine <= 0.0)):
            if np.isfinite(fine_slack[i, 0]):
                limit = -fine_slack[i, 0]
                refined = [flow.bounds.refined_upper(fine_ends[s, i], limit) for s in (0, 1)]
                fine[i] = min(fine[i], max(refined) + fine_slack[i, 0])
        # Ends are added and compared in floats: one rounding each.
        upper = np.fmin(upper, fine + 4.0 * UNIT * np.abs(fine))
    return upper, ends[2, faces], float(slack[faces, 1]), tracking


def _ends(flow: Flow, fld: Field, h: float, tube: Floats, q: int, K: int) -> tuple[Floats, Floats]:
    o = fld.observed
    size = int(flow.table.start[q + 1])
    space = flow.space(f"o{q},{K}", o, K, size, q)
    big = flow.series
    radius = np.zeros(fld.variables)
    radius[: fld.states] = tube
    radius[fld.first_w : fld.first_d] = flow.w_radius
    return observe_step(
        big, fld.rates.variables, program(o), radius, h, np.full(K + 1, q, np.int64), space, flow.table.arrays
    )
