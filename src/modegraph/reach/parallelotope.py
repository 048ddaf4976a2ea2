"""Parallelotopes around reach sets: for restarting a flowpipe, and for invariant sets."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.rounding import UNIT
from modegraph.reach.inverse import near_inverse
from modegraph.reach.reach_set import ReachSet

Floats = NDArray[np.float64]


def half_widths(reach: ReachSet, axes: Floats, centre: Floats) -> Floats:
    """Bounds (k,) of |V^-1 (x - centre)| over a set in k coordinates.

    ``axes`` V (k, k). With any N near V^-1 and R = N V - I, V^-1 y = (I + R)^-1 N y, so the bound of
    N y grows by |R| / (1 - |R|) of its largest entry. Infinite where V is too close to singular.
    """
    p, G, k = reach.p, reach.G, reach.dim
    if not (np.isfinite(axes).all() and reach.is_finite):
        return np.full(k, np.inf)
    found = near_inverse(axes)
    if found is None:
        return np.full(k, np.inf)
    N, off = found
    if not off < 0.01:
        return np.full(k, np.inf)
    shifted = p.copy()
    shifted[:, 0] -= centre
    size = np.abs(p).sum(axis=1) + np.abs(centre) + reach.spread
    q = N @ shifted
    spread = np.abs(np.einsum("fi,gin->fgn", N, G)).sum(axis=(1, 2)) * (1.0 + 4.0 * (G.size + 4) * UNIT)
    spread = spread + np.abs(N) @ reach.box
    far = np.maximum(reach.bounds.upper(q), reach.bounds.upper(-q)) + spread
    far = far + 8.0 * (k + 4) * UNIT * (np.abs(N) @ size)
    return np.asarray((far + 2.0 * off * far.max(initial=0.0)) * (1.0 + 4.0 * UNIT))


def modal_axes(slope: Floats) -> Floats:
    """Unit vectors along the real and imaginary parts of the eigenvectors of (n, n), as columns.

    Slowest mode first; the identity where they are too nearly dependent.
    """
    axes = _eigenvectors(slope)
    return axes if axes is not None and np.linalg.cond(axes) < 1e4 else np.eye(len(slope))


def slow_and_fast_axes(slope: Floats) -> Floats:
    """Orthonormal bases of the invariant subspaces of the slow and of the fast modes, as columns.

    They are told apart at the largest gap between decay rates; the identity where there is none.
    Inside each group nothing is separated: nearly parallel modes would only make the frame skew.
    """
    n = len(slope)
    axes = _eigenvectors(slope)
    if axes is None or n < 2:
        return np.eye(n)
    ratios = _rate_ratios(slope)
    slow = int(np.argmax(ratios)) + 1
    if ratios[slow - 1] < 2.0:
        return np.eye(n)
    return np.hstack([np.linalg.qr(axes[:, :slow])[0], np.linalg.qr(axes[:, slow:])[0]])


def mode_gap(slope: Floats) -> float:
    """Largest ratio of neighbouring decay rates."""
    return float(_rate_ratios(slope).max(initial=1.0)) if np.isfinite(slope).all() else 1.0


def _rate_ratios(slope: Floats) -> Floats:
    rates = np.sort(np.abs(np.linalg.eigvals(slope).real))
    return np.asarray(rates[1:] / np.maximum(rates[:-1], 1e-9))


def _eigenvectors(slope: Floats) -> Floats | None:
    n = len(slope)
    if not np.isfinite(slope).all():
        return None
    values, vectors = np.linalg.eig(slope)
    columns = []
    for k in np.argsort(np.abs(values.real), kind="stable"):
        if values[k].imag > 0.0:
            columns += [vectors[:, k].real, vectors[:, k].imag]
        elif values[k].imag == 0.0:
            columns.append(vectors[:, k].real)
    axes = np.array(columns).T
    if axes.shape != (n, n):
        return None
    axes = axes / np.maximum(np.linalg.norm(axes, axis=0), 1e-300)
    return axes if np.isfinite(axes).all() else None


def principal_axes(reach: ReachSet) -> Floats:
    """Principal directions of the linear part and the generators."""
    vectors = np.hstack([reach.bounds.linear_part(reach.p), reach.G[:, :, 0].T])
    if not np.isfinite(vectors).all():
        return np.eye(reach.dim)
    scale = np.maximum(np.abs(vectors).sum(axis=1), 1e-300)
    U = np.linalg.svd(vectors / scale[:, None], full_matrices=True)[0]
    axes = U * scale[:, None]
    return np.asarray(axes / np.linalg.norm(axes, axis=0))


def tightest(sets: Sequence[ReachSet], candidates: Sequence[Floats], centre: Floats) -> tuple[Floats, Floats] | None:
    """(axes, half-widths) of the candidate frame whose parallelotope around the sets is smallest."""
    best: tuple[Floats, Floats] | None = None
    least = np.inf
    for axes in candidates:
        widths = np.max([half_widths(reach, axes, centre) for reach in sets], axis=0)
        if not np.isfinite(widths).all():
            continue
        volume = float(np.log(np.maximum(widths, 1e-300)).sum() + np.log(max(abs(np.linalg.det(axes)), 1e-300)))
        if volume < least:
            best, least = (axes, widths), volume
    return best
