"""The generators of a reach set, G (g, n, Nq): boxes around them, and fewer of them that hold the same.

Every monomial lies in [-1, 1] over a piece, so coefficients count one by one: G_g(xi) zeta_g is within
sum_k |G_gk|, whatever the piece.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.polynomial import box_of_generators, generator_reach, thin_generators
from modegraph.enclosure.rounding import UNIT

Floats = NDArray[np.float64]


def generator_box(G: Floats) -> Floats:
    """Radii (n,) of a box around sum_g G_g(xi) zeta_g, rounded up."""
    return np.asarray(box_of_generators(np.ascontiguousarray(G), np.int64(0)))


def generator_sizes(A: Floats, generators: Sequence[Floats]) -> Floats:
    """(K, f): sum_g |A G_kg|_1 for each row of A, rounded up."""
    n = A.shape[1]
    A = np.array(A)
    out = np.zeros((len(generators), len(A)))
    for k, G in enumerate(generators):
        if len(G):
            reach, size = generator_reach(A, np.ascontiguousarray(G))
            slack = 4.0 * (n + 2 + math.log2(G.size + 1)) * UNIT * (np.abs(A) @ size)
            out[k] = reach * (1.0 + 2.0 * G.size * UNIT) + slack
    return out


def thinned(G: Floats, kept: int) -> Floats:
    """Generators that hold the same sets with the first ``kept`` coefficients only; boxes for the others."""
    if kept == 0:
        return np.diag(generator_box(G))[:, :, None]
    if G.shape[2] <= 2 * kept:
        return G
    return np.asarray(thin_generators(np.ascontiguousarray(G), np.int64(kept)))


def with_box(G: Floats, radius: Floats) -> Floats:
    """Generators G, and those of a box of radii (n,)."""
    n = len(radius)
    out = np.zeros((len(G) + n, n, G.shape[2]))
    out[: len(G)] = G
    out[len(G) + np.arange(n), np.arange(n), 0] = radius
    return out
