"""Control modes: a plant under one controller, from a set of starts, tracking a class of references."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from modegraph.errors import ModegraphError, NotBuiltYet
from modegraph.model.immutable import Replaceable
from modegraph.model.memory import Memory
from modegraph.model.names import require_callable, require_name
from modegraph.model.reference import Floats, Reference, text_of
from modegraph.model.sets import Set
from modegraph.model.system import System
from modegraph.model.trajectory import positive


class Mode(Replaceable):
    """A control mode q_i (Definition 2.1 of the paper). Everything is kept under its own name.

    Parameters
    ----------
    name : str
    system : System
    controller : callable
        Reads by name any of x, r, t, z; returns (p,), or a number when p = 1. None for a plant without inputs.
    reference : Reference
        From :func:`setpoint`, :func:`trajectory`, :func:`quintic`, ...
    start : callable or set
        S_i(r): a function of r that returns a set, or a constant set, over the plant states or over
        plant states and memory.
    constraints : callable, optional
        X_i: reads any of x, u, r, t, z, w, d; returns {name: relation}.
    output : callable, optional
        h_i: reads x, returns (m,); only for the reported tracking bound.
    horizon : float, optional
        Seconds; overrides the horizon of ``build``.
    memory : Memory, optional
        States of a dynamic controller.
    """

    def __init__(
        self,
        name: str,
        system: System,
        *,
        controller: Callable[..., Any] | None,
        reference: Reference,
        start: Callable[..., Any] | Set,
        constraints: Callable[..., Any] | None = None,
        output: Callable[..., Any] | None = None,
        horizon: float | None = None,
        memory: Memory | None = None,
        hold: float | None = None,
    ) -> None:
        self.name = require_name(name, "Mode: name")
        if hold is not None:
            raise NotBuiltYet(
                f"{self.label}: hold= (a digital controller) is not built yet; "
                "leave it out to prove the continuous controller"
            )
        if not isinstance(system, System):
            raise ModegraphError(f"{self.label}: system must be a System, got {type(system).__name__}")
        if not isinstance(reference, Reference):
            raise ModegraphError(
                f"{self.label}: reference must be a reference, got {type(reference).__name__}; "
                "wrap a constant as mg.setpoint(value), a signal as mg.trajectory(signal, duration)"
            )
        if memory is not None and not isinstance(memory, Memory):
            raise ModegraphError(f"{self.label}: memory must be a Memory, got {type(memory).__name__}")
        if controller is None and system.p:
            raise ModegraphError(
                f"{self.label}: controller must be a function; None is for a plant without inputs (inputs=0), and "
                f"this one has {', '.join(system.inputs)}"
            )
        for role, function in (("controller", controller), ("constraints", constraints), ("output", output)):
            if function is not None:
                require_callable(function, f"{self.label}: {role}")
        if not isinstance(start, Set) and not callable(start):
            raise ModegraphError(
                f"{self.label}: start must be a set or a function of r that returns one, got {type(start).__name__}"
            )
        shared = [z for z in (memory.states if memory else ()) if z in system.states]
        if shared:
            raise ModegraphError(
                f"{self.label}: {shared[0]!r} names a plant state and a memory state; rename the memory state"
            )
        self.system = system
        self.controller = controller
        self.reference = reference
        self.start = start
        self.constraints = constraints
        self.output = output
        self.horizon = None if horizon is None else positive(horizon, f"{self.label}: horizon")
        self.memory = memory
        self.hold = hold

    @property
    def label(self) -> str:
        """How error messages call this mode."""
        return f"mode {self.name!r}"

    @property
    def dim(self) -> int:
        """Number of plant and memory states, n + k."""
        return self.system.n + self.k

    @property
    def k(self) -> int:
        """Number of memory states."""
        return 0 if self.memory is None else self.memory.k

    @property
    def state_names(self) -> tuple[str, ...]:
        """Plant states, then memory states."""
        return self.system.states + (() if self.memory is None else self.memory.states)

    def label_of(self, p: object = None) -> str:
        """The mode with one of its references, such as "hover(0.5, 1)"; the name alone for a singleton or a class."""
        if self.reference.region is not None:
            return self.name + ("" if p is None else text_of(self.find(p)))
        known = self.reference.parameters()
        index = self.match(p)
        return self.name if len(known) == 1 else self.name + text_of(known[index])

    def find(self, p: object = None, *, whole: bool = False) -> Floats | None:
        """The parameters of a reference as a user names it; an error names the mode and what exists.

        With ``whole``, None stands for all of a continuous class.
        """
        if whole and p is None and self.reference.region is not None:
            return None
        try:
            return self.reference.find(p)
        except ModegraphError as error:
            raise ModegraphError(f"{self.label}: {error}") from None

    def match(self, p: object = None) -> int:
        """Index of a reference of a finite class as a user names it; an error names the mode and what exists."""
        try:
            return self.reference.match(p)
        except ModegraphError as error:
            raise ModegraphError(f"{self.label}: {error}") from None

    def __repr__(self) -> str:
        return f"Mode({self.name!r})"
