"""Checking that a mode's functions give plain numbers where it starts."""

from __future__ import annotations

from typing import Any

import numpy as np

from modegraph.errors import ModegraphError
from modegraph.model.mode import Mode
from modegraph.model.plain_call import call_numeric
from modegraph.model.reference import Floats
from modegraph.model.sets import Box, Set

TYPICAL = 12
"""Points at which sizes are compared."""


def require_finite_values(mode: Mode, p: Floats | None, start: Set) -> None:
    """Call the mode's functions in floats at the centre of the start set, t = 0, w and d centred.

    Raises
    ------
    ModegraphError
        If one of them fails, or returns a wrong length, NaN or an infinity; names mode, function
        and remedy.
    """
    owner = f"mode {mode.label_of(p)!r}"
    n = mode.system.n
    x, z = np.array(start.center[:n]), np.array(start.center[n:])
    r = mode.reference.at(0.0, p)

    def values(function: Any, available: dict[str, object], role: str, length: int | None) -> Floats:
        with np.errstate(all="ignore"):
            result = call_numeric(function, available, role=role, owner=owner)
        return _finite_vector(result, length, f"{owner}, {role}", x)

    memory = mode.memory
    if memory is not None:
        reset = values(memory.reset, {"x": x, "r": r}, "memory reset", memory.k)
        z = z if z.size else reset
    seen: dict[str, object] = {"x": x, "r": r, "t": 0.0}
    if memory is not None:
        seen["z"] = z
    u = np.zeros(0) if mode.controller is None else values(mode.controller, seen, "controller", mode.system.p)
    plant: dict[str, object] = {"x": x, "u": u}
    if mode.system.disturbance is not None:
        plant["w"] = np.array(mode.system.disturbance.center)
    if mode.system.unknowns:
        plant["d"] = mode.system.unknown_centres()
    values(mode.system.dynamics, plant, "dynamics", n)
    if memory is not None:
        values(memory.dynamics, {**seen, "u": u}, "memory dynamics", memory.k)
    if mode.output is not None:
        values(mode.output, {"x": x}, "output", None)


def typical_values(mode: Mode, start: Set, region: Box | None) -> Floats:
    """Values (nvar, B) around the centre of a start set: states, memory, time, disturbance, unknowns, parameters.

    They only serve to compare sizes; ``region`` holds the parameters of a class.
    """
    rng = np.random.default_rng(3)
    lo, hi = start.bounding_box()
    centre = np.zeros(mode.dim)
    spread = np.full(mode.dim, 0.1)
    centre[: start.dim] = start.center
    spread[: start.dim] = np.maximum(0.5 * (hi - lo), 0.1 * (1.0 + np.abs(start.center)))
    constants = [*mode.system.unknowns.values(), *(zip(region.lo, region.hi, strict=True) if region else ())]
    box = mode.system.disturbance
    q = mode.system.q
    low = np.concatenate([centre - spread, [0.0], np.zeros(q) if box is None else box.lo, [a for a, _ in constants]])
    high = np.concatenate([centre + spread, [0.0], np.zeros(q) if box is None else box.hi, [b for _, b in constants]])
    return low[:, None] + (high - low)[:, None] * rng.random((len(low), TYPICAL))


def _finite_vector(result: Any, length: int | None, where: str, x: Floats) -> Floats:
    try:
        vector = np.asarray(result, dtype=float)
    except ModegraphError as error:
        from modegraph.expression.repeatable import impure

        raise impure(where, "it returns a value that it kept from an earlier call") from error
    except (TypeError, ValueError):
        raise ModegraphError(f"{where} returned {result!r}, not a vector of numbers; return np.array([...])") from None
    if vector.ndim == 0 and length in (1, None):
        vector = vector.reshape(1)
    if vector.ndim != 1 or (length is not None and len(vector) != length):
        wanted = "a vector" if length is None else f"shape ({length},)"
        raise ModegraphError(f"{where} returned shape {vector.shape}, expected {wanted}")
    if not np.isfinite(vector).all():
        place = ", ".join(f"{value:.6g}" for value in x)
        raise ModegraphError(
            f"{where} returned {vector.tolist()} at x = ({place}), the centre of the start set; "
            "look for a division by zero, or a logarithm or root of a number that is not positive"
        )
    return vector
