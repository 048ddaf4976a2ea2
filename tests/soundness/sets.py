"""Float-side views of the library's sets: how far outside a point is, and starts to integrate from."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import linprog

import modegraph as mg

Vector = np.ndarray


def excess(region: Any, points: Vector) -> Vector:
    """Signed distance-like number for (k, n) points: <= 0 inside, in the unit of the state."""
    x = np.atleast_2d(points)
    if isinstance(region, mg.Box):
        return np.max(np.maximum(region.lo - x, x - region.hi), axis=1)
    if isinstance(region, mg.Ball):
        return np.linalg.norm(x - region.c, axis=1) - region.radius
    if isinstance(region, mg.Ellipsoid):
        values, vectors = np.linalg.eigh(region.shape)
        scaled = ((x - region.c) @ vectors) / np.sqrt(values)
        return (np.linalg.norm(scaled, axis=1) - 1.0) * np.sqrt(values[0])
    if isinstance(region, mg.Polytope):
        return np.max((x @ region.A.T - region.b) / np.linalg.norm(region.A, axis=1), axis=1)
    if isinstance(region, mg.Zonotope):
        return np.array([_zonotope_excess(region, point) for point in x])
    raise TypeError(f"no excess for {type(region).__name__}")


def _zonotope_excess(region: Any, point: Vector) -> float:
    G = region.generators
    n, m = G.shape
    equal = np.hstack([G, np.zeros((n, 1))])
    bound = np.vstack([np.hstack([np.eye(m), -np.ones((m, 1))]), np.hstack([-np.eye(m), -np.ones((m, 1))])])
    answer = linprog(
        np.r_[np.zeros(m), 1.0],
        A_ub=bound,
        b_ub=np.zeros(2 * m),
        A_eq=equal,
        b_eq=point - region.c,
        bounds=[(None, None)] * m + [(0, None)],
    )
    if answer.status != 0:
        return np.inf
    return float((answer.x[-1] - 1.0) * np.min(np.linalg.norm(G, axis=0)))


def starts(region: Any, count: int, rng: np.random.Generator) -> Vector:
    """(count, n) points of the set, half of them on its boundary or at its corners."""
    half = count // 2
    if isinstance(region, mg.Box):
        n = len(region.lo)
        share = np.vstack([rng.uniform(0, 1, (count - half, n)), rng.integers(0, 2, (half, n))])
        return np.clip(region.lo + share * (region.hi - region.lo), region.lo, region.hi)
    if isinstance(region, (mg.Ball, mg.Ellipsoid)):
        n = len(region.c)
        unit = rng.normal(size=(count, n))
        unit /= np.linalg.norm(unit, axis=1, keepdims=True)
        unit[half:] *= rng.uniform(0, 1, (count - half, 1)) ** (1 / n)
        unit *= 1 - 1e-14
        if isinstance(region, mg.Ball):
            return region.c + region.radius * unit
        return region.c + unit @ np.linalg.cholesky(region.shape).T
    if isinstance(region, mg.Zonotope):
        m = region.generators.shape[1]
        share = np.vstack([rng.uniform(-1, 1, (count - half, m)), rng.choice([-1.0, 1.0], (half, m))])
        return region.c + share @ region.generators.T * (1 - 1e-14)
    return np.asarray(region.sample(count, seed=int(rng.integers(2**31))))
