"""What a finished flow shows: slack of the constraints, where it is nonlinear, whether samples break a constraint."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.proof import SafetyProof, least_slack
from modegraph.certify.samples import sample_powers
from modegraph.certify.switching.common_time import proved_instants
from modegraph.certify.verdict import Unproved, Widths
from modegraph.expression.evaluate import Evaluator
from modegraph.reach.cover.chain import Chain
from modegraph.reach.flow.flow import Flow
from modegraph.reach.tail.base import Tail

Floats = NDArray[np.float64]

INSTANTS = 8
"""Looks at the widths of a flow."""


def slack_until(flow: Flow, instant: int) -> dict[str, float]:
    """Proved slack of every constraint on [0, times[instant]]."""
    many: list[dict[str, float]] = []
    upper = flow.faces_at(flow.times[0], flow.set_at(0), flow.first_segment)
    many.append(_by_name(flow.fields[flow.first_segment].faces, upper))
    for step in flow.steps[:instant]:
        many.append(_by_name(flow.fields[step.segment].faces, step.face_upper))
    return least_slack(many)


def _by_name(names: Sequence[str], upper: Floats) -> dict[str, float]:
    out: dict[str, float] = {}
    for name, value in zip(names, upper, strict=True):
        out[name] = min(-float(value), out.get(name, np.inf))
    return out


def proved(chain: Chain) -> list[tuple[Flow, int]]:
    """The flows of a chain as far as the constraints are proved, each with its last proved instant."""
    found: list[tuple[Flow, int]] = []
    for flow in chain.flows:
        k = proved_instants(flow)
        if k >= 0:
            found.append((flow, k))
        if k < len(flow.steps):
            break
    return found


def proved_until(chain: Chain) -> float:
    """Seconds until which the constraints are proved; -1: not even at the start."""
    found = proved(chain)
    return float(found[-1][0].times[found[-1][1]]) if found else -1.0


def lasting(flows: Sequence[Flow], tail: Tail) -> SafetyProof:
    """The constraints for all time: over flows that lead to where a tail begins, and behind it."""
    after = _by_name(flows[-1].fields[-1].faces, tail.face_upper)
    tracking = np.max([tail.tracking, *(step.tracking for flow in flows for step in flow.steps)], axis=0)
    return SafetyProof(least_slack([*(slack_until(f, len(f.steps)) for f in flows), after]), tail.start, tracking)


def unproved(flow: Flow, proved: int) -> Unproved | None:
    """The constraint that is not proved on the step after instant ``proved`` (-1: at the start)."""
    if proved < 0:
        upper = flow.faces_at(flow.times[0], flow.set_at(0), flow.first_segment)
        names, when = flow.fields[flow.first_segment].faces, float(flow.times[0])
    else:
        step = flow.steps[proved] if proved < len(flow.steps) else flow.steps[-1]
        upper, names, when = step.face_upper, flow.fields[step.segment].faces, step.start
    if not len(upper):
        return None
    k = int(np.argmax(np.where(np.isnan(upper), np.inf, upper)))
    return Unproved(names[k], when, float(upper[k]))


def width_over_time(flows: Sequence[Flow]) -> Widths | None:
    """Widths at a few instants of flows that follow each other."""
    times, values = [], []
    for flow in flows:
        count = len(flow.steps)
        for k in sorted({round(j * count / INSTANTS) for j in range(INSTANTS + 1)}):
            lo, hi = flow.reach_set(k).ranges()
            times.append(float(flow.times[k]))
            values.append(hi - lo)
    if not times:
        return None
    return Widths(tuple(flows[0].names), np.array(times), np.array(values))


def sampled_violation(flow: Flow) -> bool:
    """Whether a sampled trajectory breaks a constraint at the end of the flow (floats: a guess)."""
    fld = flow.fields[flow.steps[-1].segment if flow.steps else 0]
    if not fld.faces or not flow.piece.known:
        return False
    powers = sample_powers(flow.piece, flow.bounds.exponents)
    inputs, _ = flow.variables_at(flow.time, flow.set_at(len(flow.steps)), fld)
    faces = Evaluator(fld.observed)(inputs @ powers.T)[: len(fld.faces)]
    return bool((faces > 0.0).any())


def set_size(flow: Flow) -> float:
    """Half-width of the last set of a flow, in the state where it is largest relative to the starts (floats)."""
    own, now = (np.abs(s.p[:, 1:]).sum(axis=1) + s.spread for s in (flow.reach_set(0), flow.last_set))
    return float((now / np.maximum(own, 1e-3 * own.max(initial=1e-300))).max(initial=0.0))
