"""Disturbance signals that try to break a certificate: constant corners, bang-bang, greedy, resonant."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tests.soundness.loop import Loop, Policy
from tests.soundness.sets import excess

Vector = np.ndarray


def signals(loop: Loop, target: Any | None, rng: np.random.Generator) -> Callable[[int], tuple[Policy, float]]:
    """A source of (policy, hold) pairs; the k-th start of a campaign takes the k-th pair."""
    box = loop.system.disturbance
    if box is None:
        nothing = np.zeros(0)
        return lambda k: (lambda t, y: nothing, np.inf)
    corners = np.array(np.meshgrid(*zip(box.lo, box.hi, strict=True))).reshape(len(box.lo), -1).T
    kinds = [
        lambda: constant(corners[rng.integers(len(corners))]),
        lambda: constant(rng.uniform(box.lo, box.hi)),
        lambda: bang_bang(corners, rng),
        lambda: greedy(loop, box, target_gradient(target, loop), hold=0.05),
        lambda: greedy(loop, box, target_gradient(target, loop, sign=-1.0), hold=0.08),
        lambda: square_wave(box, period=float(rng.uniform(0.3, 6.5)), phase=float(rng.uniform(0, 1)), rng=rng),
        lambda: greedy(loop, box, coordinate_gradient(loop, int(rng.integers(loop.n)), rng), hold=0.06),
    ]
    return lambda k: kinds[k % len(kinds)]()


def constant(w: Vector) -> tuple[Policy, float]:
    return (lambda t, y: w), np.inf


def bang_bang(corners: Vector, rng: np.random.Generator) -> tuple[Policy, float]:
    """A corner drawn anew at every decision."""
    return (lambda t, y: corners[rng.integers(len(corners))]), float(rng.choice([0.05, 0.2, 0.6]))


def square_wave(box: Any, period: float, phase: float, rng: np.random.Generator) -> tuple[Policy, float]:
    flips = rng.choice([-1.0, 1.0], len(box.lo))
    centre, radius = (box.lo + box.hi) / 2, (box.hi - box.lo) / 2

    def policy(t: float, y: Vector) -> Vector:
        sign = 1.0 if (t / period + phase) % 1.0 < 0.5 else -1.0
        return np.clip(centre + sign * flips * radius, box.lo, box.hi)

    return policy, max(period / 8, 0.04)


def greedy(loop: Loop, box: Any, gradient: Callable[[float, Vector], Vector], hold: float) -> tuple[Policy, float]:
    """The corner that pushes hardest along ``gradient`` at every decision."""
    centre, radius = (box.lo + box.hi) / 2, (box.hi - box.lo) / 2

    def policy(t: float, y: Vector) -> Vector:
        push = gradient(t, y)
        rest = loop.slope(t, y, centre)
        w = centre.copy()
        for k in range(len(centre)):
            nudged = centre.copy()
            nudged[k] += radius[k]
            effect = float(push @ (loop.slope(t, y, nudged) - rest)[: loop.n])
            w[k] = box.hi[k] if effect >= 0 else box.lo[k]
        return w

    return policy, hold


def target_gradient(target: Any | None, loop: Loop, sign: float = 1.0) -> Callable[[float, Vector], Vector]:
    """Away from the target (sign 1) or towards it (sign -1), looking a little ahead."""

    def gradient(t: float, y: Vector) -> Vector:
        x = y[: loop.n]
        if target is None:
            return sign * x
        ahead = x + 0.15 * loop.slope(t, y, loop.rest)[: loop.n]
        step = 1e-5
        shifted = ahead + step * np.vstack([np.eye(loop.n), -np.eye(loop.n)])
        value = excess(target, shifted)
        away = (value[: loop.n] - value[loop.n :]) / (2 * step)
        # an effect through an integrator: half of the push goes to the state that moves the worst one
        spread = np.array([float(away @ (_column(loop, t, y, k))) for k in range(loop.n)])
        return sign * (away + spread)

    return gradient


def _column(loop: Loop, t: float, y: Vector, k: int) -> Vector:
    nudged = y.copy()
    nudged[k] += 1e-5
    return np.asarray(loop.slope(t, nudged, loop.rest) - loop.slope(t, y, loop.rest))[: loop.n] / 1e-5


def coordinate_gradient(loop: Loop, k: int, rng: np.random.Generator) -> Callable[[float, Vector], Vector]:
    """Drive one state up or down for the whole run: the enemy of a constraint on it."""
    sign = float(rng.choice([-1.0, 1.0]))

    def gradient(t: float, y: Vector) -> Vector:
        wish = np.zeros(loop.n)
        wish[k] = sign
        row = np.array([_column(loop, t, y, j)[k] for j in range(loop.n)])
        return wish + sign * 0.3 * row

    return gradient
