"""The closed loop as its author wrote it: the user's own callables, evaluated in plain floats.

Nothing here shares code with the library beyond reading the attributes of Mode and System, so that an
error of the tracer, the simplifier or the integrator of modegraph cannot hide behind itself.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.integrate import DOP853

MOST_STEPS = 2000  # between two cuts; a run that needs more is chattering or at a pole and ends there

Vector = np.ndarray
Policy = Callable[[float, Vector], Vector]  # (t, joint state) -> disturbance, held until the next decision
Signal = Callable[[float], tuple[Vector, Vector, Vector]]  # t -> r, r', r''


class Reference(np.ndarray):
    """An (m,) float array with ``.dot``, ``.ddot`` and ``.p``: what model functions see as ``r``."""

    dot: Any
    ddot: Any
    p: Any

    @staticmethod
    def make(value: Any, dot: Any = None, ddot: Any = None, p: Any = None) -> Reference:
        r = np.atleast_1d(np.asarray(value, float)).view(Reference)
        r.dot = np.zeros(r.shape) if dot is None else np.atleast_1d(np.asarray(dot, float))
        r.ddot = np.zeros(r.shape) if ddot is None else np.atleast_1d(np.asarray(ddot, float))
        r.p = p
        return r


def read(fn: Callable[..., Any], available: Mapping[str, Any]) -> Any:
    """Call ``fn`` with the arguments it names."""
    names = _parameters(fn)
    return fn(**{name: available[name] for name in names if name in available})


_signatures: dict[int, tuple[Any, tuple[str, ...]]] = {}


def _parameters(fn: Callable[..., Any]) -> tuple[str, ...]:
    known = _signatures.get(id(fn))
    if known is None or known[0] is not fn:
        known = (fn, tuple(inspect.signature(fn).parameters))
        _signatures[id(fn)] = known
    return known[1]


@dataclass
class Loop:
    """One mode under one reference, one value of the unknown constants.

    ``signal`` gives a moving reference and its derivatives; without it the set-point is held.
    ``breaks`` are the instants where the reference is not smooth.
    """

    mode: Any
    p: Any = None
    d: Mapping[str, float] = field(default_factory=dict)
    signal: Signal | None = None
    breaks: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        self.system = self.mode.system
        self.n = count(self.system.states)
        disturbance = self.system.disturbance
        self.rest = np.zeros(0) if disturbance is None else (disturbance.lo + disturbance.hi) / 2
        if self.signal is None:
            value = self.p if self.p is not None else self.mode.reference.value(0.0, None)
            self._constant = Reference.make(value, p=self.p)

    def reference(self, t: float) -> Reference:
        if self.signal is None:
            return self._constant
        return Reference.make(*self.signal(t), p=self.p)

    def start_set(self) -> Any:
        start = self.mode.start
        return read(start, {"r": self.reference(0.0)}) if callable(start) else start

    def initial(self, x0: Vector) -> Vector:
        """The joint state (x, z) on entry."""
        if self.mode.memory is None or len(x0) > self.n:
            return np.asarray(x0, float)
        z = read(self.mode.memory.reset, {"x": np.asarray(x0, float), "r": self.reference(0.0)})
        return np.concatenate([x0, np.atleast_1d(np.asarray(z, float))])

    def arguments(self, t: float, y: Vector, w: Vector) -> dict[str, Any]:
        x = y[: self.n]
        known: dict[str, Any] = {
            "x": x,
            "z": y[self.n :],
            "r": self.reference(t),
            "t": t,
            "d": self.d,
            "w": w,
        }
        known["u"] = np.atleast_1d(np.asarray(read(self.mode.controller, known), float))
        return known

    def slope(self, t: float, y: Vector, w: Vector) -> Vector:
        known = self.arguments(t, y, w)
        dx = np.atleast_1d(np.asarray(read(self.system.dynamics, known), float))
        if self.mode.memory is None:
            return dx
        dz = np.atleast_1d(np.asarray(read(self.mode.memory.dynamics, known), float))
        return np.concatenate([dx, dz])

    def broken(self, t: float, y: Vector, w: Vector, blur: float = 0.0) -> list[str]:
        """Names of the constraints that fail at (t, y) and also at every neighbour ``blur`` away."""
        if self.mode.constraints is None:
            return []
        names = self._false(t, y, w)
        if names and blur > 0.0:
            for k in range(len(y)):
                for sign in (-1.0, 1.0):
                    near = y.copy()
                    near[k] += sign * blur
                    names &= self._false(t, near, w)
        return sorted(names)

    def _false(self, t: float, y: Vector, w: Vector) -> set[str]:
        relations = read(self.mode.constraints, self.arguments(t, y, w))
        return {name for name, holds in relations.items() if not np.all(holds)}


def count(names: Any) -> int:
    """Number of states or inputs, however they were given."""
    if isinstance(names, int):
        return names
    return len(names.split()) if isinstance(names, str) else len(names)


@dataclass
class Trajectory:
    """Samples of one run: t (k,), y (k, n + memory), w (k, q), u (k, p), and the interpolants between."""

    t: Vector
    y: Vector
    w: Vector
    u: Vector
    pieces: list[tuple[float, float, Any]]
    ended: float  # where the integrator stopped

    def at(self, t: float) -> Vector:
        for lo, hi, interpolant in self.pieces:
            if lo <= t <= hi:
                return np.asarray(interpolant(t))
        raise ValueError(f"no sample at t = {t}; the run covers [0, {self.ended}]")


def run(
    loop: Loop,
    x0: Vector,
    policy: Policy,
    hold: float,
    until: float,
    *,
    rtol: float = 1e-10,
    atol: float = 1e-13,
    between: int = 4,
    max_step: float = 0.25,
) -> Trajectory:
    """Integrate with DOP853; the disturbance is decided every ``hold`` seconds and held in between."""
    cuts = {float(b) for b in loop.breaks if 0.0 < b < until} | {until}
    if np.isfinite(hold):
        cuts |= {k * hold for k in range(1, int(until / hold) + 1) if k * hold < until}
    y, t = loop.initial(x0), 0.0
    ts, ys, ws, us, pieces = [], [], [], [], []
    for cut in sorted(cuts):
        if cut - t < 1e-13:
            continue
        w = policy(t, y)
        right = np.nextafter(cut, t)  # one-sided: a signal that jumps at the cut is read before it
        solver = DOP853(
            lambda s, v, w=w, right=right: loop.slope(min(s, right), v, w),
            t,
            y,
            cut,
            rtol=rtol,
            atol=atol,
            max_step=max_step,
        )
        steps = 0
        while solver.status == "running":
            solver.step()
            steps += 1
            lost = not np.all(np.isfinite(solver.y)) or np.max(np.abs(solver.y)) > 1e6
            if solver.status == "failed" or lost or steps > MOST_STEPS:
                return _finish(loop, ts, ys, ws, us, pieces, t)
            interpolant = solver.dense_output()
            pieces.append((solver.t_old, solver.t, interpolant))
            for s in np.linspace(solver.t_old, solver.t, between + 1):
                state = np.asarray(interpolant(s))
                ts.append(float(s))
                ys.append(state)
                ws.append(w)
                us.append(loop.arguments(min(float(s), float(right)), state, w)["u"])
        t, y = cut, solver.y
    return _finish(loop, ts, ys, ws, us, pieces, t)


def _finish(loop: Loop, ts: list, ys: list, ws: list, us: list, pieces: list, ended: float) -> Trajectory:
    width = len(ys[0]) if ys else loop.n
    return Trajectory(
        np.array(ts),
        np.array(ys).reshape(-1, width),
        np.array(ws).reshape(len(ts), -1),
        np.array(us).reshape(len(ts), -1),
        pieces,
        ended,
    )
