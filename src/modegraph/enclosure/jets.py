"""Taylor coefficients in time of every tape node, as polynomials in the set variables (numba).

Time is normalised, s in [0, 1] over the step. Everything here is plain round-to-nearest floats: the
result is a proposal, and ``remainder`` bounds what it misses.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from modegraph.enclosure.elementary import taylor_coefficients
from modegraph.enclosure.polynomial import KERNEL, compose_into, multiply_into
from modegraph.expression.ops import (
    ADD,
    ADDC,
    ATAN,
    CONST,
    COS,
    EXP,
    MUL,
    MULC,
    RECIP,
    RELU,
    SQR,
    STEP,
    SUB,
    VAR,
    WHERE,
)

PLAIN = 1.0
TOO_WIDE = 2.0
"""Marks of an elementary function (1/a, exp, log, atan): stored as a constant; to be stored so at the next
try, because its argument ranges too widely for a Taylor polynomial."""


@njit(**KERNEL)
def constant_radius(c, deg, start):
    """Sum of the absolute coefficients except the constant one."""
    r = 0.0
    for k in range(1, start[deg + 1]):
        r += abs(c[k])
    return r


@njit(**KERNEL)
def node_coefficient(q, j, program, space, dmax, w1, w2, series, table):
    """Set P[q, j] and its degree dg[q, j] from lower coefficients, truncated at degree dmax.

    kinks[q] = (alpha, beta): relu(a) is stored as alpha a + beta, step(a) as the constant alpha; an
    elementary function with alpha = PLAIN as the constant beta.
    """
    ops, const = program.ops, program.const
    P, dg, kinks = space.P, space.dg, space.kinks
    start = table.start
    op = ops[q, 0]
    a = ops[q, 1]
    b = ops[q, 2]
    c = P[q, j]
    size = c.size
    if op == VAR:
        return
    c[:] = 0.0
    if op == CONST:
        dg[q, j] = -1
        if j == 0 and const[q] != 0.0:
            c[0] = const[q]
            dg[q, 0] = 0
        return
    d = -1
    if op >= RECIP and op <= ATAN and kinks[q, 0] == PLAIN:
        dg[q, j] = -1
        if j == 0 and kinks[q, 1] != 0.0:
            c[0] = kinks[q, 1]
            dg[q, 0] = 0
        return
    if op in (ADD, SUB):
        da = min(dg[a, j], dmax)
        db = min(dg[b, j], dmax)
        d = max(da, db)
        for k in range(start[da + 1]):
            c[k] = P[a, j, k]
        if op == ADD:
            for k in range(start[db + 1]):
                c[k] += P[b, j, k]
        else:
            for k in range(start[db + 1]):
                c[k] -= P[b, j, k]
    elif op in (MULC, ADDC, WHERE, RELU):
        f = 1.0
        shift = 0.0
        if op == MULC:
            f = const[q]
        elif op == ADDC:
            shift = const[q]
        elif op == RELU:
            f = kinks[q, 0]
            shift = kinks[q, 1]
        elif not P[ops[q, 3], 0, 0] > 0.0:
            a = b
        d = min(dg[a, j], dmax)
        for k in range(start[d + 1]):
            c[k] = f * P[a, j, k]
        if f == 0.0:
            d = -1
        if j == 0 and shift != 0.0:
            c[0] += shift
            d = max(d, 0)
    elif op == STEP:
        if j == 0 and kinks[q, 0] != 0.0:
            c[0] = kinks[q, 0]
            d = 0
    elif op == MUL:
        for i in range(j + 1):
            da = dg[a, i]
            db = dg[b, j - i]
            if da >= 0 and db >= 0:
                multiply_into(c, P[a, i], da, P[b, j - i], db, dmax, 1.0, table)
                d = max(d, min(dmax, da + db))
    elif op == SQR:
        for i in range(j // 2 + 1):
            da = dg[a, i]
            db = dg[a, j - i]
            if da >= 0 and db >= 0:
                f = 1.0 if 2 * i == j else 2.0
                multiply_into(c, P[a, i], da, P[a, j - i], db, dmax, f, table)
                d = max(d, min(dmax, da + db))
    elif op == RECIP:
        if j == 0:
            da = min(dg[a, 0], dmax)
            c[0] = 1.0 / P[a, 0, 0]
            d = max(d, 0)
            right = 1
            while right < dmax + 1 and da > 0:
                right *= 2
                w1[:] = 0.0
                multiply_into(w1, c, d, P[a, 0], da, dmax, -1.0, table)
                w1[0] += 1.0
                for k in range(size):
                    w2[k] = c[k]
                dn = min(dmax, d + da)
                multiply_into(c, w2, d, w1, dn, dmax, 1.0, table)
                d = min(dmax, d + dn)
        else:
            w1[:] = 0.0
            dt = np.int64(-1)
            for i in range(1, j + 1):
                da = dg[a, i]
                db = dg[q, j - i]
                if da >= 0 and db >= 0:
                    multiply_into(w1, P[a, i], da, P[q, j - i], db, dmax, -1.0, table)
                    dt = max(dt, min(dmax, da + db))
            if dt >= 0:
                multiply_into(c, P[q, 0], dg[q, 0], w1, dt, dmax, 1.0, table)
                d = min(dmax, dt + dg[q, 0])
    elif j == 0:
        da = max(0, min(dg[a, 0], dmax))
        taylor_coefficients(op, P[a, 0, 0], dmax, series)
        for k in range(size):
            w2[k] = P[a, 0, k]
        w2[0] = 0.0
        d = compose_into(c, w2, da, series, dmax, w1, table)
    else:
        # f(a)' = g a' with g the partner: cos for sin, -sin for cos, exp itself, 1/a, 1/(1 + a^2).
        g = q if op == EXP else b
        sign = -1.0 if op == COS else 1.0
        for i in range(1, j + 1):
            da = dg[a, i]
            db = dg[g, j - i]
            if da >= 0 and db >= 0:
                f = sign * (i / j)
                multiply_into(c, P[a, i], da, P[g, j - i], db, dmax, f, table)
                d = max(d, min(dmax, da + db))
    dg[q, j] = d


@njit(**KERNEL)
def propose_kinks(ops, ranges, kinks):
    """Choose the stored form of relu and step nodes from the ranges [lo, hi] of their arguments."""
    for q in range(ops.shape[0]):
        op = ops[q, 0]
        lo = ranges[q, 0]
        hi = ranges[q, 1]
        if op >= RECIP and op <= ATAN:
            kinks[q, 0] = PLAIN if lo <= hi and kinks[q, 0] >= PLAIN else 0.0
        if op != RELU and op != STEP:
            continue
        if not (lo <= hi):
            # Not known yet: decided from the argument when it is first computed.
            kinks[q, 0] = math.nan
            continue
        if lo >= 0.0:
            kinks[q, 0] = 1.0
            kinks[q, 1] = 0.0
        elif hi <= 0.0:
            kinks[q, 0] = 0.0
            kinks[q, 1] = 0.0
        elif op == STEP:
            kinks[q, 0] = 0.5
            kinks[q, 1] = 0.0
        else:
            # The chord and the tangent parallel to it; their mean errs least.
            kinks[q, 0] = hi / (hi - lo)
            kinks[q, 1] = -0.5 * kinks[q, 0] * lo


@njit(**KERNEL)
def decide_kink(q, ops, space, start):
    """Where no range was known, take that of the argument at the start of the step."""
    if (ops[q, 0] == RELU or ops[q, 0] == STEP) and math.isnan(space.kinks[q, 0]):
        a = ops[q, 1]
        mid = space.P[a, 0, 0]
        r = constant_radius(space.P[a, 0], max(space.dg[a, 0], 0), start)
        space.ranges[q, 0] = mid - r
        space.ranges[q, 1] = mid + r
        propose_kinks(ops[q : q + 1], space.ranges[q : q + 1], space.kinks[q : q + 1])


@njit(**KERNEL)
def solve_in_time(program, space, states, h, cut, table):
    """Coefficients 0..K of every node; with ``states`` > 0 those of the solution of x' = f(x) too.

    P[variables[i], 0] holds the start; coefficient j + 1 of state i is h f_i,j / (j + 1), f_i being
    outputs[i]. With states = 0 the coefficients of all variables are given. Coefficient j is
    truncated at degree cut[j] (K+1,).
    """
    ops, outputs, variables = program.ops, program.outputs, program.variables
    P, dg = space.P, space.dg
    start = table.start
    K = cut.size - 1
    w1 = P[0, 0].copy()
    w2 = P[0, 0].copy()
    series = P[0, 0].copy()
    if series.size < start.size:
        series = start * 0.0
    propose_kinks(ops, space.ranges, space.kinks)
    for j in range(K + 1):
        for q in range(ops.shape[0]):
            if j == 0:
                decide_kink(q, ops, space, start)
            node_coefficient(q, j, program, space, cut[j], w1, w2, series, table)
        if j < K:
            for i in range(states):
                v = variables[i]
                o = outputs[i]
                d = min(dg[o, j], cut[j + 1])
                dg[v, j + 1] = d
                P[v, j + 1, :] = 0.0
                f = h / (j + 1)
                for k in range(start[d + 1]):
                    P[v, j + 1, k] = f * P[o, j, k]
