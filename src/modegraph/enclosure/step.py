"""One validated step of a flowpipe (numba): x(t) in p(xi) + sum_g G_g(xi) zeta_g, same xi throughout.

The proof of a step, in order: the defect of the Taylor polynomial p (``remainder``), the fundamental
matrix of the Jacobian on the tube p + ebox (``variational``), a growth bound for what is left, and
the bootstrap: the bound of e lies strictly inside ebox, so e never leaves ebox during the step.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from modegraph.enclosure.adjoint import tighten
from modegraph.enclosure.arguments import Jacobian
from modegraph.enclosure.disturbance import DROPPED, disturbance_bounds, disturbance_columns
from modegraph.enclosure.exponential import push_columns
from modegraph.enclosure.jets import solve_in_time
from modegraph.enclosure.polynomial import KERNEL
from modegraph.enclosure.quadratic import MAIN_GENERATORS, main_generators, quadratic_bound
from modegraph.enclosure.remainder import coefficient_norms, remainders, wants_another_try
from modegraph.enclosure.rounding import TINY, UNIT, UP
from modegraph.enclosure.variational import (
    advance_generators,
    chord_distance,
    exponential_majorant,
    fundamental_defect,
    fundamental_matrix,
    growth_bound,
    matrix_product,
    reduce_generators,
    spectral_radius,
)

DONE = 0
UNDEFINED = 1
JACOBIAN_UNDEFINED = 2
NO_GROWTH_BOUND = 3
NO_CONTRACTION = 4


@njit(**KERNEL)
def set_variable(space, v, coefficients, degree):
    """Coefficient 0 of variable node v; the others zero."""
    P, dg = space.P, space.dg
    top = -1
    P[v] = 0.0
    dg[v, :] = -1
    for k in range(coefficients.size):
        P[v, 0, k] = coefficients[k]
        if coefficients[k] != 0.0:
            top = max(top, degree[k])
    dg[v, 0] = top


@njit(**KERNEL)
def taylor_step(program, n, p, time_index, h, cut, space, table):
    """Taylor polynomial of the centre dynamics over the step and its integrated defect.

    Returns (defect (n,), time part of the defect (n,), first undefined node or -1).
    """
    ops, outputs, variables, start = program.ops, program.outputs, program.variables, table.start
    P, dg, _, R, _, ranges = space
    K = cut.size - 1
    for v in range(variables.size):
        set_variable(space, variables[v], p[v], table.degree)
    if time_index >= 0:
        P[variables[time_index], 1, 0] = h
        dg[variables[time_index], 1] = 0
    for q in range(ops.shape[0]):
        ranges[q, 0] = np.nan
        ranges[q, 1] = np.nan
    bad = -1
    A = local = R
    for _attempt in range(2):
        solve_in_time(program, space, n, h, cut, table)
        coefficient_norms(space, start)
        R[:] = 0.0
        bad, A, local = remainders(program, space, cut, table)
        if not wants_another_try(ops, space):
            break
    tighten(program, outputs, space, A, local)
    defect = np.zeros(n)
    in_time = np.zeros(n)
    for i in range(n):
        v = variables[i]
        o = outputs[i]
        s = 0.0
        for j in range(K):
            top = max(dg[o, j], dg[v, j + 1])
            for k in range(start[top + 1]):
                x = h * P[o, j, k]
                s += (abs(x - (j + 1) * P[v, j + 1, k]) + 4.0 * UNIT * abs(x)) / (j + 1)
        x = 0.0
        for k in range(start[dg[o, K] + 1]):
            x += abs(P[o, K, k])
        in_time[i] = h * x / (K + 1)
        defect[i] = (s + in_time[i] + h * R[o]) * UP + TINY
    return defect, in_time, bad


@njit(**KERNEL)
def truncate_inputs(source, variables, target, inputs, KQ, q, embed, start, lost):
    """Copy the variables of one program to another's ``inputs``, cut to degrees q and KQ; lost[v]: what is dropped.

    Monomial k of the source's table is monomial embed[k] of the target's; degrees are the same in both.
    """
    P, dg, norms = source.P, source.dg, source.norms
    Q, dq = target.P, target.dg
    n = norms.shape[2] - 1
    for v in range(variables.size):
        a = variables[v]
        b = inputs[v]
        Q[b] = 0.0
        s = 0.0
        for j in range(P.shape[1]):
            for d in range(n + 1):
                if j > KQ or d > q:
                    s += norms[a, j, d]
            if j <= KQ:
                top = min(dg[a, j], q)
                dq[b, j] = top
                for k in range(start[top + 1]):
                    Q[b, j, embed[k]] = P[a, j, k]
        lost[v] = s * UP


@njit(**KERNEL)
def split_output(Q, o, r, q, errors, start, jacobian, swing, hessian):
    """Split output o of the Jacobian's program: entry r of ``jacobian`` in the set variables, and how far it swings
    with each error variable, swing (n,), of which hessian (n,) is the constant coefficient with its sign. Returns the
    norm of what was dropped.
    """
    embed, owner, variables = errors
    J, dJ, nJ = jacobian.J[r], jacobian.dJ[r], jacobian.nJ[r]
    swing[:] = 0.0
    for v in range(swing.size):
        hessian[v] = Q[o, 0, variables[v]]
    dropped = 0.0
    for i in range(J.shape[0]):
        for k in range(owner.size):
            if owner[k] >= 0:
                swing[owner[k]] += abs(Q[o, i, k])
            elif owner[k] == DROPPED:
                dropped += abs(Q[o, i, k])
        dJ[i] = -1
        for d in range(q + 1):
            s = 0.0
            for k in range(start[d], start[d + 1]):
                J[i, k] = Q[o, i, embed[k]]
                if J[i, k] != 0.0:
                    dJ[i] = d
                s += abs(J[i, k])
            nJ[i, d] = s * UP
    for v in range(swing.size):
        swing[v] *= UP
    return dropped * UP


@njit(**KERNEL)
def flow_step(rates, slopes, initial, settings, guess, space, jspace, table, jtable, errors):
    """One step. Variables of both programs: states, then time, disturbance, unknowns, all in ``initial.p``.

    ``rates`` is the program of f, over the table of the set variables and in ``space``. ``slopes`` is that of the
    Jacobian, in ``jspace`` over ``jtable``, which has one more variable for the error of each state (``errors``).

    Returns (status, node, p_end (n, N), G_end, tube (n,), bend (n,), rest (n,), control (5,)) where
    tube bounds e over the whole step, bend the distance of p(s) from the chord p(0)..p(1), rest what
    neither Psi e(0) nor the disturbance's columns carry, and
    control = (time defect, other defect, spectral radius of h M, of h A0, share of e in what feeds e)
    for the step control.
    """
    P, norms, variables = space.P, space.norms, rates.variables
    Q, dq, RQ = jspace.P, jspace.dg, jspace.R
    joutputs, jvariables = slopes.outputs, slopes.variables
    p, G, radius, full_w, first_w, time_index = initial
    h, cut, jcut, q, KP, most = settings
    start = table.start
    K = cut.size - 1
    KJ = jcut.size - 1
    _, n, Nq = G.shape
    N = P.shape[2]
    nw = radius.size
    nothing_p = np.zeros((n, N))
    nothing = np.zeros(n)
    control = np.zeros(5)
    control[0] = np.inf
    defect, in_time, bad = taylor_step(rates, n, p, time_index, h, cut, space, table)
    for i in range(n):
        if not defect[i] < np.inf:
            return UNDEFINED, max(bad, 0), nothing_p, G, nothing, nothing, defect, control
    z = np.zeros(n)
    for row in range(G.shape[0]):
        for i in range(n):
            for k in range(Nq):
                z[i] += abs(G[row, i, k])
    for i in range(n):
        z[i] *= UP
    lost = np.zeros(variables.size)
    J = np.zeros((n * n, KJ + 1, Nq))
    dJ = np.zeros((n * n, KJ + 1), np.int64)
    nJ = np.zeros((n * n, KJ + 1, q + 1))
    jacobian = Jacobian(J, dJ, nJ)
    A0 = np.zeros((n, n))
    RJ = np.zeros(n * n)
    fixed = np.zeros(n * n)
    swing = np.zeros((n * n, n))
    hessian = np.zeros((n * n, n))
    hess = np.zeros((n, n, n))
    H_end = G
    dropped = nothing
    # Entry by entry: every expression with whole arrays takes a quarter of a second to compile.
    ybox = np.zeros(n)
    ebox = np.zeros(n)
    for i in range(n):
        ybox[i] = max(guess.rest[i], 3.0 * defect[i]) + TINY
        ebox[i] = max(guess.tube[i], guess.room * (z[i] + 2.0 * defect[i])) + TINY
    need = ebox
    g = nothing
    u = nothing
    X = A0
    W = A0
    F = np.zeros((n, n, Nq))
    columns = np.zeros((nw, 3, n, Nq))
    chords = np.zeros((0, 2, n, Nq))
    strays = np.zeros((n, n))
    tops = strays
    outside = nothing
    miss_b = nothing
    c_total = nothing
    rest = nothing
    accepted = False
    for _attempt in range(8):
        truncate_inputs(space, variables, jspace, jvariables, KJ, q, errors.embed, start, lost)
        for v in range(variables.size):
            RQ[jvariables[v]] = lost[v]
        for i in range(n):
            k = errors.variables[i]
            Q[jvariables[i], 0, k] = ebox[i]
            dq[jvariables[i], 0] = max(dq[jvariables[i], 0], jtable.degree[k])
        if full_w:
            for j in range(nw):
                RQ[jvariables[first_w + j]] = radius[j]
        jspace.ranges[:] = np.nan
        solve_in_time(slopes, jspace, np.int64(0), h, jcut, jtable)
        coefficient_norms(jspace, jtable.start)
        bad, A, local = remainders(slopes, jspace, jcut, jtable)
        tighten(slopes, joutputs[: n * (n + nw)], jspace, A, local)
        for o in joutputs:
            if not RQ[o] < np.inf:
                return JACOBIAN_UNDEFINED, bad, nothing_p, G, ebox, nothing, defect, control
        for r in range(n * n):
            o = joutputs[r]
            fixed[r] = RQ[o] + split_output(Q, o, r, q, errors, start, jacobian, swing[r], hessian[r])
            A0[r // n, r % n] = J[r, 0, 0]
        X = h * A0
        W, _ = exponential_majorant(X)
        control[3] = spectral_radius(X)
        F, sup, last, curve, tails = fundamental_matrix(jacobian, n, h, KP, q, table)
        B, miss_b = disturbance_bounds(Q, RQ, joutputs, n * n, n, radius, errors)
        columns, outside, u = disturbance_columns(jacobian, B, radius, h, q, table)
        if nw > 0:
            chords, strays, tops = push_columns(jacobian, n, h, q, table)
        H_end, dropped = advance_generators(F, G, q, table)
        for i in range(n):
            for k in range(n):
                for l in range(n):
                    hess[i, k, l] = hessian[i * n + k, l] / ebox[l]
        shrink = np.ones(n)
        main0, main1, other = main_generators(G, H_end, MAIN_GENERATORS)
        # Twice: once e is proved to stay within ``need``, the Jacobian swings only with that.
        for final in range(2):
            # f(p + e) - f(p) = int_0^1 J(p + l e) dl e: powers of l e count by half at most. The main
            # part of that, e' H e / 2 with a constant H, is bounded over the zonotope of e, and then
            # acts as a push from outside; in a row where that gains nothing it stays in the Jacobian.
            spread = np.zeros(n)
            for r in range(n):
                s = dropped[r] + other[r] + u[r] + ybox[r]
                for k in range(n):
                    s += curve[r, k] * z[k]
                spread[r] = s * UP
            push = quadratic_bound(hess, main0, main1, spread)
            for i in range(n):
                whole = 0.0
                for k in range(n):
                    for v in range(n):
                        whole += 0.5 * abs(hessian[i * n + k, v]) * shrink[v] * z[k]
                keep_push = push[i] < whole
                if not keep_push:
                    push[i] = 0.0
                for k in range(n):
                    r = i * n + k
                    s = 0.0
                    for v in range(n):
                        s += swing[r, v] * shrink[v]
                        if keep_push:
                            s -= abs(hessian[r, v]) * shrink[v] * (1.0 - 2.0 * (UP - 1.0))
                    RJ[r] = (fixed[r] + 0.5 * max(0.0, s)) * UP + 4.0 * UNIT * abs(A0[i, k])
            E = fundamental_defect(nJ, RJ, sup, tails, n, h, KP, q, table.pairs)
            D = np.zeros((n, n))
            M = np.zeros((n, n))
            for r in range(n):
                for c in range(n):
                    s = RJ[r * n + c]
                    for i in range(KJ + 1):
                        for d in range(q + 1):
                            if i > 0 or d > 0:
                                s += nJ[r * n + c, i, d]
                    D[r, c] = s * UP + 4.0 * UNIT * abs(A0[r, c])
                    if r == c:
                        M[r, c] = max(0.0, A0[r, c] + D[r, c]) * UP
                    else:
                        M[r, c] = (abs(A0[r, c]) + D[r, c]) * UP
            c_total = np.zeros(n)
            for r in range(n):
                s = defect[r] + h * miss_b[r] + h * push[r]
                for k in range(n):
                    # u follows J at s = 0; what moves later, or with e, acts on it from outside. |u(s)| <= s u:
                    # s and s^(i + 1) have the means 1/2 and 1/(i + 2).
                    moved = 0.5 * (RJ[r * n + k] + 4.0 * UNIT * abs(A0[r, k]))
                    for i in range(1, KJ + 1):
                        for d in range(q + 1):
                            moved += nJ[r * n + k, i, d] / (i + 2)
                    s += E[r, k] * z[k] + h * moved * u[k]
                c_total[r] = s * UP
            control[4] = 0.0
            for r in range(n):
                s = 0.0
                s += h * push[r]
                for k in range(n):
                    s += E[r, k] * z[k]
                control[4] = max(control[4], s / (s + defect[r] + u[r] + TINY))
            # With a disturbance c is large. What it brings then follows J at s = 0 as u does, and what that
            # misses is pushed again.
            reached = np.zeros((n, 1))
            again = c_total
            if nw > 0:
                reached = matrix_product(tops, c_total.reshape(n, 1)) * UP
                again = np.zeros(n)
                for r in range(n):
                    for k in range(n):
                        moved = RJ[r * n + k] + 4.0 * UNIT * abs(A0[r, k])
                        for i in range(1, KJ + 1):
                            for d in range(q + 1):
                                moved += nJ[r * n + k, i, d] / (i + 1)
                        again[r] += h * moved * reached[k, 0]
                again = again * UP + TINY
            W_again = matrix_product(W, again.reshape(n, 1))[:, 0] * UP
            WD = matrix_product(W, D) * UP
            control[2] = spectral_radius(h * WD)
            ok_plain, g_plain = growth_bound(h, M, again)
            ok_exp, g_exp = growth_bound(h, WD, W_again)
            if ok_plain and ok_exp:
                rest = g_plain
                for i in range(n):
                    rest[i] = min(g_plain[i], g_exp[i])
            elif ok_plain:
                rest = g_plain
            elif ok_exp:
                rest = g_exp
            else:
                return NO_GROWTH_BOUND, 0, nothing_p, G, ebox, nothing, defect, control
            g = (reached[:, 0] + rest) * UP
            need = np.zeros(n)
            inside = True
            for r in range(n):
                # Psi(s) e(0) is within ``curve`` of the chord between its ends.
                s = g[r] + u[r]
                end = 0.0
                for k in range(n):
                    s += curve[r, k] * z[k]
                    end += last[r, k] * z[k]
                need[r] = (max(z[r], end * UP) + s) * UP
                if not need[r] < ebox[r] or not g[r] < ybox[r]:
                    inside = False
            if final == 0:
                accepted = inside
                if not accepted:
                    break
                for v in range(n):
                    shrink[v] = min(1.0, need[v] / ebox[v] * UP)
                ybox = g
        if accepted:
            break
        for i in range(n):
            ebox[i] = max(ebox[i], 1.15 * need[i])
            ybox[i] = max(ybox[i], 1.3 * g[i])
    if not accepted:
        return NO_CONTRACTION, 0, nothing_p, G, ebox, nothing, defect, control
    # p(1): K + 1 terms summed, at most K roundings.
    p_end = np.zeros((n, N))
    bend = np.zeros(n)
    box = rest + matrix_product(strays, c_total.reshape(n, 1))[:, 0] * UP
    for i in range(n):
        v = variables[i]
        e = 0.0
        for k in range(N):
            s = 0.0
            for j in range(K, -1, -1):
                s += P[v, j, k]
                e += abs(P[v, j, k])
            p_end[i, k] = s
        rounding = 1.01 * (K + 1) * UNIT * e * UP
        box[i] += rounding
        s = rounding
        for j in range(2, K + 1):
            for d in range(norms.shape[2]):
                s += chord_distance(j) * norms[v, j, d]
        bend[i] = s * UP
    for i in range(n):
        box[i] = (box[i] + outside[i]) * UP
    old = H_end.shape[0]
    carried = chords.shape[0]
    fresh = 2 * carried + 3 * nw
    grown = np.zeros((old + n + fresh, n, Nq))
    for g_old in range(old):
        for i in range(n):
            for k in range(Nq):
                grown[g_old, i, k] = H_end[g_old, i, k]
    for i in range(n):
        grown[old + i, i, 0] = (box[i] + dropped[i]) * UP + TINY
    for i in range(carried):
        for side in range(2):
            row = old + n + 2 * i + side
            for r in range(n):
                for k in range(Nq):
                    grown[row, r, k] = c_total[i] * chords[i, side, r, k]
    for j in range(nw):
        for c in range(3):
            row = old + n + 2 * carried + 3 * j + c
            for r in range(n):
                for k in range(Nq):
                    grown[row, r, k] = columns[j, c, r, k]
    if grown.shape[0] > most:
        grown = reduce_generators(grown, most - 2 * n - fresh)
    time_error = 0.0
    other = 0.0
    for i in range(n):
        time_error = max(time_error, in_time[i])
        other = max(other, defect[i] - in_time[i])
    control[0] = time_error
    control[1] = other
    return DONE, 0, p_end, grown, need, bend, g, control
