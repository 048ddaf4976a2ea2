"""How a trap is asked and judged.

A trap is a pair for which a careless method says yes. ``assert_not_certified`` is for pairs where
condition (C) is false (REFUTED is welcome, and its witness is integrated), ``assert_not_refuted`` for pairs
where (C) is true but hard (UNDECIDED is acceptable). ``assert_certified`` is for the relaxed twin, which a
useful engine must prove; its time bounds are checked against sampled runs.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import modegraph as mg
from tests.soundness.checker import claims, examine, refutation_holds

BUDGET = 15.0
"""Seconds of work for one question; a trap is small."""


def flow(name: str, dynamics: Callable[..., Any], start: Any, *, states: Any = None, **options: Any) -> mg.Mode:
    """A mode whose plant needs no control: x' = dynamics(x) or dynamics(x, w, d)."""
    plant_options = {key: options.pop(key) for key in ("disturbance", "unknowns") if key in options}
    plant = mg.System(dynamics, states=start.dim if states is None else states, inputs=1, **plant_options)
    options.setdefault("controller", lambda x: 0.0)
    options.setdefault("reference", mg.setpoint([0.0]))
    return mg.Mode(name, plant, start=start, **options)


def goal(lo: Any, hi: Any) -> mg.Target:
    return mg.Target("goal", mg.Box(lo, hi))


def ask(source: mg.Mode, target: Any, horizon: float, r_i: Any = None, r_j: Any = None) -> mg.Verdict:
    graph = mg.build([source, target], horizon=horizon, budget=BUDGET)
    return graph.verdict(source.name, target.name, r_i, r_j)


def assert_certified(
    source: mg.Mode, target: Any, horizon: float, *, signal: Any = None, breaks: Any = ()
) -> mg.Verdict:
    verdict = ask(source, target, horizon)
    assert verdict.status is mg.Status.CERTIFIED, verdict.reason
    assert verdict.time is not None
    earliest, latest = verdict.time
    assert 0.0 <= earliest <= latest <= horizon
    if isinstance(target, mg.Target):
        claimed = claims({target.name: (target.set, verdict)})
        assert not examine(source, claimed, runs=14, signal=signal, breaks=breaks)
    return verdict


def assert_not_certified(
    source: mg.Mode, target: Any, horizon: float, *, signal: Any = None, breaks: Any = ()
) -> mg.Verdict:
    verdict = ask(source, target, horizon)
    assert verdict.status is not mg.Status.CERTIFIED, f"false certificate: {verdict}"
    assert verdict.reason
    if verdict.status is mg.Status.REFUTED and isinstance(target, mg.Target):
        assert refutation_holds(source, target.set, verdict, horizon, signal=signal, breaks=breaks) is None, (
            f"{verdict} is not supported by its witness"
        )
    return verdict


def assert_not_refuted(source: mg.Mode, target: Any, horizon: float) -> mg.Verdict:
    verdict = ask(source, target, horizon)
    assert verdict.status is not mg.Status.REFUTED, f"false refutation: {verdict}"
    return verdict


def polytope(lo: Any, hi: Any) -> mg.Polytope:
    """A box written as half-planes."""
    lo, hi = np.asarray(lo, float), np.asarray(hi, float)
    return mg.Polytope(np.vstack([np.eye(len(lo)), -np.eye(len(lo))]), np.concatenate([hi, -lo]))
