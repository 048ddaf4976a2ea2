"""What the stored Taylor coefficients miss: a rigorous remainder for every tape node (numba).

``remainders`` bounds sup |true node - stored polynomial| over the step s in [0, 1], all set variables
in [-1, 1], for inputs within given radii of their stored polynomials. It works with the norms of the
coefficients by degree and never forms an interval polynomial.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from modegraph.enclosure.arguments import Scratch
from modegraph.enclosure.elementary import taylor_coefficients, taylor_errors
from modegraph.enclosure.jets import PLAIN, TOO_WIDE
from modegraph.enclosure.polynomial import KERNEL, multiply_into
from modegraph.enclosure.rounding import LIBM, TINY, UNIT, UP
from modegraph.enclosure.variational import chord_distance
from modegraph.expression.ops import (
    ADD,
    ADDC,
    ATAN,
    CONST,
    COS,
    EXP,
    LOG,
    MUL,
    MULC,
    RECIP,
    RELU,
    SIN,
    SQR,
    STEP,
    SUB,
    VAR,
    WHERE,
)


@njit(**KERNEL)
def coefficient_norms(space, start):
    """norms[q, j, d] >= sum of |coefficients| of degree d of P[q, j]."""
    P, dg, norms = space.P, space.dg, space.norms
    norms[:] = 0.0
    for q in range(P.shape[0]):
        for j in range(P.shape[1]):
            for d in range(dg[q, j] + 1):
                s = 0.0
                for k in range(start[d], start[d + 1]):
                    s += abs(P[q, j, k])
                norms[q, j, d] = s * UP


@njit(**KERNEL)
def truncated_part(na, tb, ta, cut, in_time):
    """L1 norm of what a product drops: powers of time above K, degrees above cut.

    (Callers pass constants as np.int64: a literal would be compiled as a version of its own.)

    na (K+1, n+1) norms of a by degree; ta, tb (K+1, n+2) tail sums of a and b. With ``in_time`` it is
    the product a' b integrated over the step: weight i / (i + j).
    """
    n = na.shape[1] - 1
    K = cut.size - 1
    r = 0.0
    for i in range(K + 1):
        if ta[i, 0] == 0.0 or (in_time and i == 0):
            continue
        for j in range(K + 1):
            if tb[j, 0] == 0.0:
                continue
            w = i / (i + j) if in_time else 1.0
            if i + j > K:
                r += w * ta[i, 0] * tb[j, 0]
            else:
                for d in range(n + 1):
                    if na[i, d] != 0.0:
                        e = cut[i + j] + 1 - d
                        if e < 0:
                            e = 0
                        if e <= n:
                            r += w * na[i, d] * tb[j, e]
    return r * UP


@njit(**KERNEL)
def composition_error(op, x, u, dmax, pairs, scratch):
    """L1 error of the stored composition f(x + u(xi)) at the start of the step.

    u[d] are the norms of the argument by degree (u[0] is ignored). Uses the one-dimensional majorant
    U(y) = sum_d u[d] y^d: what truncation at dmax drops from u^k is U(1)^k minus the kept part.
    """
    series, size, error, power, next_power = scratch
    r = 0.0
    for d in range(1, u.size):
        r += u[d]
    r *= UP
    taylor_coefficients(op, x, dmax, series)
    lagrange = taylor_errors(op, x, r, dmax, series, size, error)
    power[:] = 0.0
    power[0] = 1.0
    rk = 1.0
    total = error[0]
    rounding = size[0]
    for k in range(1, dmax + 1):
        rk *= r
        next_power[:] = 0.0
        for d in range(dmax + 1):
            if power[d] != 0.0:
                for e in range(1, min(dmax - d, u.size - 1) + 1):
                    next_power[d + e] += power[d] * u[e]
        kept = 0.0
        for d in range(dmax + 1):
            power[d] = next_power[d]
            kept += next_power[d]
        dropped = rk - kept
        if dropped < 0.0:
            dropped = 0.0
        # Both terms carry fewer than MAX_ROUNDINGS roundings.
        dropped += rk * (UP - 1.0) * 2.0
        total += size[k] * dropped + error[k] * rk
        rounding += size[k] * rk
    horner = (dmax + 1) * (pairs + 3) * UNIT * 1.01
    return (total + horner * rounding + lagrange * rk * r) * UP + TINY


@njit(**KERNEL)
def remainders(program, space, cut, table):
    """Fill R[q] for every node that is not a variable; R of the variables is given.

    Also fills ranges[q] with the range of the argument of relu, step and where nodes. A node that
    is undefined somewhere gets R = inf. Returns the first such node, or -1, then for every node a bound A of
    its stored polynomial, and ``local``: what R would be for arguments equal to theirs (R itself for
    logarithms, arc tangents and kinks).
    """
    ops, const, const_rad, _, _ = program
    P, dg, norms, R, kinks, ranges = space
    K = cut.size - 1
    nodes = ops.shape[0]
    n = norms.shape[2] - 1
    bad = -1
    tails = np.zeros((nodes, K + 1, n + 2))
    A = np.zeros(nodes)
    local = np.zeros(nodes)
    work = np.zeros(P.shape[2])
    scratch = Scratch(np.zeros(n + 2), np.zeros(n + 2), np.zeros(n + 2), np.zeros(n + 2), np.zeros(n + 2))
    gamma = 1.01 * (table.pairs * (K + 1) + 8) * UNIT
    for q in range(nodes):
        total = 0.0
        for j in range(K + 1):
            for d in range(n, -1, -1):
                tails[q, j, d] = (tails[q, j, d + 1] + norms[q, j, d]) * (1.0 + 4.0 * UNIT)
            total += tails[q, j, 0]
        A[q] = total * UP
    for q in range(nodes):
        op = ops[q, 0]
        a = ops[q, 1]
        b = ops[q, 2]
        if op == VAR:
            local[q] = R[q]
            continue
        if op == CONST:
            R[q] = const_rad[q]
            local[q] = R[q]
            continue
        own = -1.0
        if op >= RECIP and op <= ATAN:
            rest = (A[a] - norms[a, 0, 0] * (1.0 - 2.0 * (UP - 1.0))) * UP + R[a] * UP
            rest += 4.0 * UNIT * (abs(P[a, 0, 0]) + rest)
            ranges[q, 0] = P[a, 0, 0] - rest
            ranges[q, 1] = P[a, 0, 0] + rest
            low, high = image(op, ranges[q, 0], ranges[q, 1])
            if kinks[q, 0] == PLAIN:
                R[q] = max(abs(high - kinks[q, 1]), abs(low - kinks[q, 1])) * UP + TINY
                local[q] = R[q]
                if not R[q] < np.inf:
                    R[q] = np.inf
                    if bad < 0:
                        bad = q
                continue
        if op in (ADD, SUB):
            own = 2.0 * UNIT * (A[a] + A[b])
            for j in range(K + 1):
                e = min(cut[j] + 1, n + 1)
                own += tails[a, j, e] + tails[b, j, e]
            R[q] = (R[a] + R[b] + own) * UP
        elif op in (MULC, ADDC):
            f = abs(const[q]) if op == MULC else 1.0
            r = 0.0
            for j in range(K + 1):
                r += tails[a, j, min(cut[j] + 1, n + 1)]
            spread = const_rad[q] * ((A[a] + R[a]) if op == MULC else 1.0)
            # One rounding a coefficient: of c a, or of a + c.
            rounded = f * A[a] if op == MULC else A[a] + abs(const[q])
            own = f * r + spread + 2.0 * UNIT * rounded
            R[q] = (f * R[a] + own) * UP + TINY
        elif op == MUL:
            own = truncated_part(norms[a], tails[b], tails[a], cut, np.int64(0)) + gamma * A[a] * A[b]
            R[q] = (A[a] * R[b] + R[a] * A[b] + R[a] * R[b] + own) * UP + TINY
        elif op == SQR:
            own = truncated_part(norms[a], tails[a], tails[a], cut, np.int64(0)) + gamma * A[a] * A[a]
            R[q] = (2.0 * A[a] * R[a] + R[a] * R[a] + own) * UP + TINY
        elif op == SIN:
            # E = stored - true obeys E_s' = E_c a' + d1, E_c' = -E_s a' + d2: a rotation, so
            # |E|_2 <= |E(0)|_2 + int |d|_2 <= |E(0)|_2 + D1 + D2.
            es = composition_error(op, P[a, 0, 0], norms[a, 0], cut[0], table.pairs, scratch)
            ec = composition_error(np.int64(COS), P[a, 0, 0], norms[a, 0], cut[0], table.pairs, scratch)
            speed = 0.0
            for j in range(1, K + 1):
                speed += j * tails[a, j, 0]
            d1 = truncated_part(norms[a], tails[b], tails[a], cut, np.int64(1)) + gamma * speed * A[b]
            d2 = truncated_part(norms[a], tails[q], tails[a], cut, np.int64(1)) + gamma * speed * A[q]
            own = math.sqrt(es * es + ec * ec) + d1 + d2
            R[q] = (own + R[a]) * UP + TINY
            R[b] = R[q]
            local[b] = own * UP + TINY
        elif op == COS:
            continue
        elif op == EXP:
            speed = 0.0
            travel = 0.0
            for j in range(1, K + 1):
                speed += j * tails[a, j, 0]
                travel += tails[a, j, 0]
            e0 = composition_error(op, P[a, 0, 0], norms[a, 0], cut[0], table.pairs, scratch)
            d1 = truncated_part(norms[a], tails[q], tails[a], cut, np.int64(1)) + gamma * speed * A[q]
            # E' = E a' + d: |E(s)| <= (|E(0)| + D) exp(a(s) - a(tau)).
            own = (e0 + d1) * math.exp(travel * UP) * UP
            top = P[a, 0, 0] + (A[a] - norms[a, 0, 0] * (1.0 - 2.0 * (UP - 1.0)))
            lip = math.exp(top + 4.0 * UNIT * (abs(top) + A[a])) * math.expm1(R[a] * UP)
            R[q] = (own + lip * (1.0 + 4.0 * LIBM)) * UP + TINY
        elif op in (LOG, ATAN):
            travel = 0.0
            speed = 0.0
            for j in range(1, K + 1):
                travel += tails[a, j, 0]
                speed += j * tails[a, j, 0]
            e0 = composition_error(op, P[a, 0, 0], norms[a, 0], cut[0], table.pairs, scratch)
            d1 = truncated_part(norms[a], tails[b], tails[a], cut, np.int64(1)) + gamma * speed * A[b]
            # E' = (stored g - g) a' + d with g = 1/a or 1/(1 + a^2), whose remainder is R[b].
            lip = R[a] if op == ATAN else R[a] * (A[b] + R[b])
            R[q] = (e0 + d1 + R[b] * travel + lip) * UP + TINY
            if op == LOG and not (P[a, 0, 0] > 0.0 and R[b] < np.inf):
                R[q] = np.inf
        elif op == RECIP:
            # rho = |a r - 1| formed explicitly; r - 1/alpha = (a r - 1 + r (alpha - a)) / alpha.
            rho = truncated_part(norms[a], tails[q], tails[a], cut, np.int64(0)) + gamma * A[a] * A[q]
            for j in range(K + 1):
                work[:] = 0.0
                for i in range(j + 1):
                    multiply_into(
                        work, P[a, i], dg[a, i], P[q, j - i], dg[q, j - i], cut[j], 1.0,
                        table,
                    )  # fmt: skip
                if j == 0:
                    work[0] -= 1.0
                s = 0.0
                for k in range(work.size):
                    s += abs(work[k])
                rho += s * UP
            miss = (rho + R[a] * A[q]) * UP
            # |a r - 1 + r (alpha - a)| <= miss < 1 proves alpha != 0 and |1/alpha| <= A_r/(1 - miss).
            if miss < 1.0 - 1e-9:
                R[q] = miss * A[q] / (1.0 - miss) * UP + TINY
                own = rho * UP * A[q] / (1.0 - rho * UP) * UP
            else:
                R[q] = np.inf
        else:
            t = a if op != WHERE else ops[q, 3]
            mid = P[t, 0, 0]
            lo, hi = range_of(P[t], norms[t], A[t], R[t])
            rest = max(hi - mid, mid - lo)
            ranges[q, 0] = lo
            ranges[q, 1] = hi
            if op == STEP:
                r = 0.0
                if not hi <= 0.0:
                    r = abs(1.0 - kinks[q, 0])
                if not lo >= 0.0:
                    r = max(r, abs(kinks[q, 0]))
                R[q] = r * UP if rest < np.inf else np.inf
            elif op == RELU:
                alpha = kinks[q, 0]
                beta = kinks[q, 1]
                # relu(x) - alpha x - beta is piecewise linear: extreme at lo, hi and the kink.
                gap = max(abs(max(lo, 0.0) - alpha * lo - beta), abs(max(hi, 0.0) - alpha * hi - beta))
                if lo < 0.0 and hi > 0.0:
                    gap = max(gap, abs(beta))
                if not (lo >= 0.0 and alpha == 1.0 and beta == 0.0):
                    gap += 8.0 * UNIT * (abs(lo) + abs(hi) + abs(beta)) * (1.0 + abs(alpha))
                r = 0.0
                for j in range(K + 1):
                    r += tails[a, j, min(cut[j] + 1, n + 1)]
                if alpha == 0.0 and beta == 0.0 and hi <= 0.0:
                    R[q] = 0.0
                else:
                    R[q] = (gap + abs(alpha) * (R[a] + r) + 4.0 * UNIT * (abs(alpha) * A[a] + abs(beta))) * UP + TINY
            else:  # WHERE
                branch = a if mid > 0.0 else b
                r = 0.0
                for j in range(K + 1):
                    r += tails[branch, j, min(cut[j] + 1, n + 1)]
                R[q] = (R[branch] + r) * UP if (lo > 0.0 or hi < 0.0) else np.inf
        local[q] = own * UP + TINY if own >= 0.0 else R[q]
        if op >= RECIP and op <= ATAN and high - low < np.inf and not R[q] < high - low:
            kinks[q, 0] = TOO_WIDE
            kinks[q, 1] = 0.5 * (low + high)
        if not (R[q] < np.inf and A[q] < np.inf):
            R[q] = np.inf
            if bad < 0:
                bad = q
    return bad, A, local


@njit(**KERNEL)
def range_of(c, norms, size, radius):
    """Bounds (lo, hi) of everything within ``radius`` of a stored polynomial c (K+1, N), at any s in [0, 1].

    ``norms`` (K+1, n+1) of c by degree, ``size`` their sum. The polynomial stays close to the chord of its
    ends, where the powers of time are summed with their signs; a set that moves or shrinks fills no more.
    """
    last = 0.0
    spread0 = 0.0
    spread1 = 0.0
    for k in range(c.shape[1]):
        s = 0.0
        for j in range(c.shape[0]):
            s += c[j, k]
        if k == 0:
            last = s
        else:
            spread0 += abs(c[0, k])
            spread1 += abs(s)
    bend = 0.0
    for j in range(2, c.shape[0]):
        for d in range(norms.shape[1]):
            bend += chord_distance(j) * norms[j, d]
    lo = min(c[0, 0] - spread0, last - spread1) - bend
    hi = max(c[0, 0] + spread0, last + spread1) + bend
    # Every sum above has at most as many roundings as UP allows for, of terms that add up to size.
    slack = radius * UP + 4.0 * (UP - 1.0) * size + 4.0 * UNIT * (abs(lo) + abs(hi)) + TINY
    rest = (size - norms[0, 0] * (1.0 - 2.0 * (UP - 1.0))) * UP + radius * UP
    rest += 4.0 * UNIT * (abs(c[0, 0]) + rest)
    return max(lo - slack, c[0, 0] - rest), min(hi + slack, c[0, 0] + rest)


@njit(**KERNEL)
def image(op, lo, hi):
    """Range of 1/a, exp a, log a or atan a for a in [lo, hi], rounded outward; infinite where undefined."""
    if not lo <= hi:
        return -np.inf, np.inf
    if op == RECIP:
        if not (lo > 0.0 or hi < 0.0):
            return -np.inf, np.inf
        low = 1.0 / hi
        high = 1.0 / lo
    elif op == EXP:
        low = math.exp(lo)
        high = math.exp(hi)
    elif op == LOG:
        if not lo > 0.0:
            return -np.inf, np.inf
        low = math.log(lo)
        high = math.log(hi)
    else:
        low = math.atan(lo)
        high = math.atan(hi)
    return low - 2.0 * LIBM * abs(low) - TINY, high + 2.0 * LIBM * abs(high) + TINY


@njit(**KERNEL)
def wants_another_try(ops, space):
    """Whether a kink is crossed, or a function ranges too widely: then its range is known now, and the
    stored polynomials can be chosen better."""
    kinks, ranges = space.kinks, space.ranges
    for q in range(ops.shape[0]):
        op = ops[q, 0]
        if (op in (RELU, STEP)) and ranges[q, 0] < 0.0 < ranges[q, 1]:
            return True
        if op >= RECIP and op <= ATAN and kinks[q, 0] == TOO_WIDE:
            return True
    return False
