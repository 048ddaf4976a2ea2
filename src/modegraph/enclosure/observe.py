"""Other functions of the state along a step: constraints, input energy, outputs (numba)."""

from __future__ import annotations

import numpy as np
from numba import njit

from modegraph.enclosure.adjoint import tighten
from modegraph.enclosure.jets import solve_in_time
from modegraph.enclosure.polynomial import SHORT
from modegraph.enclosure.ranges import piece_bound
from modegraph.enclosure.remainder import coefficient_norms, remainders, wants_another_try
from modegraph.enclosure.rounding import TINY, UNIT, UP
from modegraph.enclosure.step import truncate_inputs
from modegraph.enclosure.variational import chord_distance


@njit(**SHORT)
def observe_step(
    fP, fdg, fnorms, fvariables, ops, const, const_rad, outputs, variables, radius, h, KQ, cut, pairs,
    Q, dq, nQ, RQ, kinks, ranges, product, offset, start, degree,
):  # fmt: skip
    """Evaluate a tape along the step just taken, for inputs within ``radius`` of their polynomials.

    Returns, per output: its polynomial at s = 0 and at s = 1, its mean over the step (each (no, Nq)),
    and ``slack`` (no, 2): what the true value may exceed the larger of the two ends by at any s, and
    the radius around the mean of the true mean. Infinite where the output is undefined.
    """
    count = outputs.size
    q = cut[0]
    Nq = Q.shape[2]
    lost = np.zeros(variables.size)
    embed = np.zeros(Nq, np.int64)
    for k in range(Nq):
        embed[k] = k
    truncate_inputs(fP, fdg, fnorms, fvariables, Q, dq, variables, KQ, q, embed, start, lost)
    for v in range(variables.size):
        RQ[variables[v]] = (lost[v] + radius[v]) * UP
    for r in range(ranges.shape[0]):
        ranges[r, 0] = np.nan
        ranges[r, 1] = np.nan
    A = local = RQ
    for _attempt in range(2):
        solve_in_time(
            ops, const, kinks, ranges, outputs, variables, np.int64(0), Q, dq, h, KQ,
            cut, product, offset, start, degree,
        )  # fmt: skip
        coefficient_norms(Q, dq, nQ, start)
        _, A, local = remainders(
            ops, const, const_rad, kinks, ranges, Q, dq, nQ, RQ, KQ, cut, pairs, product, offset, start, degree
        )
        if not wants_another_try(ops, kinks, ranges):
            break
    tighten(ops, const, const_rad, kinks, outputs, Q, RQ, A, local)
    ends = np.zeros((3, count, Nq))
    slack = np.zeros((count, 2))
    for i in range(count):
        o = outputs[i]
        e = 0.0
        for k in range(Nq):
            last = 0.0
            mean = 0.0
            for j in range(KQ, -1, -1):
                x = Q[o, j, k]
                last += x
                mean += x / (j + 1)
                e += abs(x)
            ends[0, i, k] = Q[o, 0, k]
            ends[1, i, k] = last
            ends[2, i, k] = mean
        rounding = 1.01 * (KQ + 3) * UNIT * e
        bend = 0.0
        for j in range(2, KQ + 1):
            for d in range(nQ.shape[2]):
                bend += chord_distance(j) * nQ[o, j, d]
        slack[i, 0] = (bend + RQ[o] + rounding) * UP + TINY
        slack[i, 1] = (RQ[o] + rounding) * UP + TINY
        if not RQ[o] < np.inf:
            slack[i, 0] = np.inf
            slack[i, 1] = np.inf
    return ends, slack


@njit(**SHORT)
def observed_bounds(ends, slack, faces, kinds, linear, radius, middle, rounding):
    """Upper bounds over a piece (``piece_bound``) of the first ``faces`` outputs of ``observe_step``, and of the
    sizes of the outputs that follow after one more. What is no number has the bound infinity."""
    upper = np.zeros(faces)
    for i in range(faces):
        top = -np.inf
        for side in range(2):
            top = max(top, piece_bound(ends[side, i], 1.0, kinds, linear, radius, middle, rounding))
        top += slack[i, 0]
        # Ends are added and compared in floats: one rounding each.
        upper[i] = top + 4.0 * UNIT * abs(top) if top == top else np.inf
    sizes = np.zeros(ends.shape[1] - faces - 1)
    for i in range(sizes.size):
        o = faces + 1 + i
        for side in range(2):
            for sign in (1.0, -1.0):
                sizes[i] = max(sizes[i], piece_bound(ends[side, o], sign, kinds, linear, radius, middle, rounding))
        size = sizes[i] + slack[o, 0]
        sizes[i] = size if size == size else np.inf
    return upper, sizes


@njit(**SHORT)
def enclose_at(
    ops, const, const_rad, outputs, variables, p, radius, cut, pairs,
    Q, dq, nQ, RQ, kinks, ranges, product, offset, start, degree,
):  # fmt: skip
    """Evaluate a tape at one instant: inputs within ``radius`` of the polynomials p (nv, N).

    Returns the outputs' polynomials (no, N), their radii (no,) (inf: undefined) and the first
    undefined node or -1.
    """
    count = outputs.size
    for v in range(variables.size):
        b = variables[v]
        Q[b] = 0.0
        top = -1
        for k in range(p.shape[1]):
            Q[b, 0, k] = p[v, k]
            if p[v, k] != 0.0:
                top = max(top, degree[k])
        dq[b, 0] = top
        RQ[b] = radius[v]
    bad = -1
    for r in range(ranges.shape[0]):
        ranges[r, 0] = np.nan
        ranges[r, 1] = np.nan
    A = local = RQ
    for _attempt in range(2):
        solve_in_time(
            ops, const, kinks, ranges, outputs, variables, np.int64(0), Q, dq, 1.0, np.int64(0),
            cut, product, offset, start, degree,
        )  # fmt: skip
        coefficient_norms(Q, dq, nQ, start)
        bad, A, local = remainders(
            ops, const, const_rad, kinks, ranges, Q, dq, nQ, RQ, np.int64(0), cut, pairs, product, offset, start, degree
        )
        if not wants_another_try(ops, kinks, ranges):
            break
    tighten(ops, const, const_rad, kinks, outputs, Q, RQ, A, local)
    out = np.zeros((count, p.shape[1]))
    size = np.zeros(count)
    for i in range(count):
        for k in range(p.shape[1]):
            out[i, k] = Q[outputs[i], 0, k]
        size[i] = RQ[outputs[i]]
    return out, size, bad
