"""What a finished flow shows: slack of the constraints, where it is nonlinear, whether samples break a constraint."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..expression.evaluate import Evaluator
from ..reach.flow import Flow
from ..reach.framing import generator_box
from .proof import least_slack
from .samples import sample_powers
from .verdict import Widths

Floats = NDArray[np.float64]

INSTANTS = 8
"""Looks at the widths of a flow."""


def slack_until(flow: Flow, instant: int) -> dict[str, float]:
    """Proved slack of every constraint on [0, times[instant]]."""
    many: list[dict[str, float]] = []
    upper = flow.faces_at(flow.times[0], flow.p0, flow.G0, flow.first_segment)
    many.append(_by_name(flow.fields[flow.first_segment].faces, upper))
    for step in flow.steps[:instant]:
        many.append(_by_name(flow.fields[step.segment].faces, step.face_upper))
    return least_slack(many)


def _by_name(names: Sequence[str], upper: Floats) -> dict[str, float]:
    out: dict[str, float] = {}
    for name, value in zip(names, upper, strict=True):
        out[name] = min(-float(value), out.get(name, np.inf))
    return out


def width_over_time(flows: Sequence[Flow]) -> Widths | None:
    """Widths at a few instants of flows that follow each other."""
    times, values = [], []
    for flow in flows:
        count = len(flow.steps)
        for k in sorted({round(j * count / INSTANTS) for j in range(INSTANTS + 1)}):
            p, G = flow.state_set(k)
            lo, hi = flow.bounds.ranges(p)
            times.append(float(flow.times[k]))
            values.append(hi - lo + 2.0 * generator_box(G))
    if not times:
        return None
    return Widths(tuple(flows[0].names), np.array(times), np.array(values))


def sampled_violation(flow: Flow) -> bool:
    """Whether a sampled trajectory breaks a constraint at the end of the flow (floats: a guess)."""
    fld = flow.fields[flow.steps[-1].segment if flow.steps else 0]
    if not fld.faces or not flow.piece.known:
        return False
    p, G = flow.set_at(len(flow.steps))
    powers = sample_powers(flow.piece, flow.bounds.exponents)
    inputs, _ = flow.variables_at(flow.time, p, G, fld)
    faces = Evaluator(fld.observed)(inputs @ powers.T)[: len(fld.faces)]
    return bool((faces > 0.0).any())


def set_size(flow: Flow) -> float:
    """Half-width of the last set of a flow, in the state where it is largest relative to the starts (floats)."""
    p, G = flow.state_set(len(flow.steps))
    start, slack = flow.state_set(0)
    own = np.abs(start[:, 1:]).sum(axis=1) + generator_box(slack)
    now = np.abs(p[:, 1:]).sum(axis=1) + generator_box(G)
    return float((now / np.maximum(own, 1e-3 * own.max(initial=1e-300))).max(initial=0.0))
