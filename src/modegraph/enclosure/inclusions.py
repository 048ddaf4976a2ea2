"""How far a set reaches beyond another, both affine in the references of two modes, pair by pair (numba)."""

from __future__ import annotations

import numpy as np
from numba import njit

from modegraph.enclosure.polynomial import KERNEL
from modegraph.enclosure.rounding import TINY, UNIT


@njit(**KERNEL)
def excesses(p, q, reach, reach_rates, bound, bound_rates, allowance):
    """Bounds (B,), (B,) of the largest reach_f(p) - bound_f(q), from below with the allowance (f,) taken away,
    from above with it added.

    reach, bound (f,) and their rates (f, ki), (f, kj) are doubles nearest to the true numbers.
    """
    B = p.shape[0]
    low = np.full(B, -np.inf)
    high = np.full(B, -np.inf)
    ku = 2.0 * (p.shape[1] + q.shape[1] + 6) * UNIT
    for b in range(B):
        for f in range(reach.size):
            total = reach[f] - bound[f]
            size = abs(reach[f]) + abs(bound[f])
            for v in range(p.shape[1]):
                total += reach_rates[f, v] * p[b, v]
                size += abs(reach_rates[f, v] * p[b, v])
            for v in range(q.shape[1]):
                total -= bound_rates[f, v] * q[b, v]
                size += abs(bound_rates[f, v] * q[b, v])
            error = allowance[f] + ku * size + TINY
            if not total - error <= low[b]:
                low[b] = total - error
            if not total + error <= high[b]:
                high[b] = total + error
    return low, high


@njit(**KERNEL)
def distances(p, q, centre, rates, other, other_rates, rows, allowance):
    """Lower bounds (B,) of |rows (c(p) - c'(q))|_2, each coordinate of c - c' off by up to allowance (n,)."""
    B = p.shape[0]
    found = np.zeros(B)
    ku = 2.0 * (p.shape[1] + q.shape[1] + 6) * UNIT
    n = centre.size
    y = np.empty(n)
    lost = np.empty(n)
    for b in range(B):
        for i in range(n):
            total = centre[i] - other[i]
            size = abs(centre[i]) + abs(other[i])
            for v in range(p.shape[1]):
                total += rates[i, v] * p[b, v]
                size += abs(rates[i, v] * p[b, v])
            for v in range(q.shape[1]):
                total -= other_rates[i, v] * q[b, v]
                size += abs(other_rates[i, v] * q[b, v])
            y[i] = total
            lost[i] = allowance[i] + ku * size + TINY
        square = 0.0
        for f in range(rows.shape[0]):
            along = 0.0
            off = 0.0
            for i in range(n):
                along += rows[f, i] * y[i]
                off += abs(rows[f, i]) * (lost[i] + 2.0 * (n + 2) * UNIT * abs(y[i]))
            square += max(0.0, abs(along) - off) ** 2
        found[b] = np.sqrt(square) * (1.0 - 4.0 * (rows.shape[0] + 4) * UNIT)
    return found
