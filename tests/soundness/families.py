"""Modes whose references are continuous classes, and thousands of their runs at once in plain floats.

Model functions are written so that they also take columns: x (n, k), r (m, k), one column a run. They are
the user's own callables, evaluated on columns.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import modegraph as mg
from tests.soundness.loop import Reference, read
from tests.soundness.sets import starts

Vector = np.ndarray
HOLDS = 8
"""Pieces of constant disturbance in a run."""
Signal = Callable[[Any, Any], tuple[Any, Any, Any]]
"""(t, p) -> r, r', r''; p (k, runs)."""


@dataclass(frozen=True)
class Family:
    """A mode with a class of references; ``signal`` where they move, smooth between ``breaks``."""

    name: str
    mode: mg.Mode
    until: float
    signal: Signal | None = None
    breaks: tuple[float, ...] = ()

    @property
    def region(self) -> mg.Box:
        region = self.mode.reference.region
        assert region is not None
        return region


def references(family: Family, count: int, rng: np.random.Generator) -> Vector:
    """(count, k) references: corners and faces of the class among them."""
    lo, hi = family.region.lo, family.region.hi
    share = rng.uniform(0.0, 1.0, (count, len(lo)))
    edge = rng.random(share.shape) < 0.4
    share = np.where(edge, np.round(share), share)
    return np.clip(lo + share * (hi - lo), lo, hi)


def runs(family: Family, p: Vector, times: Vector, rng: np.random.Generator) -> Vector:
    """States (times, n + k, runs), one run for each row of p (runs, k), at instants > 0."""
    mode = family.mode
    x = np.stack([_start(family, row, rng) for row in p]).T
    p = p.T
    if mode.memory is not None:
        z = np.atleast_2d(read(mode.memory.reset, {"x": x, "r": _reference(family, 0.0, p)}))
        x = np.vstack([x, z])
    d = {k: rng.choice([lo, hi, 0.5 * (lo + hi)], p.shape[1]) for k, (lo, hi) in mode.system.unknowns.items()}
    box = mode.system.disturbance
    q = 0 if box is None else box.dim
    w = rng.choice([-1.0, 1.0, 0.2], (HOLDS, q, p.shape[1]))
    w[:, :, ::3] = w[:1, :, ::3]
    if box is not None:
        w = 0.5 * (box.lo + box.hi)[:, None] + 0.5 * (box.hi - box.lo)[:, None] * w
    cuts = np.unique([*np.linspace(0.0, family.until, HOLDS + 1), *family.breaks])
    out = np.full((len(times), *x.shape), np.nan)
    for begin, end in pairwise(cuts):
        push = w[min(HOLDS - 1, int(0.5 * (begin + end) / family.until * HOLDS))]
        inside = np.flatnonzero((times > begin) & (times <= end))
        asked = np.unique(np.append(times[inside], end))
        middle = 0.5 * (begin + end)

        def rate(t: float, y: Vector, push: Vector = push, middle: float = middle) -> Vector:
            return _slope(family, t, middle, y.reshape(-1, p.shape[1]), p, d, push).ravel()

        found = solve_ivp(rate, (begin, end), x.ravel(), "DOP853", t_eval=asked, rtol=1e-11, atol=1e-12)
        assert found.success
        states = found.y.T.reshape(len(asked), *x.shape)
        out[inside] = states[np.searchsorted(asked, times[inside])]
        x = states[-1]
    return out


def _reference(family: Family, t: float, p: Vector, middle: float | None = None) -> Reference:
    if family.signal is None:
        r = np.asarray(p, float).view(Reference)
        r.dot, r.ddot = np.zeros(p.shape), np.zeros(p.shape)
    else:
        # Inside a piece the formula of that piece counts, also at its ends.
        value, dot, ddot = family.signal(np.clip(t, *_piece(family, t if middle is None else middle)), p)
        r = np.asarray(value, float).view(Reference)
        r.dot, r.ddot = np.asarray(dot, float), np.asarray(ddot, float)
    r.p = p
    return r


def _piece(family: Family, middle: float) -> tuple[float, float]:
    cuts = [0.0, *family.breaks, np.inf]
    begin, end = next((a, b) for a, b in pairwise(cuts) if a <= middle < b)
    return begin, float(np.nextafter(end, begin)) if np.isfinite(end) else end


