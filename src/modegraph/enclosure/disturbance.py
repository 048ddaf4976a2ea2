"""What a bounded measurable disturbance does to the error within a step (numba)."""

from __future__ import annotations

import numpy as np
from numba import njit

from modegraph.enclosure.exponential import POWERS, exponential_terms
from modegraph.enclosure.polynomial import KERNEL
from modegraph.enclosure.rounding import TINY, UNIT, UP

SET_VARIABLE = -1
DROPPED = -2
"""Owners of a monomial of the Jacobian's table: kept, or of a degree that G and Psi do not carry;
any other owner v means that the monomial holds the error variable of state v."""

MEAN = (1.0, 1 / 2, 1 / 6, 1 / 24, 1 / 120, 1 / 720, 1 / 5040)
"""int_0^1 x^k / k! dx = 1 / (k + 1)!."""
SLOPE = (0.0, 1.0, 1 / 2, 3 / 20, 1 / 30, 1 / 168, 1 / 1120)
"""Slope 6 k / (k! (k + 1) (k + 2)) of the line nearest to x^k / k! over [0, 1]; it has the same mean."""
ROUNDED = 64.0
"""Roundings of a column's coefficient, at most."""
STRAY = (0.0, 0.0, 0.0321, 0.0162, 0.0047, 0.00099, 0.00017)
"""Mean distance of x^k / k! from that line, rounded up."""


@njit(**KERNEL)
def disturbance_bounds(Q, RQ, outputs, first, n, radius, errors):
    """Mean over the step of each column of df/dw, its sup, and the radius of what the mean misses.

    Output node ``outputs[first + i * nw + j]`` is df_i/dw_j. Returns B (nw, n, Nq) and miss (n,) =
    sup |df/dw - B| wr.
    """
    embed, owner, _ = errors
    KJ = Q.shape[1] - 1
    nw = radius.size
    Nq = embed.size
    B = np.zeros((nw, n, Nq))
    miss = np.zeros(n)
    for i in range(n):
        for j in range(nw):
            o = outputs[first + i * nw + j]
            a = 0.0
            off = RQ[o]
            for l in range(KJ + 1):
                for k in range(owner.size):
                    if owner[k] != SET_VARIABLE:
                        off += abs(Q[o, l, k])
                for k in range(Nq):
                    x = Q[o, l, embed[k]]
                    # sup over s in [0, 1] of |s^l - 1/(l + 1)| is l/(l + 1).
                    off += abs(x) * l / (l + 1)
                    a += abs(x) / (l + 1)
                    B[j, i, k] += x / (l + 1)
            off += 1.01 * (KJ + 3) * UNIT * a
            miss[i] += off * UP * radius[j]
    for i in range(n):
        miss[i] = miss[i] * UP + TINY
    return B, miss


@njit(**KERNEL)
def disturbance_columns(jacobian, B, radius, h, q, table):
    """u' = h J(0, xi) u + h B(xi) v, |v| <= radius, gives u(1) = int_0^1 exp(Z x) h B v dx, Z = h J(0, xi).

    Of x^k / k! in the exponential its mean acts on int v, its slope on int (x - 1/2) v, at most radius / 4,
    and for k = 2 the rest on one more number: three columns an input (nw, 3, n, Nq). Then a box (n,) for what
    is left, and a bound (n,) of |u(s)| / s.
    """
    nw, n, Nq = B.shape
    outside = np.zeros(n)
    speed = np.zeros(n)
    columns = np.zeros((nw, 3, n, Nq))
    for j in range(nw):
        images, sizes, missed, beyond = exponential_terms(jacobian, B[j], h, q, table)
        weight = h * radius[j]
        for i in range(n):
            s = beyond[i] / (POWERS + 2)
            t = beyond[i]
            factorial = 1.0
            for k in range(POWERS + 1):
                factorial *= max(k, 1)
                stray = STRAY[k] if k > 2 else 0.0
                s += MEAN[k] * missed[k, i] + (stray + ROUNDED * UNIT) * sizes[k, i]
                t += (sizes[k, i] + missed[k, i]) / factorial
                for l in range(Nq):
                    columns[j, 0, i, l] += weight * MEAN[k] * images[k, i, l]
                    columns[j, 1, i, l] += weight * (SLOPE[k] / 4.0) * images[k, i, l]
            for l in range(Nq):
                columns[j, 2, i, l] = weight * STRAY[2] * images[2, i, l]
            outside[i] += weight * s * UP + TINY
            speed[i] += weight * t * UP + TINY
    return columns, outside * UP, speed * UP
