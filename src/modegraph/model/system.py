"""Plants: dynamics with named states and inputs, disturbances and unknown constants."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from types import MappingProxyType
from typing import Any

import numpy as np

from modegraph.errors import ModegraphError
from modegraph.model.immutable import Replaceable
from modegraph.model.names import names_of, require_callable, require_name
from modegraph.model.sets import Box

Names = str | int | Iterable[str]


class System(Replaceable):
    """A plant x' = dynamics(x, u, w, d).

    Parameters
    ----------
    dynamics : callable
        Plain NumPy; reads by name any of x (n,), u (p,), w (q,), d (``d["name"]``), returns (n,).
    states, inputs : list of names, one spaced string, or a count
        Kept as tuples of names. ``inputs=0`` is a plant without input.
    disturbance : Box, optional
        The disturbance w(t) is any measurable signal in it.
    unknowns : {name: (lo, hi)}, optional
        Constants that are not known better; lo = hi is allowed.
    name : str, optional
        For error messages.

    Attributes
    ----------
    n, p, q : int
        Numbers of states, inputs and disturbances.
    """

    def __init__(
        self,
        dynamics: Callable[..., Any],
        *,
        states: Names,
        inputs: Names,
        disturbance: Box | None = None,
        unknowns: Mapping[str, tuple[float, float]] | None = None,
        name: str | None = None,
    ) -> None:
        self.name = None if name is None else require_name(name, "System: name")
        what = "System" if name is None else f"System {name!r}"
        require_callable(dynamics, f"{what}: dynamics")
        self.dynamics = dynamics
        self.states = names_of(states, "x", f"{what}: states")
        if not self.states:
            raise ModegraphError(f"{what}: states is empty; a plant has at least one state")
        self.inputs = names_of(inputs, "u", f"{what}: inputs")
        if disturbance is not None and not isinstance(disturbance, Box):
            raise ModegraphError(
                f"{what}: disturbance must be a Box of the values it may take, got {type(disturbance).__name__}"
            )
        self.disturbance = disturbance
        self.unknowns: Mapping[str, tuple[float, float]] = MappingProxyType(_unknowns(unknowns or {}, what))

    @classmethod
    def affine(
        cls,
        f: Callable[..., Any],
        g: Callable[..., Any],
        *,
        states: Names,
        inputs: Names,
        disturbance: Box | None = None,
        unknowns: Mapping[str, tuple[float, float]] | None = None,
        name: str | None = None,
    ) -> System:
        """The plant x' = f + g u (equation 1 of the paper).

        f returns (n,); g returns (n, p), or (n,) when there is one input. Both may read x, w and d.
        The two are kept as ``system.dynamics.f`` and ``system.dynamics.g``.
        """
        what = "System.affine" if name is None else f"System.affine {name!r}"
        require_callable(f, f"{what}: f")
        require_callable(g, f"{what}: g")
        return cls(
            AffineDynamics(f, g, what),
            states=states,
            inputs=inputs,
            disturbance=disturbance,
            unknowns=unknowns,
            name=name,
        )

    @property
    def n(self) -> int:
        return len(self.states)

    @property
    def p(self) -> int:
        return len(self.inputs)

    @property
    def q(self) -> int:
        return 0 if self.disturbance is None else self.disturbance.dim

    @property
    def label(self) -> str:
        """How error messages call this plant."""
        return "the plant" if self.name is None else f"the plant {self.name!r}"

    def unknown_centres(self) -> dict[str, float]:
        """The middle of every unknown constant, inside its bounds."""
        return {
            name: min(max(float((Fraction(lo) + Fraction(hi)) / 2), lo), hi) for name, (lo, hi) in self.unknowns.items()
        }

    def __repr__(self) -> str:
        name = "" if self.name is None else f"{self.name!r}, "
        return f"System({name}states={' '.join(self.states)!r}, inputs={' '.join(self.inputs)!r})"


class AffineDynamics:
    """f + g u as one function of what f and g read."""

    def __init__(self, f: Callable[..., Any], g: Callable[..., Any], what: str = "System.affine") -> None:
        self.f, self.g = f, g
        self._reads = {"f": _reads(f, f"{what}: f"), "g": _reads(g, f"{what}: g")}
        for part, names in self._reads.items():
            if "u" in names:
                raise ModegraphError(f"{what}: {part} may read x, w and d, but not u; the input enters as g @ u")
        order = dict.fromkeys([*self._reads["f"], *self._reads["g"], "u"])
        self.__signature__ = inspect.Signature(
            [inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD) for name in order]
        )

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        values = self.__signature__.bind(*args, **kwargs).arguments
        drift = _array(self.f(**{name: values[name] for name in self._reads["f"]}))
        matrix = _array(self.g(**{name: values[name] for name in self._reads["g"]}))
        u = values["u"]
        if matrix.ndim == 1 and len(u) == 1:
            matrix = matrix.reshape(-1, 1)
        drift = np.atleast_1d(drift)
        if matrix.ndim != 2 or matrix.shape != (len(drift), len(u)):
            raise ModegraphError(
                f"g returned shape {matrix.shape}, expected ({len(drift)}, {len(u)}): "
                "one row a state, one column an input"
            )
        return drift + matrix @ u


def _reads(function: Callable[..., Any], what: str) -> tuple[str, ...]:
    """Names a function asks for; a parameter with a default keeps it unless it is called x, u, w or d."""
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        raise ModegraphError(f"{what} must be a Python function whose arguments can be read") from None
    names = []
    for parameter in parameters:
        if parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD, parameter.POSITIONAL_ONLY):
            raise ModegraphError(
                f"{what} must name what it reads (x, w, d), without *args, **kwargs or positional-only arguments"
            )
        if parameter.default is parameter.empty or parameter.name in ("x", "u", "w", "d"):
            names.append(parameter.name)
    return tuple(names)


def _array(value: Any) -> Any:
    """Numbers as a float array, traced values as a traced one."""
    from modegraph.expression.array import TracedArray, is_traced

    return TracedArray(value) if is_traced([value]) else np.asarray(value, dtype=float)


def _unknowns(given: Mapping[str, tuple[float, float]], what: str) -> dict[str, tuple[float, float]]:
    if not isinstance(given, Mapping):
        raise ModegraphError(f"{what}: unknowns must be a dict of name: (lo, hi), got {type(given).__name__}")
    result = {}
    for name, bounds in given.items():
        require_name(name, f"{what}: an unknown's name")
        try:
            lo, hi = (float(value) for value in bounds)
        except (TypeError, ValueError):
            raise ModegraphError(f"{what}: unknown {name!r} must be a pair (lo, hi), got {bounds!r}") from None
        if not (math.isfinite(lo) and math.isfinite(hi)):
            raise ModegraphError(f"{what}: unknown {name!r} has bounds ({lo}, {hi}); both must be finite")
        if lo > hi:
            raise ModegraphError(f"{what}: unknown {name!r} is inverted: {lo} > {hi}; exchange the bounds")
        result[name] = (lo, hi)
    return result
