"""Parallelotopes around reach sets: for restarting a flowpipe, and for invariant sets."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..enclosure.rounding import UNIT
from .flow import Flow, generator_box

Floats = NDArray[np.float64]


def half_widths(flow: Flow, axes: Floats, centre: Floats, states: Sequence[int]) -> Floats:
    """Bounds of |V^-1 (x - centre)| over the set at the end of the flow, for the listed states.

    ``axes`` V (k, k). With any N near V^-1 and R = N V - I, V^-1 y = (I + R)^-1 N y, so the bound of
    N y grows by |R| / (1 - |R|) of its largest entry. Infinite where V is too close to singular.
    """
    k = len(states)
    try:
        N = np.linalg.inv(axes)
    except np.linalg.LinAlgError:
        return np.full(k, np.inf)
    miss = np.abs(N @ axes - np.eye(k)) + 2.0 * (k + 2) * UNIT * (np.abs(N) @ np.abs(axes))
    off = float(miss.sum(axis=1).max()) * (1.0 + 8.0 * k * UNIT)
    if not off < 0.01:
        return np.full(k, np.inf)
    p, G = flow.set_at(len(flow.steps))
    p, G = p[list(states)], G[:, list(states)]
    shifted = p.copy()
    shifted[:, 0] -= centre
    size = np.abs(p).sum(axis=1) + np.abs(centre) + generator_box(G)
    q = N @ shifted
    spread = np.abs(np.einsum("fi,gin->fgn", N, G)).sum(axis=(1, 2)) * (1.0 + 4.0 * (G.size + 4) * UNIT)
    reach = np.maximum(flow.bounds.upper(q), flow.bounds.upper(-q)) + spread
    reach = reach + 8.0 * (k + 4) * UNIT * (np.abs(N) @ size)
    return np.asarray((reach + 2.0 * off * reach.max(initial=0.0)) * (1.0 + 4.0 * UNIT))


def modal_axes(slope: Floats) -> Floats:
    """Unit vectors along the real and imaginary parts of the eigenvectors of (n, n), as columns.

    The identity where they are too nearly dependent.
    """
    n = len(slope)
    if np.isfinite(slope).all():
        values, vectors = np.linalg.eig(slope)
        columns = []
        for value, vector in zip(values, vectors.T, strict=True):
            if value.imag > 0.0:
                columns += [vector.real, vector.imag]
            elif value.imag == 0.0:
                columns.append(vector.real)
        axes = np.array(columns).T
        if axes.shape == (n, n):
            axes = axes / np.maximum(np.linalg.norm(axes, axis=0), 1e-300)
            if np.isfinite(axes).all() and np.linalg.cond(axes) < 1e4:
                return axes
    return np.eye(n)


def principal_axes(flow: Flow) -> Floats:
    """Principal directions of the linear part and the generators at the end of the flow."""
    p, G = flow.set_at(len(flow.steps))
    vectors = np.hstack([flow.bounds.linear_part(p), G[:, :, 0].T])
    scale = np.maximum(np.abs(vectors).sum(axis=1), 1e-300)
    U = np.linalg.svd(vectors / scale[:, None], full_matrices=True)[0]
    axes = U * scale[:, None]
    return np.asarray(axes / np.linalg.norm(axes, axis=0))


def tightest(flow: Flow, candidates: Sequence[Floats], centre: Floats) -> tuple[Floats, Floats] | None:
    """(axes, half-widths) of the candidate frame whose parallelotope around the set is smallest."""
    states = range(len(centre))
    best: tuple[Floats, Floats] | None = None
    least = np.inf
    for axes in candidates:
        widths = half_widths(flow, axes, centre, list(states))
        if not np.isfinite(widths).all():
            continue
        volume = float(np.log(np.maximum(widths, 1e-300)).sum() + np.log(max(abs(np.linalg.det(axes)), 1e-300)))
        if volume < least:
            best, least = (axes, widths), volume
    return best
