"""Entering a mode from a state: is it allowed, and with which controller memory."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.references import Parameter
from modegraph.errors import ModegraphError
from modegraph.model.mode import Mode
from modegraph.model.plain_call import call_numeric
from modegraph.model.sets.base import Set
from modegraph.model.start import mode_start
from modegraph.model.target import Target

Floats = NDArray[np.float64]


def plain_state(x: Any, n: int) -> Floats:
    """A plant state as an (n,) float array, or an error with expected and given shape."""
    try:
        state = np.atleast_1d(np.asarray(x, dtype=float))
    except (TypeError, ValueError):
        raise ModegraphError(f"a state must be {n} numbers, not {x!r}") from None
    if state.shape != (n,):
        raise ModegraphError(f"a state must have shape ({n},), not {state.shape}")
    if not np.all(np.isfinite(state)):
        raise ModegraphError(f"a state must be finite, not {state.tolist()}")
    return state


def memory_on_entry(mode: Mode, p: Parameter, x: Floats) -> Floats:
    """z = reset(x, r) with r the reference at t = 0; (0,) without memory."""
    if mode.memory is None:
        return np.zeros(0)
    known = {"x": x, "r": mode.reference.at(0.0, p)}
    z = call_numeric(mode.memory.reset, known, role="memory reset", owner=f"mode {mode.name!r}")
    return np.asarray(z, dtype=float).reshape(mode.k)


class Entry:
    """The set a state must lie in for a mode (or Target) to be entered with one reference."""

    def __init__(self, mode: Mode | Target, p: Parameter) -> None:
        self._mode = mode
        self._p = p
        self.set: Set = mode.set if isinstance(mode, Target) else mode_start(mode, p)
        everything = np.full(self.set.dim, -np.inf), np.full(self.set.dim, np.inf)
        self._lo: Floats
        self._hi: Floats
        self._lo, self._hi = self.set.bounding_box() if self.set.is_bounded() else everything

    def contains(self, x: Floats) -> bool:
        """Whether the mode may be entered from x (n,). Exact for a start set given on x.

        One given on (x, z) is asked about the memory the reset would give, computed in floats.
        """
        point = x
        if isinstance(self._mode, Mode) and self.set.dim > len(x):
            point = np.concatenate([x, memory_on_entry(self._mode, self._p, x)])
        if not np.all((self._lo <= point) & (point <= self._hi)):
            return False
        return self.set.contains(point)


def may_enter(mode: Mode | Target, p: Parameter, x: Floats) -> bool:
    """Whether ``mode`` with reference ``p`` may be entered from the state x (n,)."""
    return Entry(mode, p).contains(x)