def _start(family: Family, p: Vector, rng: np.random.Generator) -> Vector:
    start = family.mode.start
    if callable(start):
        start = read(start, {"r": _one(family, p)})
    return starts(start, 4, rng)[rng.integers(4)]


def _one(family: Family, p: Vector) -> Reference:
    column = _reference(family, 0.0, p[:, None])
    r = np.asarray(column)[:, 0].view(Reference)
    r.dot, r.ddot, r.p = column.dot[:, 0], column.ddot[:, 0], p
    return r


def _slope(family: Family, t: float, middle: float, y: Vector, p: Vector, d: Any, w: Vector) -> Vector:
    mode = family.mode
    n = mode.system.n
    known: dict[str, Any] = {"x": y[:n], "z": y[n:], "r": _reference(family, t, p, middle), "t": t, "d": d, "w": w}
    known["u"] = np.atleast_2d(read(mode.controller, known))
    dx = np.stack([np.broadcast_to(row, y[0].shape) for row in read(mode.system.dynamics, known)])
    if mode.memory is None:
        return dx
    return np.vstack([dx, np.atleast_2d(read(mode.memory.dynamics, known))])


# -- the families --------------------------------------------------------------------------------


def pendulum() -> Family:
    """A damped pendulum held at any angle; the ball of starts grows with the angle."""
    plant = mg.System(lambda x, u: np.array([x[1], np.sin(x[0]) - 0.3 * x[1] + u[0]]), states="a v", inputs="u")
    return Family("pendulum", mg.Mode(
        "pendulum", plant,
        controller=lambda x, r: -6.0 * (x[0] - r[0]) - 3.0 * x[1] - np.sin(r[0]),
        reference=mg.setpoint(mg.Box([-0.5], [0.7])),
        start=lambda r: mg.Ball([np.sin(r[0]), 0.1 * r[0]], 0.1 + 0.05 * r[0] ** 2),
    ), 3.0)  # fmt: skip


def pushed() -> Family:
    """The same loop under a disturbance, from an ellipsoid."""
    plant = mg.System(
        lambda x, u, w: np.array([x[1], np.sin(x[0]) + u[0] + w[0]]), states="a v", inputs="u",
        disturbance=mg.Box([-0.1], [0.15]),
    )  # fmt: skip
    return Family("pushed", mg.Mode(
        "pushed", plant,
        controller=lambda x, r: -6.0 * (x[0] - r[0]) - 3.0 * x[1],
        reference=mg.setpoint(mg.Box([0.0], [0.5])),
        start=lambda r: mg.Ellipsoid(np.array([r[0], 0.0]), np.array([[0.02, 0.005], [0.005, 0.03]])),
    ), 3.0)  # fmt: skip


def oscillator() -> Family:
    """Van der Pol with an unknown constant and two parameters, from a zonotope whose generators turn with them."""
    plant = mg.System(
        lambda x, u, d: np.array([x[1], d["mu"] * (1.0 - x[0] ** 2) * x[1] - x[0] + u[0]]), states="x y", inputs="u",
        unknowns={"mu": (0.9, 1.1)},
    )  # fmt: skip
    return Family("oscillator", mg.Mode(
        "oscillator", plant,
        controller=lambda x, r: -2.0 * (x[1] - r[1]) - x[0] * (r[0] - 1.0),
        reference=mg.setpoint(mg.Box([0.5, -0.2], [1.0, 0.3])),
        start=lambda r: mg.Zonotope(
            [r[0] * r[1], 1.0 + r[1]], np.array([[0.1, 0.05 * r[0], 0.0], [0.02, 0.1, 0.1 * r[1]]])
        ),
    ), 2.5)  # fmt: skip


