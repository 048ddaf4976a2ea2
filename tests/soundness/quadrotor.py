"""The planar quadrotor written down again in plain numbers, flown along a plan through all kinds of wind."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm

Vector = Any

PUSH = 0.25
MASS, ARM, INERTIA, GRAVITY = 0.5, 0.17, 2.32e-3, 9.81
HOLD, LOOKS = 0.1, 10
"""Seconds for which a gust lasts at least, and looks of the supervisor in that time."""
STAY = 2.0
"""Seconds in the last mode."""
TOLERANCE = 1e-7


@dataclass(frozen=True)
class Wind:
    """Force (2,) in N from the seconds since the run began, the state (6,), and the seconds a mode has left.

    ``held``: it is looked at once a hold; otherwise it depends on time alone.
    """

    force: Callable[[float, Vector, float], Vector]
    held: bool = True


KINDS = ("constant", "bang-bang", "smooth", "with the motion", "against the motion", "costate")


def smooth(t: float, duration: float) -> Vector:
    """From 0 to 1, its first and its second derivative; held behind the duration."""
    if t >= duration:
        return np.array([1.0, 0.0, 0.0])
    s = t / duration
    return np.array([
        s**3 * (10 - 15 * s + 6 * s**2),
        30 * s**2 * (1 - s) ** 2 / duration,
        60 * s * (1 - s) * (1 - 2 * s) / duration**2,
    ])  # fmt: skip


def wanted(mode: str, p: Vector, t: float) -> tuple[Vector, Vector, Vector]:
    """Position, velocity and acceleration (2,) of the reference."""
    still = np.zeros(2)
    if mode == "hover":
        return np.array(p), still, still
    if mode == "touchdown":
        return np.array([p[0], 0.0]), np.array([0.0, -0.25]), still
    a, b, duration = {
        "climb": lambda: ([p[0], p[1]], [p[0], p[2]], 5.0),
        "cruise": lambda: ([p[0], p[1]], [p[0] + p[2], p[1]], 6.0),
        "land": lambda: ([p[0], p[1]], [p[0], 0.15], 4.0),
    }[mode]()
    way = np.subtract(b, a)
    s = smooth(t, duration)
    return a + way * s[0], way * s[1], way * s[2]


def rotors(mode: str, p: Vector, t: float, x: Vector) -> Vector:
    """Thrusts of the rear and the front rotor, N."""
    r, v, a = wanted(mode, p, t)
    kz, dz = (0.0, 5.0) if mode == "touchdown" else (6.0, 5.0)
    ax = a[0] + 3.15 * (v[0] - x[3]) + 3.8 * (r[0] - x[0])
    az = a[1] + dz * (v[1] - x[4]) + kz * (r[1] - x[1])
    lift = MASS * (GRAVITY + az) / np.cos(x[2])
    torque = INERTIA * (150.0 * (ax / GRAVITY - x[2]) - 19.8 * x[5])
    return np.array([0.5 * (lift + torque / ARM), 0.5 * (lift - torque / ARM)])


def rate(x: Vector, u: Vector, w: Vector) -> Vector:
    return np.array([
        x[3], x[4], x[5],
        ((u[0] + u[1]) * np.sin(x[2]) + w[0]) / MASS,
        ((u[0] + u[1]) * np.cos(x[2]) + w[1]) / MASS - GRAVITY,
        ARM * (u[0] - u[1]) / INERTIA,
    ])  # fmt: skip


def excess(mode: str, x: Vector, u: Vector) -> float:
    """By how much the worst limit is broken; at most 0 where all hold."""
    speeds = (2.0, 0.8) if mode == "touchdown" else (3.5, 3.5)
    found = [abs(x[2]) - 0.7, abs(x[3]) - speeds[0], abs(x[4]) - speeds[1], *(abs(u - 3.0) - 2.95)]
    return float(max(found if mode == "touchdown" else [*found, -x[1]]))


def starts(mode: str, p: Any) -> tuple[Vector, Vector]:
    """Box of allowed starts (lo, hi), each (6,); where the vehicle has landed, of any size."""
    if mode == "landed":
        lo = np.array([-np.inf, -np.inf, -0.2, -0.6, -0.4, -np.inf])
        return lo, np.array([np.inf, 0.0, 0.2, 0.6, np.inf, np.inf])
    size = {
        "hover": [0.5, 0.3, 0.2, 0.7, 0.4, 0.8],
        "touchdown": [0.28, 0.11, 0.16, 0.55, 0.17, 0.65],
    }.get(mode, [0.3, 0.15, 0.18, 0.55, 0.22, 0.7])
    centre = np.array([p[0], 0.15 if mode == "touchdown" else p[1], 0.0, 0.0, 0.0, 0.0])
    return centre - size, centre + size


def some_start(mode: str, p: Vector, rng: np.random.Generator) -> Vector:
    """A corner of the allowed starts, or any of them."""
    lo, hi = starts(mode, p)
    share = rng.choice([0.0, 1.0], 6) if rng.uniform() < 0.5 else rng.uniform(size=6)
    return np.asarray(lo + share * (hi - lo))


def wind(kind: str, rng: np.random.Generator) -> Wind:
    """Any measurable wind within the box is allowed; these are some."""
    signs = rng.choice([-1.0, 1.0], 2)
    if kind == "constant":
        force = PUSH * rng.choice([signs, rng.uniform(-1.0, 1.0, 2)])
        return Wind(lambda t, x, left: force)
    if kind == "bang-bang":
        period, phase = rng.uniform(0.3, 4.0, 2), rng.uniform(0.0, 4.0, 2)
        return Wind(lambda t, x, left: PUSH * np.where((t + phase) % period < 0.5 * period, 1.0, -1.0))
    if kind == "smooth":
        pace, phase = rng.uniform(0.2, 6.0, (2, 5)), rng.uniform(0.0, 2 * np.pi, (2, 5))
        return Wind(lambda t, x, left: 0.2 * PUSH * np.sin(pace * t + phase).sum(axis=1), held=False)
    if kind == "costate":
        # What pushes the linear loop furthest in one coordinate, when the certified time has passed.
        A = np.zeros((6, 6))
        A[0, 3] = A[1, 4] = A[2, 5] = 1.0
        A[3, 2], A[4, [1, 4]] = GRAVITY, [-6.0, -5.0]
        A[5, [0, 2, 3, 5]] = [-150.0 * 3.8 / GRAVITY, -150.0, -150.0 * 3.15 / GRAVITY, -19.8]
        row = rng.normal(size=6) * [3.0, 6.0, 6.0, 2.0, 4.0, 1.5]
        if rng.uniform() < 0.5:
            row *= np.eye(6)[rng.integers(6)]
        return Wind(lambda t, x, left: PUSH * np.where((row @ expm(A * left))[3:5] < 0.0, -1.0, 1.0))
    toward = 1.0 if kind == "with the motion" else -1.0
    return Wind(lambda t, x, left: PUSH * toward * np.where(x[3:5] < 0.0, -1.0, 1.0))


@dataclass(frozen=True)
class Flight:
    """Times of the switches since each entry (seconds), and what went wrong."""

    switches: list[float]
    faults: list[str]


def fly(modes: Sequence[str], references: Sequence[Any], latest: Sequence[float], x0: Vector, blow: Wind) -> Flight:
    """Each mode until the state is in the next start set; the last one for two seconds."""
    x, begun = np.array(x0, float), 0.0
    switches: list[float] = []
    for k, (mode, p) in enumerate(zip(modes, references, strict=True)):
        last = k + 1 == len(modes)
        if mode == "landed":
            break
        end = STAY if last else latest[k]
        box = None if last else starts(modes[k + 1], references[k + 1])
        t, entered = 0.0, inside(x, box)
        while not entered and t < end:
            x, t, entered, broken = _ahead(mode, p, t, min(t + HOLD, end), x, begun, end, blow, box)
            if broken > TOLERANCE:
                return Flight(switches, [f"{mode} {p}: a limit is broken by {broken:.3g} at {t:.3f} s"])
        if not last:
            if not entered:
                return Flight(switches, [f"{mode} {p}: not in {modes[k + 1]} after {end} s, at {x}"])
            switches.append(t)
        begun += t
    return Flight(switches, [])


def inside(x: Vector, box: tuple[Vector, Vector] | None) -> bool:
    return box is not None and bool(((box[0] <= x) & (x <= box[1])).all())


def _ahead(
    mode: str, p: Vector, t0: float, t1: float, x0: Vector, begun: float, end: float, blow: Wind, box: Any
) -> tuple[Vector, float, bool, float]:
    """One hold, cut short where the next start set is entered: state, time, whether, and the worst limit."""

    gust = blow.force(begun + t0, x0, end - t0)

    def slope(t: float, x: Vector) -> Vector:
        w = gust if blow.held else blow.force(begun + t, x0, end - t)
        return rate(x, rotors(mode, p, t, x), w)

    run = solve_ivp(slope, (t0, t1), x0, method="DOP853", rtol=1e-10, atol=1e-12, dense_output=True)
    assert run.success
    times = np.linspace(t0, t1, LOOKS + 1)
    path = [*run.sol(times[:-1]).T, run.y[:, -1]]
    worst = -np.inf
    for t, x in zip(times, path, strict=True):
        worst = max(worst, excess(mode, x, rotors(mode, p, t, x)))
        if inside(x, box):
            return x, float(t), True, worst
    return path[-1], t1, False, worst


def storm(plan: Any, winds: int, seed: int) -> tuple[int, list[str], Vector]:
    """Flights along a plan: switches, what went wrong, and the largest share of each certified time that was used."""
    rng = np.random.default_rng(seed)
    latest = [s.time[1] for s in plan.switches]
    count, faults, used = 0, [], np.zeros(len(latest))
    for k in range(winds):
        kind = KINDS[k % len(KINDS)]
        x0 = some_start(plan.modes[0], plan.references[0], rng)
        flight = fly(plan.modes, plan.references, latest, x0, wind(kind, rng))
        count += len(flight.switches)
        faults += [f"{kind}: {fault}" for fault in flight.faults]
        for j, t in enumerate(flight.switches):
            used[j] = max(used[j], t / latest[j])
    return count, faults, used
