"""Many small random plants, written once and evaluated both on traces and on whole batches of states.

The recipe is fixed by the seed: 1 to 6 states, four kinds of nonlinearity, half of the plants disturbed
(added, through a matrix of the state, or inside a nonlinear function), every seventh with an unknown constant.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import modegraph as mg

Vector = np.ndarray
KINDS = ("polynomial", "trigonometric", "rational", "saturated")
PUSHES = ("added", "through a matrix", "inside")
UNTIL = 2.0

Term = Callable[[Any, int, int, float], Any]
TERMS: dict[str, list[Term]] = {
    "polynomial": [
        lambda x, i, j, c: c * x[i] * x[j],
        lambda x, i, j, c: -abs(c) * x[i] ** 3,
        lambda x, i, j, c: c * x[i] ** 2 * x[j],
        lambda x, i, j, c: c * (x[i] - x[j]) ** 2,
    ],
    "trigonometric": [
        lambda x, i, j, c: c * np.sin(2.0 * x[i]) * np.cos(x[j]),
        lambda x, i, j, c: c * (np.cos(x[i]) - 1.0) + 0.0 * x[j],
        lambda x, i, j, c: c * x[j] * np.sin(x[i] + 0.3),
        lambda x, i, j, c: c * np.arctan(2.0 * x[i]) + 0.0 * x[j],
        lambda x, i, j, c: c * (np.exp(0.5 * np.sin(x[j])) - 1.0) * x[i],
        lambda x, i, j, c: c * np.tanh(x[i] + x[j]),
    ],
    "rational": [
        lambda x, i, j, c: c * x[i] / (1.0 + x[j] ** 2),
        lambda x, i, j, c: c * x[j] / (3.0 + x[i]),
        lambda x, i, j, c: c * (x[i] - x[j]) / (1.5 + x[i] ** 2 + x[j] ** 2),
        lambda x, i, j, c: c * np.sqrt(1.0 + x[i] ** 2) * x[j] / (2.0 - x[i] * x[j] / 4.0),
        lambda x, i, j, c: c * np.log(2.0 + x[i] ** 2) * x[j],
    ],
    "saturated": [
        lambda x, i, j, c: c * np.clip(2.0 * x[i], -0.5, 0.7) + 0.0 * x[j],
        lambda x, i, j, c: c * np.maximum(x[i], x[j]),
        lambda x, i, j, c: c * np.abs(x[i] - 0.1) + 0.0 * x[j],
        lambda x, i, j, c: c * np.minimum(x[i], 0.2) * x[j],
    ],
}


@dataclass(frozen=True)
class Plant:
    """A random mode, and its slope for states (n, k), disturbances (q, k) and unknowns (k,) at once."""

    seed: int
    kind: str
    mode: mg.Mode
    slope: Callable[[Vector, Vector, Vector], Vector]

    @property
    def label(self) -> str:
        disturbance = PUSHES[self.push] if self.mode.system.disturbance is not None else "undisturbed"
        return f"plant {self.seed}: {self.mode.start.dim} states, {self.kind}, {disturbance}"

    @property
    def push(self) -> int:
        return (self.seed // 48) % len(PUSHES)

    def starts(self, xi: Vector) -> Vector:
        """The states (n, k) of start variables (m, k) in [-1, 1] or, for a Ball, in the unit ball."""
        start = self.mode.start
        if isinstance(start, mg.Box):
            return ((start.lo + start.hi) / 2)[:, None] + ((start.hi - start.lo) / 2)[:, None] * xi
        if isinstance(start, mg.Ball):
            return start.c[:, None] + start.radius * xi
        assert isinstance(start, mg.Zonotope)
        return start.c[:, None] + start.generators @ xi

    @property
    def start_variables(self) -> int:
        start = self.mode.start
        return start.generators.shape[1] if isinstance(start, mg.Zonotope) else start.dim

    @property
    def is_round(self) -> bool:
        return isinstance(self.mode.start, mg.Ball)

    @property
    def unknown(self) -> tuple[float, float] | None:
        return (self.mode.system.unknowns or {}).get("a")


def plant(seed: int) -> Plant:
    rng = np.random.default_rng([77, seed])
    n = 1 + seed % 6
    kind = KINDS[(seed // 6) % 4]
    disturbed = (seed // 24) % 2 == 1
    inputs = 1 + (seed // 12) % 2
    A = _matrix(rng, n)
    bends = _bends(rng, n, kind)
    gain, b, limit = rng.normal(size=n).round(2) * 0.5, rng.normal(size=n).round(2), 0.4
    control = (lambda x: np.clip(-(gain @ x), -limit, limit)) if kind == "saturated" else (lambda x: -(gain @ x))
    push = _push(rng, n, inputs, PUSHES[(seed // 48) % 3])
    unknown = seed % 7 == 3

    def slope(x: Any, u: Any, w: Any, a: Any) -> Any:
        rate = a * (A @ x) + bends(x) + np.array([float(b[i]) * u for i in range(n)])
        return rate + push(x, w) if disturbed else rate

    if disturbed:
        dynamics: Callable[..., Any] = lambda x, u, w, d: slope(x, u[0], w, d["a"])
        if not unknown:
            dynamics = lambda x, u, w: slope(x, u[0], w, 1.0)
    else:
        dynamics = lambda x, u, d: slope(x, u[0], None, d["a"])
        if not unknown:
            dynamics = lambda x, u: slope(x, u[0], None, 1.0)
    size = rng.uniform(0.05, 0.25, inputs).round(3)
    shift = (rng.uniform(-0.1, 0.1, inputs) * (seed % 2)).round(3)
    system = mg.System(
        dynamics,
        states=n,
        inputs=1,
        disturbance=mg.Box(shift - size, shift + size) if disturbed else None,
        unknowns={"a": (0.9, 1.15)} if unknown else None,
    )
    start = _start(rng, n, seed)
    mode = mg.Mode(f"plant {seed}", system, controller=control, reference=mg.setpoint([0.0]), start=start)
    return Plant(seed, kind, mode, lambda x, w, a: slope(x, control(x), w, a))


def _matrix(rng: np.random.Generator, n: int) -> Vector:
    """Its slowest mode decays or grows a little."""
    A = rng.normal(size=(n, n)) * 1.2 / np.sqrt(n)
    wanted = rng.uniform(-1.0, 0.3)
    return np.asarray((A + (wanted - np.linalg.eigvals(A).real.max()) * np.eye(n)).round(3))


def _bends(rng: np.random.Generator, n: int, kind: str) -> Callable[[Any], Any]:
    terms = TERMS[kind]
    chosen = [terms[int(rng.integers(len(terms)))] for _ in range(n)]
    axes, weights = rng.integers(n, size=(n, 2)).tolist(), rng.uniform(-0.9, 0.9, n).round(3).tolist()
    return lambda x: np.array([term(x, *ij, c) for term, ij, c in zip(chosen, axes, weights, strict=True)])


def _push(rng: np.random.Generator, n: int, inputs: int, how: str) -> Callable[[Any, Any], Any]:
    B = rng.uniform(-1.0, 1.0, (n, inputs)).round(2)
    axis = int(rng.integers(n))
    if how == "added":
        return lambda x, w: B @ w
    if how == "through a matrix":
        return lambda x, w: (B @ w) * (1.0 + 0.8 * np.sin(x[axis]))
    return lambda x, w: np.array([float(B[i, 0]) * np.sin(w[0] + x[i]) * (1.0 + w[inputs - 1]) for i in range(n)])


def _start(rng: np.random.Generator, n: int, seed: int) -> Any:
    centre = rng.uniform(-0.7, 0.7, n).round(2)
    width = (rng.uniform(0.02, 0.25, n) / (1 + n / 4)).round(3)
    kind = seed % 5
    if kind == 3:
        return mg.Ball(centre, float(width.max()))
    if kind == 4:
        return mg.Zonotope(centre, (rng.normal(size=(n, n)) * 0.4 + np.eye(n)) * width.mean())
    return mg.Box(centre - width, centre + width)
