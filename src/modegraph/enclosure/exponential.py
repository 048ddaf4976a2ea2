"""What acts on the error from outside during a step, carried to its end by exp(Z x), Z = h J(0, xi) (numba)."""

from __future__ import annotations

import numpy as np
from numba import njit

from modegraph.enclosure.polynomial import KERNEL
from modegraph.enclosure.rounding import TINY, UNIT, UP
from modegraph.enclosure.variational import apply_matrix, chord_distance, matrix_product

POWERS = 6
"""Powers of Z that are formed, so that their terms cancel as they do in truth."""
MOST_POWERS, NEGLIGIBLE = 200, 1e-18
"""Powers bounded entry by entry: until the next would add so little of the first of them."""


@njit(**KERNEL)
def exponential_terms(jacobian, vector, h, q, table):
    """Z^k v for k = 0 .. POWERS: polynomials (POWERS+1, n, Nq), their norms and what they miss (POWERS+1, n), and
    a bound (n,) of |Z^k v| / k! summed over all higher k.

    v (n, Nq).
    """
    nJ = jacobian.nJ
    n, Nq = vector.shape
    images = np.zeros((POWERS + 1, n, Nq))
    sizes = np.zeros((POWERS + 1, n))
    missed = np.zeros((POWERS + 1, n))
    gamma = 1.01 * (n * table.pairs + 2 * n + 16) * UNIT
    # |Z| entrywise, and its infinity norm.
    Y = np.zeros((n, n))
    norm = 0.0
    for r in range(n):
        row = 0.0
        for c in range(n):
            s = 0.0
            for d in range(q + 1):
                s += nJ[r * n + c, 0, d]
            Y[r, c] = s * h * UP
            row += Y[r, c]
        norm = max(norm, row * UP)
    for i in range(n):
        for l in range(Nq):
            images[0, i, l] = vector[i, l]
    for k in range(POWERS + 1):
        if k > 0:
            image, lost = apply_matrix(jacobian, images[k - 1], n, q, h, table)
            for i in range(n):
                for l in range(Nq):
                    images[k, i, l] = image[i, l]
                s = lost[i] + TINY
                for c in range(n):
                    s += Y[i, c] * (missed[k - 1, c] + gamma * sizes[k - 1, c])
                missed[k, i] = s * UP
        for i in range(n):
            s = 0.0
            for l in range(Nq):
                s += abs(images[k, i, l])
            sizes[k, i] = s * UP
    # Higher powers entry by entry, the rest in the infinity norm, hence in every entry. That norm knows no units:
    # where those of the states differ it is far larger than the entries, so powers go on until nothing is left to it.
    power = (sizes[POWERS] + missed[POWERS]).reshape(n, 1)
    for k in range(1, POWERS + 1):
        power = power * (UP / k)
    largest = 0.0
    for i in range(n):
        largest = max(largest, power[i, 0])
    negligible = NEGLIGIBLE * largest
    beyond = np.zeros(n)
    k = POWERS
    while k < MOST_POWERS and (k < POWERS + 6 or 2.0 * norm > k + 2.0 or largest > negligible):
        k += 1
        power = matrix_product(Y, power) * (UP / k)
        largest = 0.0
        for i in range(n):
            beyond[i] += power[i, 0] * UP
            largest = max(largest, power[i, 0])
    # sum over m >= 1 of norm^m / ((k + 1) ... (k + m)).
    rest = norm / (k + 1.0) * (2.0 if 2.0 * norm <= k + 2.0 else np.exp(norm)) * UP
    for i in range(n):
        beyond[i] = (beyond[i] + rest * largest) * UP + TINY
    return images, sizes, missed, beyond


@njit(**KERNEL)
def push_columns(jacobian, n, h, q, table):
    """y' = h J(0, xi) y + c' with |c'_i| of integral at most 1, in one i at a time.

    A push at x before the end ends as exp(Z x) e_i, which is near the chord from e_i to exp(Z) e_i. Returns
    columns for the middle and half of each chord (n, 2, n, Nq), row i for a push in i; boxes (n, n) for what is
    not on it, column i for a push in i; and bounds (n, n) of |y| during the step.
    """
    Nq = jacobian.J.shape[2]
    chords = np.zeros((n, 2, n, Nq))
    strays = np.zeros((n, n))
    tops = np.zeros((n, n))
    unit = np.zeros((n, Nq))
    for c in range(n):
        unit[:] = 0.0
        unit[c, 0] = 1.0
        images, sizes, missed, beyond = exponential_terms(jacobian, unit, h, q, table)
        for i in range(n):
            off = beyond[i]
            whole = 0.0
            factorial = 1.0
            for k in range(1, POWERS + 1):
                factorial *= k
                whole += sizes[k, i] / factorial
                off += missed[k, i] / factorial
                if k > 1:
                    off += chord_distance(k) * sizes[k, i] / factorial
            end = 0.0
            for l in range(Nq):
                s = 0.0
                factorial = 1.0
                for k in range(1, POWERS + 1):
                    factorial *= k
                    s += images[k, i, l] / factorial
                chords[c, 0, i, l] = unit[i, l] + 0.5 * s
                chords[c, 1, i, l] = 0.5 * s
                end += abs(unit[i, l] + s)
            off += 32.0 * UNIT * (whole + 1.0)
            strays[i, c] = off * UP
            tops[i, c] = (max(unit[i, 0], end) + off) * UP
    return chords, strays, tops
