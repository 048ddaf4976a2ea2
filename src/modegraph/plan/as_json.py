"""Plans, verdicts and switches as plain data whose keys are the attribute names."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from modegraph.certify.continuous import ContinuousReferences, Side
from modegraph.certify.references import References
from modegraph.certify.verdict import Verdict
from modegraph.graph.switch import Switch
from modegraph.model.sets import Box

if TYPE_CHECKING:
    from modegraph.plan.plan import Plan


def plain(value: Any) -> Any:
    """``value`` with arrays as lists and every number that JSON lacks (NaN, infinity) as None."""
    if isinstance(value, dict):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def json_text(data: Any) -> str:
    """Strict JSON text of ``plain`` data."""
    return json.dumps(plain(data), indent=2, allow_nan=False)


def verdict_data(v: Verdict) -> dict[str, Any]:
    """A verdict as data."""
    witness = None
    if v.witness is not None:
        w = v.witness
        witness = {
            "x0": w.x0, "w": w.w, "d": dict(w.d), "r_i": w.r_i, "r_j": w.r_j, "time": w.time, "kind": w.kind,
        }  # fmt: skip
    return {
        "status": v.status.value,
        "reason": v.reason,
        "why": [reason.data() for reason in v.why],
        "time": v.time,
        "margin": v.margin,
        "slack": dict(v.slack),
        "witness": witness,
        "horizon": v.horizon,
        "until": v.until,
        "energy": v.energy,
        "window": v.window,
        "tracking": v.tracking,
        "widths": None if v.widths is None else {
            "states": list(v.widths.states), "times": v.widths.times, "values": v.widths.values,
        },
        "closest": None if v.closest is None else asdict(v.closest),
        "unproved": None if v.unproved is None else asdict(v.unproved),
    }  # fmt: skip


CELLS = 12
"""Products listed of a continuous R^ij, the largest."""


def references_data(refs: References | ContinuousReferences) -> Any:
    """The certified pairs ``[r_i, r_j]``; of continuous classes some certified products of boxes."""
    if isinstance(refs, ContinuousReferences):
        return {"cells": [{"source": _side(c.source), "target": _side(c.target)} for c in refs.cells[:CELLS]]}
    return [[r_i, r_j] for r_i, r_j in refs]


def _side(side: Side) -> Any:
    return {"lo": side.lo, "hi": side.hi} if isinstance(side, Box) else list(side)


def switch_data(s: Switch) -> dict[str, Any]:
    """A switch as data."""
    return {
        "source": s.source,
        "target": s.target,
        "references": references_data(s.references),
        "time": s.time,
        "energy": s.energy,
        "margin": s.margin,
        "window": s.window,
    }


def plan_data(plan: Plan) -> dict[str, Any]:
    """A plan as data."""
    return {
        "modes": plan.modes,
        "references": plan.references,
        "switches": [switch_data(s) for s in plan.switches],
        "time": plan.time,
        "energy": plan.energy,
        "cost": plan.cost,
        "bound": plan.bound,
        "gap": plan.gap,
        "margin": plan.margin,
        "objective": plan.objective,
        "goal_check": verdict_data(plan.goal_check),
        "warnings": list(plan.warnings),
    }
