"""Sets in and out of the coordinates of a frame, and boxes around them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.polynomial import box_of_generators, thin_generators
from modegraph.enclosure.rounding import UNIT
from modegraph.reach.field import Frame

Floats = NDArray[np.float64]


def into_frame(frame: Frame, p: Floats, slack: Floats) -> tuple[Floats, Floats]:
    """Polynomials V^-1 p and a box (n,) for V^-1 of the old box and what rounding loses."""
    size = np.abs(frame.inverse) @ (np.abs(p).sum(axis=1) + slack)
    count = p.shape[0] + p.shape[1] + 8
    return frame.inverse @ p, np.abs(frame.inverse) @ slack * (1.0 + 1e-12) + 4.0 * count * UNIT * size


def out_of_frame(frame: Frame, p: Floats, G: Floats) -> tuple[Floats, Floats]:
    """V p and V G; what rounding loses is appended as axis generators."""
    n = len(p)
    size = np.abs(frame.V) @ (np.abs(p).sum(axis=1) + generator_box(G))
    out = np.zeros((len(G) + n, n, G.shape[2]))
    out[: len(G)] = np.einsum("ij,gjk->gik", frame.V, G)
    out[len(G) + np.arange(n), np.arange(n), 0] = 4.0 * (p.shape[1] + G.shape[0] * G.shape[2] + n + 8) * UNIT * size
    return frame.V @ p, out


def generator_box(G: Floats) -> Floats:
    """Radii (n,) of a box around sum_g G_g(xi) zeta_g, rounded up."""
    return np.asarray(box_of_generators(np.ascontiguousarray(G), np.int64(0)))


def thinned(G: Floats, kept: int) -> Floats:
    """Generators that hold the same sets with the first ``kept`` coefficients only; boxes for the others."""
    if kept == 0:
        return np.diag(generator_box(G))[:, :, None]
    if G.shape[2] <= 2 * kept:
        return G
    return np.asarray(thin_generators(np.ascontiguousarray(G), np.int64(kept)))
