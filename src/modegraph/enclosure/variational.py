"""The validated flow of the Jacobian, and bounds of what it does not carry (numba).

With x = p + e the error obeys de/ds = h J e + defect + h B (w - wc), s in [0, 1]. Psi is a polynomial
approximation of the fundamental matrix of h J, polynomial in the set variables too.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from modegraph.enclosure.polynomial import KERNEL, ascending, multiply_into
from modegraph.enclosure.rounding import TINY, UNIT, UP


@njit(**KERNEL)
def fundamental_matrix(jacobian, n, h, KP, q, table):
    """Psi' = h J Psi, Psi(0) = I, truncated at degree KP in time and q in the set variables.

    Returns Psi(1) (n, n, Nq), entrywise sup |Psi|, its sup at the
    end, its distance from the chord between the ends, and the tail norms (KP+1, n, n, q+2) of its
    coefficients by degree.
    """
    J, dJ, _ = jacobian
    start = table.start
    KJ = J.shape[1] - 1
    Nq = J.shape[2]
    S = np.zeros((KP + 1, n, n, Nq))
    dS = np.full((KP + 1, n, n), -1, np.int64)
    for i in range(n):
        S[0, i, i, 0] = 1.0
        dS[0, i, i] = 0
    for j in range(KP):
        for r in range(n):
            for c in range(n):
                top = -1
                for i in range(min(j, KJ) + 1):
                    for k in range(n):
                        da = dJ[r * n + k, i]
                        db = dS[j - i, k, c]
                        if da >= 0 and db >= 0:
                            multiply_into(
                                S[j + 1, r, c], J[r * n + k, i], da, S[j - i, k, c], db, q, h / (j + 1),
                                table,
                            )  # fmt: skip
                            top = max(top, min(q, da + db))
                dS[j + 1, r, c] = top
    tails = np.zeros((KP + 1, n, n, q + 2))
    sup = np.zeros((n, n))
    last = np.zeros((n, n))
    bend = np.zeros((n, n))
    end = np.zeros((n, n, Nq))
    for r in range(n):
        for c in range(n):
            for j in range(KP + 1):
                for d in range(dS[j, r, c], -1, -1):
                    s = 0.0
                    for k in range(start[d], start[d + 1]):
                        s += abs(S[j, r, c, k])
                    tails[j, r, c, d] = s * UP
                for d in range(q, -1, -1):
                    tails[j, r, c, d] += tails[j, r, c, d + 1]
                sup[r, c] += tails[j, r, c, 0]
                if j >= 2:
                    bend[r, c] += chord_distance(j) * tails[j, r, c, 0]
            sup[r, c] *= UP
            for k in range(Nq):
                s = 0.0
                for j in range(KP, -1, -1):
                    s += S[j, r, c, k]
                end[r, c, k] = s
                last[r, c] += abs(s)
            last[r, c] = (last[r, c] + 1.01 * (KP + 1) * UNIT * sup[r, c]) * UP
            bend[r, c] *= UP
    return end, sup, last, bend, tails


@njit(**KERNEL)
def chord_distance(j):
    """sup over s in [0, 1] of s - s^j = (j - 1) j^(-j/(j - 1)), rounded up."""
    return (j - 1) * float(j) ** (-j / (j - 1.0)) * (1.0 + 32.0 * UNIT)


@njit(**KERNEL)
def fundamental_defect(nJ, RJ, sup, tails, n, h, KP, q, pairs):
    """E >= int |h J Psi - Psi'| entrywise, for every J within RJ of its polynomial.

    nJ (n*n, KJ+1, q+1) are the norms of J by degree, upward.
    """
    KJ = nJ.shape[1] - 1
    E = np.zeros((n, n))
    gamma = 1.01 * (n * (KJ + 1) * pairs + 8) * UNIT
    # Psi(1) is a sum of KP + 1 coefficients: at most KP roundings.
    last = 1.01 * (KP + 1) * UNIT
    for r in range(n):
        for c in range(n):
            e = 0.0
            for k in range(n):
                e += RJ[r * n + k] * sup[k, c] * h
                size = 0.0
                for i in range(KJ + 1):
                    si = 0.0
                    for d in range(q + 1):
                        si += nJ[r * n + k, i, d]
                    if si == 0.0:
                        continue
                    size += si
                    for j in range(KP + 1):
                        if tails[j, k, c, 0] == 0.0:
                            continue
                        if i + j >= KP:
                            e += h * si * tails[j, k, c, 0] / (i + j + 1)
                        else:
                            for d in range(1, q + 1):
                                e += h * nJ[r * n + k, i, d] * tails[j, k, c, q + 1 - d] / (i + j + 1)
                e += gamma * h * size * sup[k, c]
            E[r, c] = (e + last * sup[r, c]) * UP + TINY
    return E


@njit(**KERNEL)
def exponential_majorant(X):
    """W >= sup over s in [0, 1] of |exp(X s)| entrywise, and an upper bound of |X|_inf."""
    n = X.shape[0]
    norm = 0.0
    for i in range(n):
        s = 0.0
        for j in range(n):
            s += abs(X[i, j])
        norm = max(norm, s)
    norm *= UP
    W = np.eye(n)
    power = np.eye(n)
    term = 1.0
    k = 0
    while k < 60:
        k += 1
        power = matrix_product(power, X) / k
        term *= norm / k
        W = W + np.abs(power)
        if term < 1e-18:
            break
    # Left out: sum_{i>k} norm^i / i!, in the infinity norm, hence in every entry; and the rounding
    # of power i, at most gamma(i (n + 2)) norm^i / i!.
    rest = term * norm / (k + 1) * math.exp(norm) * UP
    rest += 1.01 * k * (n + 2) * UNIT * math.exp(norm) * UP
    return (W + rest) * UP, norm


@njit(**KERNEL)
def matrix_product(A, B):
    """A B for small dense matrices, without a library call (one order of summation everywhere)."""
    C = np.zeros((A.shape[0], B.shape[1]))
    for i in range(A.shape[0]):
        for k in range(A.shape[1]):
            if A[i, k] != 0.0:
                for j in range(B.shape[1]):
                    C[i, j] += A[i, k] * B[k, j]
    return C


@njit(**KERNEL)
def solve_small(A, b):
    """Gaussian elimination with partial pivoting (floats only: a proposal). NaN where singular."""
    n = b.size
    M = A.copy()
    x = b.copy()
    for k in range(n):
        p = k
        for i in range(k + 1, n):
            if abs(M[i, k]) > abs(M[p, k]):
                p = i
        if p != k:
            for j in range(n):
                M[k, j], M[p, j] = M[p, j], M[k, j]
            x[k], x[p] = x[p], x[k]
        for i in range(k + 1, n):
            f = M[i, k] / M[k, k]
            if f != 0.0:
                for j in range(k, n):
                    M[i, j] -= f * M[k, j]
                x[i] -= f * x[k]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            x[i] -= M[i, j] * x[j]
        x[i] /= M[i, i]
    return x


@njit(**KERNEL)
def growth_bound(h, M, c):
    """g >= h M g + c with g >= 0, checked upward: then |y| <= g for |y|' <= h M |y| + c' (method:
    Picard iteration of the linear comparison system from 0 stays below g). Returns (found, g)."""
    n = c.size
    A = np.eye(n) - h * M
    top = 0.0
    for i in range(n):
        top = max(top, c[i])
    # The slack keeps components far below the largest one from failing the check by rounding.
    g = solve_small(A, c * (1.0 + 1e-6) + 1e-9 * top + TINY)
    for i in range(n):
        if not g[i] >= 0.0 or not g[i] < np.inf:
            return False, g
    for i in range(n):
        s = 0.0
        for j in range(n):
            s += h * M[i, j] * g[j]
        if not g[i] >= (s + c[i]) * UP + TINY:
            return False, g
    return True, g


@njit(**KERNEL)
def spectral_radius(A):
    """Float estimate of the spectral radius: |A^32|^(1/32)."""
    n = A.shape[0]
    B = A.copy()
    log_scale = 0.0
    for _k in range(5):
        top = 0.0
        for i in range(n):
            s = 0.0
            for j in range(n):
                s += abs(B[i, j])
            top = max(top, s)
        if top == 0.0:
            return 0.0
        if not top < np.inf:
            return np.inf
        B = B / top
        log_scale = 2.0 * (log_scale + math.log(top))
        B = matrix_product(B, B)
    top = 0.0
    for i in range(n):
        s = 0.0
        for j in range(n):
            s += abs(B[i, j])
        top = max(top, s)
    if top == 0.0:
        return 0.0
    return math.exp((log_scale + math.log(top)) / 32.0)


@njit(**KERNEL)
def apply_matrix(jacobian, vector, n, q, factor, table):
    """factor J_0(xi) v(xi) truncated at degree q, and the norms (n,) of what that drops.

    Of J coefficient 0 in time is used; v (n, Nq).
    """
    J, dJ, _ = jacobian
    start = table.start
    Nq = vector.shape[1]
    out = np.zeros((n, Nq))
    lost = np.zeros(n)
    tail = np.zeros((n, q + 2))
    top = np.full(n, -1, np.int64)
    for k in range(n):
        for d in range(q, -1, -1):
            s = 0.0
            for l in range(start[d], start[d + 1]):
                s += abs(vector[k, l])
            tail[k, d] = tail[k, d + 1] + s
            if s > 0.0 and top[k] < 0:
                top[k] = d
    for i in range(n):
        for k in range(n):
            r = i * n + k
            if dJ[r, 0] >= 0 and top[k] >= 0:
                multiply_into(out[i], J[r, 0], dJ[r, 0], vector[k], top[k], q, factor, table)
                for d in range(1, dJ[r, 0] + 1):
                    s = 0.0
                    for l in range(start[d], start[d + 1]):
                        s += abs(J[r, 0, l])
                    lost[i] += s * tail[k, q + 1 - d] * abs(factor)
    return out, lost * UP


BLOCK = 64
"""Generators transported side by side: one look at the table of products serves all of them."""
LINE = 8
"""Numbers in a line of the cache."""


@njit(**KERNEL)
def advance_generators(F, G, q, table):
    """F(xi) G(xi) truncated at degree q, and a box radius for what is dropped or rounded."""
    start = table.start
    count, n, Nq = G.shape
    H = np.zeros((count, n, Nq))
    lost = np.zeros(n)
    nF = np.zeros((n, n, q + 1))
    sF = np.zeros((n, n))
    gamma = 1.01 * (n * table.pairs + 4) * UNIT
    for r in range(n):
        for c in range(n):
            for d in range(q + 1):
                for k in range(start[d], start[d + 1]):
                    nF[r, c, d] += abs(F[r, c, k])
                sF[r, c] += nF[r, c, d]
    sizes = np.zeros((n, q + 1))
    before = np.zeros((n, Nq, BLOCK))
    after = np.zeros((n, Nq, BLOCK))
    size = np.zeros(BLOCK)
    for first in range(0, count, BLOCK):
        most = min(BLOCK, count - first)
        top = np.full(n, -1, np.int64)
        for c in range(n):
            for k0 in range(0, Nq, LINE):
                for g in range(most):
                    for k in range(k0, min(k0 + LINE, Nq)):
                        before[c, k, g] = G[first + g, c, k]
            for d in range(q + 1):
                size[:] = 0.0
                for k in range(start[d], start[d + 1]):
                    for g in range(BLOCK):
                        size[g] += abs(before[c, k, g])
                s = 0.0
                for g in range(most):
                    s += size[g]
                sizes[c, d] += s
                if s > 0.0:
                    top[c] = d
        after[:] = 0.0
        for r in range(n):
            for c in range(0, n, 2):
                d = min(c + 1, n - 1)
                both = 1.0 if d > c else 0.0
                _multiply_blocks(
                    after[r], F[r, c], before[c], F[r, d], before[d], both, max(top[c], top[d]), q,
                    table,
                )  # fmt: skip
            for k0 in range(0, Nq, LINE):
                for g in range(most):
                    for k in range(k0, min(k0 + LINE, Nq)):
                        H[first + g, r, k] = after[r, k, g]
    for r in range(n):
        for c in range(n):
            tail = 0.0
            for d in range(q, -1, -1):
                tail += sizes[c, d]
                if d > 0:
                    lost[r] += nF[r, c, q + 1 - d] * tail
            lost[r] += gamma * sF[r, c] * tail
    return H, lost * UP


@njit(**KERNEL)
def _multiply_blocks(out, a, first, b, second, both, top, q, table):
    """out += a first + both b second, truncated at degree q: polynomials (Nq, BLOCK) side by side, of degree ``top``.

    Two at once: what is added to is read and written half as often.
    """
    if top < 0:
        return
    for i in range(table.start[q + 1]):
        x = a[i]
        y = both * b[i]
        if x != 0.0 or y != 0.0:
            o = table.offset[i]
            for j in range(table.start[min(top, q - table.degree[i]) + 1]):
                k = table.product[o + j]
                for g in range(BLOCK):
                    out[k, g] += x * first[j, g] + y * second[j, g]


@njit(**KERNEL)
def reduce_generators(G, keep):
    """Merge generators into nearly parallel larger ones until ``keep`` are left, plus n axis generators.

    With b = c a + r: a zeta_a + b zeta_b lies in (1 + |c|) a zeta + r zeta_b for any c, exactly; r goes
    into a box. Columns of neighbouring steps become parallel as they age, so r is small, and no sign
    is lost. (Merging whole generators into boxes was 1.6 times wider after four
    seconds of a disturbed linear loop; a box in the frame of the loop's modes gained nothing.)
    """
    count, n, Nq = G.shape
    scale = np.zeros(n)
    for g in range(count):
        for i in range(n):
            for k in range(Nq):
                scale[i] += abs(G[g, i, k])
    v = np.zeros((count, n))
    length = np.zeros(count)
    for g in range(count):
        for i in range(n):
            v[g, i] = G[g, i, 0] / (scale[i] + TINY)
            length[g] += v[g, i] * v[g, i]
    cost = np.full(count, np.inf)
    partner = np.full(count, -1, np.int64)
    for b in range(count):
        for a in range(count):
            if a == b or length[a] < length[b] or (length[a] == length[b] and a > b) or length[a] == 0.0:
                continue
            dot = 0.0
            for i in range(n):
                dot += v[a, i] * v[b, i]
            c = dot / length[a]
            miss = 0.0
            for i in range(n):
                miss += abs(v[b, i] - c * v[a, i])
            if miss < cost[b]:
                cost[b] = miss
                partner[b] = a
    alive = np.ones(count, np.bool_)
    grow = np.ones(count)
    rest = np.zeros(n)
    left = count
    for b in ascending(cost):
        if left <= keep:
            break
        a = partner[b]
        if a >= 0 and not alive[a]:
            a = -1
        c = 0.0
        if a >= 0:
            dot = 0.0
            for i in range(n):
                dot += v[a, i] * v[b, i]
            c = dot / length[a]
        elif cost[b] < np.inf:
            continue
        for i in range(n):
            s = 0.0
            size = 0.0
            for k in range(Nq):
                x = G[b, i, k]
                if c != 0.0:
                    y = c * G[a, i, k]
                    size += abs(x) + 2.0 * abs(y)
                    x -= y
                s += abs(x)
            # b itself may have grown: its coefficient is then within grow[b].
            rest[i] += (s + 4.0 * UNIT * size) * UP * grow[b]
        if a >= 0:
            grow[a] = (grow[a] + abs(c) * grow[b]) * (1.0 + 4.0 * UNIT)
        alive[b] = False
        left -= 1
    out = np.zeros((left + n, n, Nq))
    row = n
    for g in range(count):
        if alive[g]:
            for i in range(n):
                for k in range(Nq):
                    out[row, i, k] = grow[g] * G[g, i, k]
                if grow[g] != 1.0:
                    for k in range(Nq):
                        rest[i] += 2.0 * UNIT * abs(out[row, i, k])
            row += 1
    for i in range(n):
        out[i, i, 0] = rest[i] * UP + TINY
    return out