def follower() -> Family:
    """A unicycle-like loop with an integrator that follows a moving class with a kink; its reset reads r."""

    def signal(t: Any, p: Any) -> tuple[Any, Any, Any]:
        ramp = [p[0] * np.minimum(t, 0.5) + np.sin(p[1] * t), p[1] * np.maximum(t - 0.5, 0.0)]
        speed = [p[0] * (t < 0.5) + p[1] * np.cos(p[1] * t), p[1] * (t >= 0.5)]
        twice = [-(p[1] ** 2) * np.sin(p[1] * t), 0.0 * p[1]]
        if t > 1.0:
            ramp = [0.5 * p[0] + np.sin(p[1]), 0.5 * p[1]]
            speed = twice = [0.0 * p[0], 0.0 * p[0]]
        return tuple(np.stack([np.broadcast_to(v, np.shape(p[0])) for v in part]) for part in (ramp, speed, twice))  # type: ignore[return-value]

    def traced(t: Any, p: Any) -> Any:
        return np.array(
            [np.where(t < 0.5, p[0] * t, 0.5 * p[0]) + np.sin(p[1] * t), np.where(t < 0.5, 0.0, p[1] * (t - 0.5))]
        )

    plant = mg.System(
        lambda x, u: np.array([x[1], u[0] - 0.2 * x[0] ** 3, -x[2] + u[1]]), states="s v y", inputs="u1 u2"
    )

    def controller(x: Any, z: Any, r: Any) -> Any:
        wanted = r.ddot[0] - 4.0 * (x[1] - r.dot[0]) - 4.0 * (x[0] - r[0]) - z[0]
        return np.array([wanted, r.dot[1] + r[1] - 3.0 * (x[2] - r[1])])

    return Family("follower", mg.Mode(
        "follower", plant, controller=controller,
        reference=mg.trajectory(traced, 1.0, over=mg.Box([0.2, 0.5], [0.8, 1.0]), breakpoints=[0.5]),
        start=lambda r: mg.Box(
            np.array([r[0] - 0.1, r.dot[0] - 0.1 - 0.05 * r.p[1], r[1]]),
            np.array([r[0] + 0.1, r.dot[0] + 0.1, r[1] + 0.1 * r.p[0]]),
        ),
        memory=mg.Memory("i", lambda x, r: 0.5 * (x[:1] - r[:1]), lambda x, r: 0.3 * (x[:1] - r[:1] - 0.2 * r.dot[:1])),
    ), 2.0, signal, (0.5, 1.0))  # fmt: skip


def quotient() -> Family:
    """A rational controller, three parameters, a start set that does not depend on them."""
    plant = mg.System(lambda x, u: np.array([x[1], u[0] - 0.5 * np.tanh(x[1])]), states="x v", inputs="u")
    return Family("quotient", mg.Mode(
        "quotient", plant,
        controller=lambda x, r: -(x[0] - r[0]) * r[1] / (1.0 + 0.5 * x[0] * r[2]) - 2.0 * x[1],
        reference=mg.setpoint(mg.Box([0.0, 3.0, -0.5], [0.4, 4.0, 0.5])),
        start=mg.Box([-0.2, -0.1], [0.1, 0.1]),
    ), 3.0)  # fmt: skip


def arm() -> Family:
    """Computed torque for an arm whose second mass is not quite known: quotients near the identity."""

    def inertia(q: Any, m: Any) -> tuple[Any, Any, Any]:
        c = 0.5 * m * np.cos(q)
        return 1.0 / 3.0 + 4.0 / 3.0 * m + 2.0 * c, m / 3.0 + c, m / 3.0

    def swirl(x: Any, m: Any) -> tuple[Any, Any]:
        s = 0.5 * m * np.sin(x[1])
        return -s * x[3] * (2.0 * x[2] + x[3]), s * x[2] ** 2

    def dynamics(x: Any, u: Any, d: Any) -> Any:
        a, b, c = inertia(x[1], d["m"])
        e, f = swirl(x, d["m"])
        r, s = u[0] - e, u[1] - f
        det = a * c - b * b
        return np.array([x[2], x[3], (c * r - b * s) / det, (a * s - b * r) / det])

    def torque(x: Any, r: Any) -> Any:
        a, b, c = inertia(x[1], 1.0)
        e, f = swirl(x, 1.0)
        v, w = -9.0 * (x[0] - r[0]) - 6.0 * x[2], -9.0 * (x[1] - r[1]) - 6.0 * x[3]
        return np.array([a * v + b * w + e, b * v + c * w + f])

    plant = mg.System(dynamics, states="q1 q2 v1 v2", inputs="u1 u2", unknowns={"m": (0.95, 1.05)})
    return Family("arm", mg.Mode(
        "arm", plant, controller=torque, reference=mg.setpoint(mg.Box([0.1, 0.9], [0.3, 1.1])),
        start=lambda r: mg.Ellipsoid(np.array([0.5 * r[0], r[1], 0.0, 0.0]), np.diag([0.01, 0.01, 0.02, 0.02])),
    ), 1.5)  # fmt: skip


FAMILIES = {make.__name__: make for make in (pendulum, pushed, oscillator, follower, quotient, arm)}
