"""What a benchmark gives to the library: a model, a set of starts and a duration, nothing else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import modegraph as mg


@dataclass(frozen=True)
class Case:
    """``model(start)`` is the mode; a mode with constraints is a property to be proved until ``until``."""

    name: str
    model: Callable[[mg.Box], mg.Mode]
    start: mg.Box
    until: float

    def mode(self) -> mg.Mode:
        return self.model(self.start)


def around(centre: Any, radius: Any) -> mg.Box:
    """The box centre +- radius."""
    return mg.Box(
        [c - r for c, r in zip(centre, radius, strict=True)], [c + r for c, r in zip(centre, radius, strict=True)]
    )


def autonomous(name: str, dynamics: Callable[..., Any], states: str, start: mg.Box, **plant: Any) -> mg.Mode:
    """x' = dynamics(x, ...), without an input."""
    system = mg.System(dynamics, states=states, inputs="none", **plant)
    return mg.Mode(name, system, controller=lambda x: 0.0, reference=mg.setpoint([0.0]), start=start)
