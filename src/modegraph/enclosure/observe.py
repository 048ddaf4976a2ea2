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
def observe_step(flown, flown_variables, program, radius, h, cut, space, table):
    """Evaluate a program along the step ``flown`` just taken, for inputs within ``radius`` of their polynomials.

    Returns, per output: its polynomial at s = 0 and at s = 1, its mean over the step (each (no, Nq)),
    and ``slack`` (no, 2): what the true value may exceed the larger of the two ends by at any s, and
    the radius around the mean of the true mean. Infinite where the output is undefined.
    """
    outputs, variables, start = program.outputs, program.variables, table.start
    Q, nQ, RQ, ranges = space.P, space.norms, space.R, space.ranges
    KQ = cut.size - 1
    count = outputs.size
    q = cut[0]
    Nq = Q.shape[2]
    lost = np.zeros(variables.size)
    embed = np.zeros(Nq, np.int64)
    for k in range(Nq):
        embed[k] = k
    truncate_inputs(flown, flown_variables, space, variables, KQ, q, embed, start, lost)
    for v in range(variables.size):
        RQ[variables[v]] = (lost[v] + radius[v]) * UP
    for r in range(ranges.shape[0]):
        ranges[r, 0] = np.nan
        ranges[r, 1] = np.nan
    A = local = RQ
    for _attempt in range(2):
        solve_in_time(program, space, np.int64(0), h, cut, table)
        coefficient_norms(space, start)
        _, A, local = remainders(program, space, cut, table)
        if not wants_another_try(program.ops, space):
            break
    tighten(program, outputs, space, A, local)
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
def enclose_at(program, p, radius, cut, space, table):
    """Evaluate a tape at one instant: inputs within ``radius`` of the polynomials p (nv, N).

    Returns the outputs' polynomials (no, N), their radii (no,) (inf: undefined) and the first
    undefined node or -1.
    """
    outputs, variables = program.outputs, program.variables
    Q, dq, RQ, ranges = space.P, space.dg, space.R, space.ranges
    start, degree = table.start, table.degree
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
        solve_in_time(program, space, np.int64(0), 1.0, cut, table)
        coefficient_norms(space, start)
        bad, A, local = remainders(program, space, cut, table)
        if not wants_another_try(program.ops, space):
            break
    tighten(program, outputs, space, A, local)
    out = np.zeros((count, p.shape[1]))
    size = np.zeros(count)
    for i in range(count):
        for k in range(p.shape[1]):
            out[i, k] = Q[outputs[i], 0, k]
        size[i] = RQ[outputs[i]]
    return out, size, bad
