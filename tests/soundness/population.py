"""A population of small random systems with questions whose answers are not obvious.

The recipe is fixed by the seed: 1 to 4 states; odd seeds are nonlinear; every third system is disturbed, the
nonlinear ones of these through a matrix whose entries vary by half over the start set; every fifth has an
unknown constant. Targets and bounds are sized against sampled runs, so that they fit with some
room, hardly, or not at all.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import solve_continuous_are

import modegraph as mg
from tests.soundness.adversary import signals
from tests.soundness.loop import Loop, run
from tests.soundness.sets import excess, starts

Vector = np.ndarray
HORIZON = 6.0


@dataclass(frozen=True)
class Case:
    """One random mode and the targets it is asked about."""

    seed: int
    mode: Any
    targets: tuple[Any, ...]
    nonlinear: bool
    disturbed: bool
    matrix: bool

    @property
    def questions(self) -> list[Any]:
        """The targets that do not already contain the start set's centre and spread."""
        points = starts(self.mode.start, 64, np.random.default_rng(self.seed))
        return [goal for goal in self.targets if np.any(excess(goal.set, points) > 0)]


def case(seed: int) -> Case:
    rng = np.random.default_rng([2001, seed])
    n = 1 + (seed // 2) % 4
    nonlinear, disturbed = bool(seed % 2), seed % 3 == 0
    matrix = disturbed and nonlinear
    unknown = seed % 5 == 2
    centre = rng.uniform(-0.5, 0.5, n).round(2)
    width = rng.uniform(0.05, 0.2 if nonlinear else 0.4, n).round(3)
    middle = (centre + rng.choice([-1, 1], n) * rng.uniform(0.4, 1.0, n)).round(2)
    field = _field(rng, n, centre, middle, width, nonlinear, disturbed, matrix, unknown)
    gain = _gain(rng, field, centre, n)
    plant = mg.System(
        field,
        states=n,
        inputs=1,
        disturbance=mg.Box([-1.0] * 1, [1.0] * 1) if disturbed else None,
        unknowns={"a": (0.85, 1.15)} if unknown else None,
    )
    start = _start(rng, middle, width)
    free = _mode(seed, plant, gain, centre, start, None)
    samples = _sample(free, rng)
    bound = _bound(rng, samples, n)
    return Case(
        seed,
        _mode(seed, plant, gain, centre, start, bound),
        _targets(rng, samples, centre, n),
        nonlinear,
        disturbed,
        matrix,
    )


def _field(
    rng: np.random.Generator,
    n: int,
    centre: Vector,
    middle: Vector,
    width: Vector,
    nonlinear: bool,
    disturbed: bool,
    matrix: bool,
    unknown: bool,
) -> Callable[..., Any]:
    """x' = a A e + b u + bend(e) + push(x) w with e = x - centre."""
    A = rng.normal(size=(n, n)).round(2) * 0.8
    b = rng.normal(size=n).round(2)
    b[rng.integers(n)] = 1.0
    bends = _bends(rng, n) if nonlinear else (lambda e: 0.0 * e)
    strength = (rng.uniform(0.03, 0.12, n) * rng.choice([0.0, 1.0], n)).round(3)
    strength[rng.integers(n)] = 0.1
    axis = int(rng.integers(n))

    def push(x: Any) -> Any:
        if not matrix:
            return strength
        return strength * (1.0 + 0.25 * (x[axis] - middle[axis]) / width[axis])

    if disturbed and unknown:
        return lambda x, u, w, d: d["a"] * (A @ (x - centre)) + b * u[0] + bends(x - centre) + push(x) * w[0]
    if disturbed:
        return lambda x, u, w: A @ (x - centre) + b * u[0] + bends(x - centre) + push(x) * w[0]
    if unknown:
        return lambda x, u, d: d["a"] * (A @ (x - centre)) + b * u[0] + bends(x - centre)
    return lambda x, u: A @ (x - centre) + b * u[0] + bends(x - centre)


def _bends(rng: np.random.Generator, n: int) -> Callable[[Any], Any]:
    """Nonlinear terms that vanish with their slope or add little of it at e = 0."""
    kinds = [
        lambda e, i, j, c: c * e[i] * e[j],
        lambda e, i, j, c: -abs(c) * e[i] ** 3,
        lambda e, i, j, c: c * (np.sin(e[i]) - e[i]),
        lambda e, i, j, c: c * np.tanh(e[j]) * e[i],
        lambda e, i, j, c: c * (np.exp(0.5 * e[j]) - 1.0),
        lambda e, i, j, c: c * e[i] / (1.0 + e[j] ** 2),
        lambda e, i, j, c: c * np.cos(e[j]) * e[i],
        lambda e, i, j, c: c * (np.sqrt(1.0 + e[i] ** 2) - 1.0),
        lambda e, i, j, c: c * np.arctan(e[j]),
        lambda e, i, j, c: c * np.maximum(e[j], 0.0),
    ]
    chosen = [
        (
            kinds[int(rng.integers(len(kinds)))],
            int(rng.integers(n)),
            int(rng.integers(n)),
            float(rng.uniform(-0.8, 0.8)),
        )
        for _ in range(n)
    ]
    return lambda e: np.array([term(e, i, j, c) for term, i, j, c in chosen])


def _gain(rng: np.random.Generator, field: Callable[..., Any], centre: Vector, n: int) -> Vector:
    """LQR on a finite-difference linearisation; one mode in eight runs open loop."""
    if rng.uniform() < 0.12:
        return np.zeros(n)
    nominal = {"w": np.zeros(1), "d": {"a": 1.0}}
    names = field.__code__.co_varnames[: field.__code__.co_argcount]

    def slope(x: Vector, u: Vector) -> Vector:
        return np.asarray(field(**{k: v for k, v in {"x": x, "u": u, **nominal}.items() if k in names}), float)

    zero, step = np.zeros(1), 1e-6
    A = np.stack([(slope(centre + step * e, zero) - slope(centre - step * e, zero)) / (2 * step) for e in np.eye(n)], 1)
    b = (slope(centre, zero + 1.0) - slope(centre, zero))[:, None]
    P = solve_continuous_are(A, b, np.eye(n) * float(rng.choice([1.0, 4.0])), np.eye(1))
    return np.asarray((b.T @ P)[0]).round(3)


def _start(rng: np.random.Generator, middle: Vector, width: Vector) -> Any:
    n = len(middle)
    kind = int(rng.integers(5))
    if kind <= 1:
        return mg.Box(middle - width, middle + width)
    if kind == 2:
        return mg.Ball(middle, float(width.min()))
    if kind == 3:
        turn = np.linalg.qr(rng.normal(size=(n, n)))[0]
        shape = turn @ np.diag(width**2) @ turn.T
        return mg.Ellipsoid(middle, (shape + shape.T) / 2)
    return mg.Zonotope(middle, rng.normal(size=(n, n)) * width.min() * 0.7 + np.diag(width * 0.3))


def _mode(
    seed: int, plant: Any, gain: Vector, centre: Vector, start: Any, bound: tuple[int, float, float] | None
) -> Any:
    limit = None
    if bound is not None:
        axis, lo, hi = bound
        limit = lambda x: {"low": x[axis] >= lo, "high": x[axis] <= hi}
    return mg.Mode(
        f"system {seed}",
        plant,
        controller=lambda x, r: -(gain @ (x - r)),
        reference=mg.setpoint(centre),
        start=start,
        constraints=limit,
    )


def _sample(mode: Any, rng: np.random.Generator) -> list[tuple[Vector, Vector]]:
    """A few runs (t, x), enough to size the questions."""
    found = []
    for k, x0 in enumerate(starts(mode.start, 14, rng)):
        unknown = {"a": [0.85, 1.15, 1.0][k % 3]} if mode.system.unknowns else {}
        loop = Loop(mode, None, unknown)
        policy, hold = signals(loop, None, rng)(k)
        trajectory = run(loop, x0, policy, hold, HORIZON, rtol=1e-6, atol=1e-8)
        if trajectory.ended >= HORIZON:
            grid = np.linspace(0, HORIZON, 121)
            index = np.clip(np.searchsorted(trajectory.t, grid), 0, len(trajectory.t) - 1)
            found.append((grid, trajectory.y[index]))
    return found


def _bound(rng: np.random.Generator, samples: list[tuple[Vector, Vector]], n: int) -> tuple[int, float, float] | None:
    if rng.uniform() < 0.35 or not samples:
        return None
    axis = int(rng.integers(n))
    values = np.stack([x[:, axis] for _, x in samples])
    lo, hi = float(values.min()), float(values.max())
    slack = float(rng.choice([-0.15, 0.05, 0.15, 0.4])) * (hi - lo)
    return axis, round(lo - slack, 3), round(hi + slack, 3)


def _targets(rng: np.random.Generator, samples: list[tuple[Vector, Vector]], centre: Vector, n: int) -> tuple[Any, ...]:
    if not samples:
        return (mg.Target("rest", mg.Ball(centre, 0.2)), mg.Target("far", mg.Box(centre + 2.0, centre + 2.5)))
    flows = np.stack([x for _, x in samples])  # (runs, times, n)
    end = np.abs(flows[:, -1] - centre).max(axis=0)
    size = (end * rng.choice([0.7, 1.3, 2.0]) + rng.choice([0.02, 0.05, 0.1])).round(3)
    at = int(rng.integers(15, 80))
    lo, hi = flows[:, at].min(axis=0), flows[:, at].max(axis=0)
    half = (hi - lo) / 2 * float(rng.choice([0.5, 1.25, 1.6, 2.5])) + 0.01
    mid = (lo + hi) / 2
    radius = float(np.linalg.norm(end) * rng.choice([0.8, 1.4, 2.2]) + 0.05)
    away = centre + rng.choice([-1, 1], n) * rng.uniform(1.5, 2.5, n)
    return (
        mg.Target("rest", mg.Box(centre - size, centre + size)),
        mg.Target("ball", mg.Ball(centre, round(radius, 3))),
        mg.Target("on the way", mg.Box((mid - half).round(4), (mid + half).round(4))),
        mg.Target("far", mg.Box(away - 0.2, away + 0.2)),
    )
