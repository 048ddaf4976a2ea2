"""The states a dynamic controller keeps for itself."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from modegraph.errors import ModegraphError
from modegraph.model.immutable import Replaceable
from modegraph.model.names import names_of, require_callable
from modegraph.model.system import Names


class Memory(Replaceable):
    """Controller states z with z' = dynamics(x, u, r, t, z), set to reset(x, r) when the mode is entered.

    Parameters
    ----------
    states : list of names, one spaced string, or a count
        Kept as a tuple of names.
    dynamics : callable
        Reads by name any of x, u, r, t, z; returns (k,).
    reset : callable
        Reads x, r; returns (k,).
    """

    def __init__(self, states: Names, dynamics: Callable[..., Any], reset: Callable[..., Any]) -> None:
        self.states = names_of(states, "z", "Memory: states")
        if not self.states:
            raise ModegraphError("Memory: states is empty; leave memory=None for a static controller")
        require_callable(dynamics, "Memory: dynamics")
        require_callable(reset, "Memory: reset")
        self.dynamics = dynamics
        self.reset = reset

    @property
    def k(self) -> int:
        return len(self.states)

    def __repr__(self) -> str:
        return f"Memory({' '.join(self.states)!r})"
