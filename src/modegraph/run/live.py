"""One mode of a run: the user's own functions in plain floats."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.references import Parameter
from modegraph.errors import ModegraphError
from modegraph.graph.entry import memory_on_entry
from modegraph.model.mode import Mode
from modegraph.model.system import System

Floats = NDArray[np.float64]
Function = Callable[[Mapping[str, Any]], Any]
Plant = System | Callable[..., Any] | None


def numeric(function: Callable[..., Any], owner: str, role: str) -> Function:
    """The user's function, called with floats: it takes what it names out of a mapping.

    An exception inside becomes a ModegraphError that names ``owner`` and ``role``.
    """
    known = inspect.signature(function).parameters.values()
    names = [q.name for q in known if q.kind in (q.POSITIONAL_OR_KEYWORD, q.KEYWORD_ONLY)]

    def call(values: Mapping[str, Any]) -> Any:
        try:
            return function(**{name: values[name] for name in names if name in values})
        except ModegraphError:
            raise
        except Exception as error:
            raise ModegraphError(f"{owner}: the {role} failed with {type(error).__name__}: {error}") from error

    return call


def _no_input() -> Floats:
    """The controller of a plant without inputs."""
    return np.zeros(0)


class Live:
    """The closed loop of ``mode`` under the reference ``p``.

    Parameters
    ----------
    plant : System, callable or None
        What really happens. A callable reads any of t (seconds since the run began), x, u and
        returns x' (n,). None is the mode's own system. Disturbance and unknowns of a System are at
        the centre of their ranges.
    entered : float
        Seconds since the run began.
    """

    def __init__(self, mode: Mode, p: Parameter, plant: Plant, entered: float) -> None:
        owner = f"mode {mode.name!r}"
        self.mode = mode
        self.p = p
        self.entered = entered
        self.n = mode.system.n
        self._controller = numeric(mode.controller or _no_input, owner, "controller")
        system = plant if isinstance(plant, System) else mode.system
        if isinstance(plant, System) and (plant.n != mode.system.n or plant.p != mode.system.p):
            raise ModegraphError(
                f"simulate: plant has {plant.n} states and {plant.p} inputs, {owner} expects "
                f"{mode.system.n} and {mode.system.p}"
            )
        if plant is None or isinstance(plant, System):
            self._dynamics = numeric(system.dynamics, owner, "dynamics")
        else:
            self._dynamics = numeric(plant, "simulate", "function plant=")
        w = np.zeros(0) if system.disturbance is None else system.disturbance.center
        self._fixed: dict[str, Any] = {"w": np.array(w, dtype=float), "d": system.unknown_centres()}
        self._clocked = not (plant is None or isinstance(plant, System))
        self._constraints = None if mode.constraints is None else numeric(mode.constraints, owner, "constraints")
        self._memory = None if mode.memory is None else numeric(mode.memory.dynamics, owner, "memory dynamics")
        duration = mode.reference.duration
        inner = [b for b in mode.reference.breakpoints if 0 < b < duration]
        self.breaks = sorted({*inner, duration} - {0.0}) if np.isfinite(duration) else sorted(inner)

    def entry(self, x: Floats) -> Floats:
        """The joint state (x, z) on entry: the memory is reset."""
        return np.concatenate([x, memory_on_entry(self.mode, self.p, x)])

    def values(self, t: float, y: Floats, end: float) -> dict[str, Any]:
        """All that model functions may read, t seconds after entry, on a piece that ends at ``end``."""
        side = "left" if t >= end else "right"
        r = self.mode.reference.at(min(t, end), self.p, side)  # type: ignore[arg-type]
        values: dict[str, Any] = {"x": y[: self.n], "z": y[self.n :], "t": t, "r": r, **self._fixed}
        values["u"] = self._vector(self._controller(values), self.mode.system.p, "controller")
        return values

    def slope(self, t: float, y: Floats, end: float) -> Floats:
        """(x', z')."""
        values = self.values(t, y, end)
        seen = {**values, "t": self.entered + t} if self._clocked else values
        dx = self._vector(self._dynamics(seen), self.n, "dynamics")
        if self._memory is None:
            return dx
        dz = self._vector(self._memory(values), len(y) - self.n, "memory dynamics")
        return np.concatenate([dx, dz])

    def violated(self, values: Mapping[str, Any]) -> list[str]:
        """Names of the constraints that do not hold for these values."""
        if self._constraints is None:
            return []
        return [name for name, holds in self._constraints(values).items() if not np.all(holds)]

    def require_finite(self, y: Floats) -> None:
        """An error if a function is undefined at the state the mode is entered with."""
        for role, value in (
            ("controller", self.values(0.0, y, np.inf)["u"]),
            ("dynamics", self.slope(0.0, y, np.inf)),
        ):
            if not np.all(np.isfinite(value)):
                raise ModegraphError(
                    f"mode {self.mode.name!r}: the {role} returned {value.tolist()} on entry "
                    f"at x = {y[: self.n].tolist()}"
                )

    def _vector(self, value: Any, length: int, role: str) -> Floats:
        vector = np.atleast_1d(np.asarray(value, dtype=float))
        if vector.shape != (length,):
            raise ModegraphError(
                f"mode {self.mode.name!r}: the {role} returned shape {vector.shape}, expected ({length},)"
            )
        return vector
