"""The quadratic terms of the error equation over a zonotope, signs included (numba)."""

from __future__ import annotations

import numpy as np
from numba import njit

from .polynomial import KERNEL, ascending
from .rounding import TINY, UNIT, UP

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
    a0 = np.zeros((count, n))
    a1 = np.zeros((count, n))
    for a in range(count - n):
        for v in range(n):
            a0[a, v] = G0[a, v]
            a1[a, v] = G1[a, v]
    for v in range(n):
        a0[count - n + v, v] = spread[v]
        a1[count - n + v, v] = spread[v]
    total = np.zeros(n)
    for a in range(count):
        for k in range(n):
            total[k] += max(abs(a0[a, k]), abs(a1[a, k]))
    out = np.zeros(n)
    h0 = np.zeros(n)
    h1 = np.zeros(n)
    for i in range(n):
        s00 = 0.0
        s01 = 0.0
        s11 = 0.0
        size = 0.0
        for b in range(count):
            for k in range(n):
                h0[k] = 0.0
                h1[k] = 0.0
                for l in range(n):
                    h0[k] += H[i, k, l] * a0[b, l]
                    h1[k] += H[i, k, l] * a1[b, l]
                    size += abs(H[i, k, l]) * max(abs(a0[b, l]), abs(a1[b, l])) * total[k]
            for a in range(count):
                x00 = 0.0
                x01 = 0.0
                x10 = 0.0
                x11 = 0.0
                for k in range(n):
                    x00 += a0[a, k] * h0[k]
                    x01 += a0[a, k] * h1[k]
                    x10 += a1[a, k] * h0[k]
                    x11 += a1[a, k] * h1[k]
                s00 += abs(x00)
                s01 += 0.5 * (abs(x01) + abs(x10))
                s11 += abs(x11)
        out[i] = (0.5 * max(s00, max(s01, s11)) + 1.01 * (2 * n + 4) * UNIT * size) * UP + TINY
    return out


@njit(**KERNEL)
def main_generators(G0, G1, most, spread):
    """Constant coefficients of the ``most`` largest generators at both ends, (K, n) each; what is left
    out, and everything that depends on the set variables, is added to ``spread`` (n,)."""
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
    return out0, out1
