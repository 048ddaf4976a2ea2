"""Thousands of runs of one plant at once: DOP853 on all of them together, with its error measured run by run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

from tests.soundness.plants import Plant

Vector = np.ndarray
HOLDS = 16
"""Pieces of constant disturbance in a run."""
TOLERANCES = {"saturated": (1e-7, 1e-9)}
"""(loose, tight) relative tolerances; a kink costs the integrator its order."""
SMOOTH = (1e-10, 1e-12)


@dataclass(frozen=True)
class Choice:
    """What tells runs apart: start variables (m, k), unknown scaled to [-1, 1] (k,), disturbance (HOLDS, q, k)."""

    xi: Vector
    unknown: Vector
    w: Vector


@dataclass(frozen=True)
class Runs:
    """States (times, n, k) at ``times``, each within ``error`` of the truth; ``variables`` (m', k) of the flowpipe."""

    times: Vector
    x: Vector
    error: Vector
    variables: Vector


def runs(plant: Plant, count: int, until: float, times: Vector, rng: np.random.Generator) -> Runs:
    """``count`` runs: random, constant, bang-bang and gradient-chosen disturbances and starts."""
    choice = _choose(plant, count, until, rng)
    loose, tight = (_integrate(plant, choice, until, times, rtol) for rtol in TOLERANCES.get(plant.kind, SMOOTH))
    # One difference may vanish by chance: the largest of all runs counts too.
    apart = np.abs(loose - tight)
    error = 2.0 * apart + 0.2 * apart.max(axis=2, keepdims=True) + 1e-13 * (1.0 + np.abs(tight))
    variables = choice.xi if plant.unknown is None else np.vstack([choice.xi, choice.unknown])
    return Runs(times, tight, error, variables)


def _integrate(plant: Plant, choice: Choice, until: float, times: Vector, rtol: float) -> Vector:
    x = plant.starts(choice.xi)
    n, k = x.shape
    lo, hi = plant.unknown or (1.0, 1.0)
    a = np.clip((lo + hi) / 2 + (hi - lo) / 2 * choice.unknown, lo, hi)
    out = np.full((len(times), n, k), np.nan)
    out[times == 0.0] = x
    cuts = _cuts(plant, until)
    for j, (begin, end) in enumerate(pairwise(cuts)):
        inside = np.flatnonzero((times > begin) & (times <= end))
        rate: Callable[[float, Vector], Vector] = lambda t, y, j=j: plant.slope(y.reshape(n, k), choice.w[j], a).ravel()  # type: ignore[misc]
        asked = np.unique(np.append(times[inside], end))
        found = solve_ivp(rate, (begin, end), x.ravel(), "DOP853", t_eval=asked, rtol=rtol, atol=rtol * 1e-2)
        if not found.success:
            return out
        states = found.y.T.reshape(len(asked), n, k)
        out[inside] = states[np.searchsorted(asked, times[inside])]
        x = states[-1]
    return out


def _cuts(plant: Plant, until: float) -> Vector:
    pieces = HOLDS if plant.mode.system.disturbance is not None else 1
    return np.linspace(0.0, until, pieces + 1)


def _choose(plant: Plant, count: int, until: float, rng: np.random.Generator) -> Choice:
    m = plant.start_variables
    box = plant.mode.system.disturbance
    q = 0 if box is None else len(box.lo)
    xi = rng.uniform(-1.0, 1.0, (m, count))
    half = rng.random(count) < 0.5
    xi[:, half] = np.sign(xi[:, half])
    unknown = rng.choice([-1.0, 1.0, 0.3], count)
    share = rng.uniform(-1.0, 1.0, (HOLDS, q, count))
    group = np.arange(count) % 5
    share[:, :, group == 1] = np.sign(share[:, :, group == 1])
    share[:, :, group == 2] = np.sign(share[:1, :, group == 2])
    pushed = np.flatnonzero(group >= 3)
    slope_xi, slope_w = _gradients(plant, until)
    towards = rng.normal(size=(slope_xi.shape[1], len(pushed)))
    axis = rng.random(len(pushed)) < 0.7
    towards[:, axis] = np.eye(len(towards))[rng.integers(len(towards), size=axis.sum())].T
    towards *= rng.choice([-1.0, 1.0], len(pushed))
    at = rng.integers(len(slope_xi), size=len(pushed))
    share[:, :, pushed] = np.sign(np.einsum("nk,knhq->hqk", towards, slope_w[at]))
    best = np.einsum("nk,knm->mk", towards, slope_xi[at])
    chosen = group[pushed] == 4
    xi[:, pushed[chosen]] = np.sign(best)[:m, chosen]
    unknown[pushed[chosen]] = np.sign(best)[m, chosen]
    if plant.is_round:
        xi[:, pushed[chosen]] = best[:m, chosen]
        length = np.linalg.norm(xi, axis=0)
        within = (group < 3) & ~half
        xi = np.where(within & (length <= 1.0), xi, xi / np.maximum(length, 1e-300)) * (1.0 - 1e-15)
    if box is None:
        return Choice(xi, unknown, np.zeros((HOLDS, 0, count)))
    middle, radius = (box.lo + box.hi) / 2, (box.hi - box.lo) / 2
    return Choice(xi, unknown, np.clip(middle[:, None] + radius[:, None] * share, box.lo[:, None], box.hi[:, None]))


def _gradients(plant: Plant, until: float) -> tuple[Vector, Vector]:
    """Slopes of the states at a few instants along the central run: (times, n, m + 1) by the start variables and
    the unknown, (times, n, HOLDS, q) by the disturbance, scaled to [-1, 1]."""
    m = plant.start_variables
    box = plant.mode.system.disturbance
    q = 0 if box is None else len(box.lo)
    total = m + 1 + HOLDS * q
    step = 1e-3 * np.hstack([np.zeros((total, 1)), np.eye(total)])
    w = step[m + 1 :].reshape(HOLDS, q, total + 1)
    if box is not None:
        w = ((box.lo + box.hi) / 2)[:, None] + ((box.hi - box.lo) / 2)[:, None] * w
    times = np.linspace(0.0, until, 7)[1:]
    x = _integrate(plant, Choice(step[:m], step[m], w), until, times, 1e-8)
    slopes = np.nan_to_num((x[:, :, 1:] - x[:, :, :1]) / 1e-3)
    return slopes[:, :, : m + 1], slopes[:, :, m + 1 :].reshape(len(times), x.shape[1], HOLDS, q)
