"""Flowpipes contain every run that starts in their start set, at instants and over intervals."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import modegraph as mg
from tests.soundness.adversary import signals
from tests.soundness.examples import cubic, load, trapezoid
from tests.soundness.loop import Loop, run
from tests.soundness.population import HORIZON, case
from tests.soundness.sets import starts

RUNS = 10


def escapes(mode: Any, pipe: Any, until: float, *, signal: Any = None, breaks: tuple[float, ...] = ()) -> list[str]:
    """Samples of random runs that lie outside ``pipe.at(t)`` or ``pipe.hull(t0, t1)``."""
    rng = np.random.default_rng(5)
    unknowns = mode.system.unknowns or {}
    found = []
    nominal = {name: (lo + hi) / 2 for name, (lo, hi) in unknowns.items()}
    cells = np.linspace(0.0, until, 9)
    hulls = [pipe.hull(float(a), float(b)) for a, b in pairwise(cells)]
    instants = np.concatenate([cells, rng.uniform(0.0, until, 6)])
    slices = [pipe.at(float(t)) for t in instants]
    for k, x0 in enumerate(starts(Loop(mode, None, nominal, signal, breaks).start_set(), RUNS, rng)):
        drawn = {name: float(rng.choice([lo, hi, (lo + hi) / 2])) for name, (lo, hi) in unknowns.items()}
        loop = Loop(mode, None, drawn, signal, breaks)
        policy, hold = signals(loop, None, rng)(k)
        trajectory = run(loop, x0, policy, hold, until)
        assert trajectory.ended >= until * (1 - 1e-9)
        for t, box in zip(instants, slices, strict=True):
            found += _outside(box, trajectory.at(float(min(t, trajectory.ended))), float(t))
        index = np.clip(np.searchsorted(cells, trajectory.t, side="right") - 1, 0, len(hulls) - 1)
        for t, y, cell in zip(trajectory.t, trajectory.y, index, strict=True):
            found += _outside(hulls[cell], y, float(t))
    return found


def _outside(box: Any, y: np.ndarray, t: float, tolerance: float = 2e-9) -> list[str]:
    over = np.maximum(box.lo - y, y - box.hi)
    k = int(np.argmax(over))
    return [f"state {k} is {over[k]:.3g} outside at t = {t:.6g}"] if over[k] > tolerance else []


@pytest.mark.parametrize("name, until", [("q1", 1.5), ("q2", 1.5), ("q3", 1.0), ("q4", 6.5), ("q5", 1.5), ("q7", 1.5)])
def test_two_link_arm(name: str, until: float) -> None:
    module = load("two_link_arm")
    mode = next(m for m in module.modes if m.name == name)
    trap, cuts = trapezoid(module.A, module.B, 1.25, 5.0)
    signal, breaks = {"q4": (cubic(module.A, module.B, 6.0), (6.0,)), "q5": (trap, cuts)}.get(name, (None, ()))
    pipe = mg.flowpipe(mode, horizon=until)
    assert pipe.complete, pipe.reason
    assert not escapes(mode, pipe, until, signal=signal, breaks=breaks)


@pytest.mark.parametrize("seed", range(12))
def test_random_systems(seed: int) -> None:
    mode = case(seed).mode
    pipe = mg.flowpipe(mode, horizon=HORIZON / 2)
    until = float(min(pipe.times[-1], HORIZON / 2))
    if not pipe.complete:
        assert pipe.reason
    if until > 0.1:
        try:
            found = escapes(mode, pipe, until)
        except AssertionError:
            assert not pipe.complete
            return
        assert not found


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(12, 60))
def test_random_systems_campaign(seed: int) -> None:
    test_random_systems(seed)


def test_asking_past_the_end_raises() -> None:
    pipe = mg.flowpipe(case(0).mode, horizon=1.0)
    with pytest.raises(mg.ModegraphError):
        pipe.at(float(pipe.times[-1]) + 1.0)
    with pytest.raises(mg.ModegraphError):
        pipe.hull(0.5, float(pipe.times[-1]) + 1.0)
