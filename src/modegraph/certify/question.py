"""What is asked of the flows of one mode: its targets, and until when."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from modegraph.certify.targets.region import Region
from modegraph.certify.verdict import Floats
from modegraph.deadline import Deadline
from modegraph.expression.tape import Tape
from modegraph.model.mode import Mode
from modegraph.model.target import Target
from modegraph.reach.compiled import CompiledMode

LOOKS = 400
"""Steps within the horizon, at least, for a linear loop, where they cost little; else half of that."""
LONGEST = 1000.0
"""Seconds of flow after which a mode without horizon and without a tail is given up."""


@dataclass(frozen=True, eq=False)
class TargetSpec:
    """A target of a unit: a mode under the reference p (None: its whole class), or a `Target`."""

    name: str
    p: Floats | None
    mode: Mode | Target


@dataclass(frozen=True)
class Goal:
    """A target: its set, and the reset of its memory as a function of the plant states if it has one."""

    region: Region
    reset: Tape | None


@dataclass(frozen=True)
class Question:
    """The goals of one compiled mode.

    Attributes
    ----------
    compiled : CompiledMode
    goals : mapping of a number to a Goal
    horizon : float or None
        Seconds a switch may take; None: until a tail is certified.
    deadline : Deadline
    tick : callable(text)
        Told how far the work is; may raise to end it.
    until : float
        Seconds after which nothing is looked at, the steps being those of the horizon.
    """

    compiled: CompiledMode
    goals: Mapping[int, Goal]
    horizon: float | None
    deadline: Deadline
    tick: Callable[[str], None] = lambda text: None
    until: float = np.inf

    @property
    def linear(self) -> bool:
        return self.compiled.linear

    @property
    def disturbed(self) -> bool:
        """A disturbance meets a nonlinear loop: remainders grow by it, and flows are restarted."""
        return not self.linear and bool(self.compiled.w_radius.any())

    @property
    def autonomous(self) -> bool:
        """Time does not matter: flows may go on together from the latest of their instants."""
        return all(f.autonomous for f in self.compiled.fields)

    @property
    def end(self) -> float:
        """Instant at which a flow is given up, seconds."""
        return min(self.until, LONGEST if self.horizon is None else self.horizon)

    @property
    def longest_step(self) -> float:
        """A crossing is looked for at the ends of steps only: enough of them within the horizon."""
        return np.inf if self.horizon is None else self.horizon / (LOOKS if self.linear else LOOKS / 2)
