"""The shipped examples as the checker sees them: modes, references written out by hand, start samples."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

import modegraph as mg
from tests.soundness.checker import Claim, Violation, claims, examine
from tests.soundness.loop import Loop, Signal

ROOT = Path(__file__).parents[2]


def load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / "examples" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def cubic(a: np.ndarray, b: np.ndarray, duration: float) -> Signal:
    """Rest-to-rest minimum of the integral of |r''|^2: 3 s^2 - 2 s^3."""

    def signal(t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        if t >= duration:
            return b, 0 * b, 0 * b
        s = t / duration
        way = b - a
        return (
            a + way * (3 * s**2 - 2 * s**3),
            way * (6 * s - 6 * s**2) / duration,
            way * (6 - 12 * s) / duration**2,
        )

    return signal


def trapezoid(a: np.ndarray, b: np.ndarray, speed: float, acceleration: float) -> tuple[Signal, tuple[float, ...]]:
    """Synchronised trapezoid: the longest coordinate runs at its limits, the others keep its clock."""
    way = float(np.max(np.abs(b - a)))
    ramp = speed / acceleration
    duration = way / speed + ramp
    top, steep = (b - a) / way * speed, (b - a) / way * acceleration

    def signal(t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        if t < ramp:
            return a + steep * t**2 / 2, steep * t, steep
        if t < duration - ramp:
            return a + top * (t - ramp / 2), top, 0 * b
        if t < duration:
            left = duration - t
            return b - steep * left**2 / 2, steep * left, -steep
        return b, 0 * b, 0 * b

    return signal, (ramp, duration - ramp, duration)


@dataclass(frozen=True)
class Source:
    """A mode under one reference, with what it was certified to reach."""

    mode: Any
    p: Any
    signal: Signal | None
    breaks: tuple[float, ...]
    claims: tuple[Claim, ...]

    def examine(self, runs: int, seed: int = 0) -> list[Violation]:
        return examine(self.mode, self.claims, runs=runs, seed=seed, p=self.p, signal=self.signal, breaks=self.breaks)


def arm_sources(graph: Any, module: ModuleType) -> list[Source]:
    trap, breaks = trapezoid(module.A, module.B, 1.25, 5.0)
    moving = {"q4": (cubic(module.A, module.B, 6.0), (6.0,)), "q5": (trap, breaks)}
    loops = {mode.name: Loop(mode, None, {}, *moving.get(mode.name, (None, ()))) for mode in module.modes}
    found = []
    for mode in module.modes:
        verdicts = {
            other.name: (loops[other.name].start_set(), graph.verdict(mode.name, other.name))
            for other in module.modes
            if other is not mode
        }
        signal, cuts = moving.get(mode.name, (None, ()))
        found.append(Source(mode, None, signal, cuts, tuple(claims(verdicts))))
    return found


def point_mass_sources(graph: Any, module: ModuleType) -> list[Source]:
    found = []
    for mode in module.modes:
        for p in module.STATIONS:
            verdicts = {}
            for other in module.modes:
                for q in module.STATIONS:
                    if other is mode and p == q:
                        continue
                    region = Loop(other, np.asarray(q)).start_set()
                    verdicts[f"{other.name} at {q[0]}"] = (region, graph.verdict(mode.name, other.name, p, q))
            found.append(Source(mode, np.asarray(p), None, (), tuple(claims(verdicts))))
    return found


def build(module: ModuleType) -> Any:
    return mg.build(module.modes, horizon=module.horizon)


def total(sources: Sequence[Source]) -> int:
    return sum(len(source.claims) for source in sources)
