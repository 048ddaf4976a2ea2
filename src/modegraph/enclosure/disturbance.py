"""What a bounded measurable disturbance does to the error within a step (numba)."""

from __future__ import annotations

import numpy as np
from numba import njit

from .polynomial import KERNEL
from .rounding import TINY, UNIT, UP
from .variational import apply_matrix, matrix_product

SET_VARIABLE = -1
DROPPED = -2
"""Owners of a monomial of the Jacobian's table: kept, or of a degree that G and Psi do not carry;
any other owner v means that the monomial holds the error variable of state v."""

MOST_POWERS, NEGLIGIBLE = 200, 1e-18
"""Powers of the Jacobian taken one by one: until the tail, in the infinity norm, is so small."""

SIGMA_2 = 0.1284
"""int_0^1 |s^2/2 - 1/6| ds = 2 / (9 sqrt(3)) = 0.12830..., rounded up."""


@njit(**KERNEL)
def disturbance_bounds(Q, RQ, outputs, first, n, radius, KJ, embed, owner):
    """Mean over the step of each column of df/dw, its sup, and the radius of what the mean misses.

    Output node ``outputs[first + i * nw + j]`` is df_i/dw_j. Returns B (nw, n, Nq), size (n,) =
    sup |B| wr, miss (n,) = sup |df/dw - B| wr.
    """
    nw = radius.size
    Nq = embed.size
    B = np.zeros((nw, n, Nq))
    size = np.zeros(n)
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
            size[i] += a * UP * radius[j]
            miss[i] += off * UP * radius[j]
    for i in range(n):
        size[i] = size[i] * UP + TINY
        miss[i] = miss[i] * UP + TINY
    return B, size, miss


@njit(**KERNEL)
def disturbance_columns(J, dJ, B, size_b, radius, Y, size_y, h, q, pairs, product, offset, start, degree):
    """u' = h J(0, xi) u + h B(xi) v, |v| <= radius, gives u(1) = int exp(Z (1 - s)) h B v ds, Z = h J(0, xi).

    Two columns an input, first and second (nw, n, Nq), and a box (n,) for the rest. Y (n, n) bounds |Z|
    entrywise, size_y its infinity norm, size_b = sup |B| radius.
    """
    nw, n, Nq = B.shape
    outside = np.zeros(n)
    first = np.zeros((nw, n, Nq))
    second = np.zeros((nw, n, Nq))
    if nw > 0:
        Y2 = matrix_product(Y, Y) * UP
        largest = 0.0
        for i in range(n):
            largest = max(largest, h * size_b[i])
        # Third and higher powers entry by entry, int (1 - s)^k / k! ds = 1 / (k + 1)!; the tail beyond
        # in the infinity norm, hence in every entry. That norm knows no units: where those of the states
        # differ it is far larger than the entries, so powers are taken until nothing is left to it.
        high = np.zeros(n)
        power = h * size_b
        tail = 1.0
        k = 0
        while k < MOST_POWERS and (k < 10 or tail > NEGLIGIBLE):
            k += 1
            following = np.full(n, TINY)
            for i in range(n):
                for l in range(n):
                    following[i] += Y[i, l] * power[l]
            power = following * (UP / (k + 1))
            tail *= size_y / (k + 1) * UP
            if k > 2:
                high += power
        high *= UP
        rest = tail * size_y / (k + 2) * np.exp(size_y) * UP * largest
        gamma = 1.01 * (2 * n * pairs + 3 * n + 16) * UNIT
        for i in range(n):
            s = rest + high[i]
            for k in range(n):
                identity = 1.0 if i == k else 0.0
                s += (SIGMA_2 * Y2[i, k] + gamma * (identity + Y[i, k] + Y2[i, k])) * h * size_b[k]
            outside[i] += s * UP + TINY
        for j in range(nw):
            image, lost_1 = apply_matrix(J, dJ, B[j], n, q, h, product, offset, start, degree)
            again, lost_2 = apply_matrix(J, dJ, image, n, q, h, product, offset, start, degree)
            for i in range(n):
                s = 0.75 * lost_1[i] + lost_2[i] / 6.0
                for k in range(n):
                    s += Y[i, k] * lost_1[k] / 6.0
                outside[i] += h * radius[j] * s * UP
                for l in range(Nq):
                    first[j, i, l] = h * radius[j] * (B[j, i, l] + image[i, l] / 2.0 + again[i, l] / 6.0)
                    second[j, i, l] = h * radius[j] * image[i, l] / 4.0
    return first, second, outside
