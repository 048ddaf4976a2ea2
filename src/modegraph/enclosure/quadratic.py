"""The quadratic terms of the error equation over a zonotope, signs included (numba)."""

from __future__ import annotations

import numpy as np
from numba import njit

from modegraph.enclosure.polynomial import KERNEL, ascending
from modegraph.enclosure.rounding import TINY, UNIT, UP

MAIN_GENERATORS = 40
"""Generators whose signs are followed through the quadratic terms."""


@njit(**KERNEL)
def quadratic_bound(H, G0, G1, spread):
    """Bounds (n,) of |e' H_i e| / 2 for e = (1 - s) g0 + s g1 + b, any s in [0, 1], |b| <= spread, where
    g0 = sum_a G0_a zeta_a, g1 = sum_a G1_a zeta_a with the same |zeta_a| <= 1; H (n, n, n), G (K, n).

    The weights (1 - s)^2, 2 s (1 - s), s^2 of the three products sum to one. The signs in the
    generators count: along a slow mode what multiplies nearly cancels, in the box around it does not.
    """
    n = spread.size
    count = G0.shape[0] + n
    # Generators side by side: the loops over all of them are vectorised.
    a0 = np.zeros((n, count))
    a1 = np.zeros((n, count))
    for v in range(n):
        for a in range(count - n):
            a0[v, a] = G0[a, v]
            a1[v, a] = G1[a, v]
        a0[v, count - n + v] = spread[v]
        a1[v, count - n + v] = spread[v]
    total = np.zeros(n)
    for k in range(n):
        for a in range(count):
            total[k] += max(abs(a0[k, a]), abs(a1[k, a]))
    out = np.zeros(n)
    x = np.zeros((4, count))
    sums = np.zeros((3, count))
    for i in range(n):
        size = 0.0
        for k in range(n):
            for l in range(n):
                size += abs(H[i, k, l]) * total[k] * total[l]
        sums[:] = 0.0
        for b in range(count):
            x[:] = 0.0
            for k in range(n):
                h0 = 0.0
                h1 = 0.0
                for l in range(n):
                    h0 += H[i, k, l] * a0[l, b]
                    h1 += H[i, k, l] * a1[l, b]
                for a in range(count):
                    x[0, a] += a0[k, a] * h0
                    x[1, a] += a0[k, a] * h1
                    x[2, a] += a1[k, a] * h0
                    x[3, a] += a1[k, a] * h1
            for a in range(count):
                sums[0, a] += abs(x[0, a])
                sums[1, a] += 0.5 * (abs(x[1, a]) + abs(x[2, a]))
                sums[2, a] += abs(x[3, a])
        top = 0.0
        for row in range(3):
            s = 0.0
            for a in range(count):
                s += sums[row, a]
            top = max(top, s)
        out[i] = (0.5 * top + 1.01 * (2 * n + 4) * UNIT * size) * UP + TINY
    return out


@njit(**KERNEL)
def main_generators(G0, G1, most):
    """Constant coefficients of the ``most`` largest generators at both ends, (K, n) each, and a box (n,)
    for what is left out and everything that depends on the set variables."""
    count, n, Nq = G0.shape
    scale = np.zeros(n)
    for a in range(count):
        for i in range(n):
            scale[i] += abs(G0[a, i, 0])
    size = np.zeros(count)
    for a in range(count):
        for i in range(n):
            size[a] -= abs(G0[a, i, 0]) / (scale[i] + TINY)
    ranked = ascending(size)
    kept = min(most, count)
    out0 = np.zeros((kept, n))
    out1 = np.zeros((kept, n))
    spread = np.zeros(n)
    for r in range(count):
        a = ranked[r]
        for i in range(n):
            s0 = 0.0
            s1 = 0.0
            for k in range(0 if r >= kept else 1, Nq):
                s0 += abs(G0[a, i, k])
                s1 += abs(G1[a, i, k])
            spread[i] += max(s0, s1) * UP
            if r < kept:
                out0[r, i] = G0[a, i, 0]
                out1[r, i] = G1[a, i, 0]
    for i in range(n):
        spread[i] *= UP
    return out0, out1, spread
