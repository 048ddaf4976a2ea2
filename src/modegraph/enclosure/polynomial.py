"""Truncated products and compositions of dense polynomials (numba kernels).

A polynomial is a coefficient vector over a ``Monomials`` table; its top nonzero degree travels with
it (-1: zero) and cuts the loops.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from modegraph.enclosure.rounding import UNIT

KERNEL = {"cache": True, "fastmath": False, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
SHORT = {**KERNEL, "nogil": False}
"""For kernels of less than a tenth of a millisecond: giving the interpreter lock away costs more than it gains."""


@njit(inline="always", **KERNEL)
def _accumulate(c, a, da, b, db, dmax, factor, table):
    if da > dmax:
        da = dmax
    # Unsigned indices: signed ones are checked for counting from the end (a quarter of the time).
    for i in range(np.uint64(table.start[da + 1])):
        x = a[i]
        if x != 0.0:
            x *= factor
            d = dmax - table.degree[i]
            if db < d:
                d = db
            o = np.uint64(table.offset[i])
            for j in range(np.uint64(table.start[d + 1])):
                c[table.product[o + j]] += x * b[j]


@njit(**KERNEL)
def multiply_into(c, a, da, b, db, dmax, factor, table):
    """c += factor a b, truncated at degree dmax; da, db are the degrees of a and b."""
    if da < 0 or db < 0:
        return
    if da <= db:
        _accumulate(c, a, da, b, db, dmax, factor, table)
    else:
        _accumulate(c, b, db, a, da, dmax, factor, table)


@njit(**KERNEL)
def compose_into(c, u, du, series, dmax, work, table):
    """c = sum_k series[k] u**k by Horner, truncated at degree dmax; u has no constant term.

    Returns the degree of c.
    """
    if du < 1:
        c[:] = 0.0
        c[0] = series[0]
        return 0
    start = table.start
    c[:] = 0.0
    c[0] = series[dmax]
    dc = np.int64(0)
    for k in range(dmax - 1, -1, -1):
        for i in range(start[dmax + 1]):
            work[i] = 0.0
        multiply_into(work, c, dc, u, du, dmax, 1.0, table)
        dc = min(dmax, dc + du)
        for i in range(start[dc + 1]):
            c[i] = work[i]
        c[0] += series[k]
    return dc


@njit(**SHORT)
def box_of_generators(G, first):
    """Radii (n,) of a box around sum_g G_g(xi) zeta_g, without the coefficients before ``first``, rounded up."""
    out = np.zeros(G.shape[1])
    for g in range(G.shape[0]):
        for i in range(G.shape[1]):
            for k in range(first, G.shape[2]):
                out[i] += abs(G[g, i, k])
    for i in range(out.size):
        out[i] *= 1.0 + (G.shape[0] * G.shape[2] + 4) * UNIT * 2.0
    return out


@njit(**SHORT)
def generator_reach(A, G):
    """Sums (f,) of |A G[g, :, k]| over g and k for the rows of A (f, n), and (n,) of |G[g, i, k]| (floats).

    G may have further rows; they do not count.
    """
    rows, n = A.shape
    Nq = G.shape[2]
    reach = np.zeros((rows, Nq))
    size = np.zeros((n, Nq))
    work = np.zeros(Nq)
    for g in range(G.shape[0]):
        for i in range(n):
            for k in range(Nq):
                size[i, k] += abs(G[g, i, k])
        for f in range(rows):
            for k in range(Nq):
                work[k] = A[f, 0] * G[g, 0, k]
            for i in range(1, n):
                for k in range(Nq):
                    work[k] += A[f, i] * G[g, i, k]
            for k in range(Nq):
                reach[f, k] += abs(work[k])
    total = np.zeros(rows)
    for f in range(rows):
        for k in range(Nq):
            total[f] += reach[f, k]
    sizes = np.zeros(n)
    for i in range(n):
        for k in range(Nq):
            sizes[i] += size[i, k]
    return total, sizes


@njit(**SHORT)
def thin_generators(G, kept):
    """Generators that hold the same sets with the first ``kept`` coefficients only; axes for the others."""
    count, n, _ = G.shape
    out = np.zeros((count + n, n, kept))
    for g in range(count):
        for i in range(n):
            for k in range(kept):
                out[g, i, k] = G[g, i, k]
    box = box_of_generators(G, kept)
    for i in range(n):
        out[count + i, i, 0] = box[i]
    return out


@njit(**KERNEL)
def ascending(values):
    """Indices that sort a few hundred values, equal ones in their order (NumPy's sort takes a second to compile)."""
    order = np.zeros(values.size, np.int64)
    for k in range(values.size):
        j = k
        while j > 0 and values[order[j - 1]] > values[k]:
            order[j] = order[j - 1]
            j -= 1
        order[j] = k
    return order
