"""A mode or a target with one thing changed; everything else is that of the original."""

from __future__ import annotations

from typing import Any

import numpy as np

from modegraph.errors import ModegraphError
from modegraph.model.mode import Mode
from modegraph.model.reference import Floats, Points, Reference, Setpoint, setpoint
from modegraph.model.sets import Set
from modegraph.model.start import mode_start
from modegraph.model.target import Target
from modegraph.model.trajectory import Trajectory, trajectory


def with_horizon(mode: Mode, horizon: float | None) -> Mode:
    """The mode with a horizon of its own (None: that of ``build``)."""
    return mode.replace(horizon=horizon)


def without_constraints(mode: Mode) -> Mode:
    """The mode with nothing to keep."""
    return mode.replace(constraints=None)


def with_start(mode: Mode, p: Floats | None, start: Set) -> Mode:
    """The mode with this start set under the reference p; under its other references the start sets stay."""
    if len(mode.reference.parameters()) == 1:
        return mode.replace(start=start)

    def start_of(r: Any) -> Set:
        own = getattr(r, "p", None)
        own = np.atleast_1d(np.asarray(r, float)) if own is None else own
        return start if np.array_equal(own, np.asarray(p)) else mode_start(mode, own)

    return mode.replace(start=start_of)


def with_set(target: Mode | Target, p: Floats | None, entered: Set) -> Mode | Target:
    """The mode, or target, with this set of states from which it may be entered (a mode: under the reference p)."""
    return Target(target.name, entered) if isinstance(target, Target) else with_start(target, p, entered)


def narrowed(mode: Mode, members: list[Floats]) -> Mode:
    """A mode with a continuous class of references, for these of them only.

    Raises
    ------
    ModegraphError
        If they are none of its references.
    """
    listed = Points([np.asarray(mode.find(p)) for p in members])
    return mode.replace(reference=_of_points(mode.reference, listed))


def _of_points(reference: Reference, points: Points) -> Reference:
    if isinstance(reference, Setpoint):
        return setpoint(points)
    if isinstance(reference, Trajectory):
        return trajectory(reference.signal, reference.duration, over=points, breakpoints=reference.breakpoints)
    raise ModegraphError(f"a {type(reference).__name__} cannot be narrowed to some of its references")
