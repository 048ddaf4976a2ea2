"""Bounds of what a tape's stored outputs miss, by adjoints over the whole tape (numba kernels).

Forward, the error of a node is passed on with absolute values; where the terms of a solve cancel, they
pile up. Here every output weighs the error each node adds by its own sensitivity to that node.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from modegraph.enclosure.jets import PLAIN
from modegraph.enclosure.polynomial import KERNEL
from modegraph.enclosure.rounding import TINY, UNIT, UP
from modegraph.expression.ops import ADD, ADDC, COS, EXP, MUL, MULC, RECIP, SIN, SQR, SUB, VAR

OUT = 8.0 * UNIT
"""Relative allowance for the roundings of one product and one sum of ends."""


@njit(**KERNEL)
def _add_product(low, high, k, a, b, c, d):
    """[low[k], high[k]] += [a, b] [c, d], rounded outward."""
    p = a * c
    q = a * d
    r = b * c
    s = b * d
    x = low[k] + min(min(p, q), min(r, s))
    y = high[k] + max(max(p, q), max(r, s))
    slack = OUT * (abs(p) + abs(q) + abs(r) + abs(s) + max(abs(x), abs(y))) + TINY
    low[k] = x - slack
    high[k] = y + slack


@njit(**KERNEL)
def tighten(program, outputs, space, A, local):
    """Replace R of the outputs by their adjoint bound where that is smaller.

    ``local[q]`` bounds what node q adds itself, for arguments that equal their stored polynomials; A[q]
    bounds the stored polynomial, R[q] its distance from the value for any arguments within their own R.

    Let the nodes take their stored values one after the other, in order; the later ones follow exactly.
    Each exchange changes one node by at most its ``local`` and leaves every node within R of its
    polynomial, so an output moves by at most ``local`` times the largest sensitivity over those ranges.
    Nodes without a derivative here are exchanged first, like inputs, by R.
    """
    ops, const, const_rad, _, _ = program
    P, R, kinks = space.P, space.R, space.kinks
    nodes = ops.shape[0]
    below = np.empty(nodes)
    above = np.empty(nodes)
    for q in range(nodes):
        middle = P[q, 0, 0]
        r = (max(0.0, A[q] - abs(middle) * (1.0 - 2.0 * (UP - 1.0))) + R[q]) * UP
        r += OUT * (abs(middle) + r)
        below[q] = middle - r
        above[q] = middle + r
    low = np.zeros(nodes)
    high = np.zeros(nodes)
    tight = np.empty(outputs.size)
    for i in range(outputs.size):
        o = outputs[i]
        tight[i] = R[o]
        if not R[o] < np.inf or ops[o, 0] <= VAR:
            continue
        low[: o + 1] = 0.0
        high[: o + 1] = 0.0
        low[o] = 1.0
        high[o] = 1.0
        total = 0.0
        for q in range(o, -1, -1):
            c = low[q]
            d = high[q]
            if c == 0.0 and d == 0.0:
                continue
            op = ops[q, 0]
            a = ops[q, 1]
            b = ops[q, 2]
            follows = op <= EXP and not (op >= RECIP and kinks[q, 0] == PLAIN)
            total += max(abs(c), abs(d)) * (local[q] if follows else R[q])
            if not follows or op <= VAR:
                continue
            if op in (ADD, SUB, ADDC):
                _add_product(low, high, a, c, d, 1.0, 1.0)
                if op != ADDC:
                    sign = 1.0 if op == ADD else -1.0
                    _add_product(low, high, b, c, d, sign, sign)
            elif op == MULC:
                r = const_rad[q] if const_rad[q] == 0.0 else const_rad[q] + OUT * (abs(const[q]) + const_rad[q])
                _add_product(low, high, a, c, d, const[q] - r, const[q] + r)
            elif op == MUL:
                _add_product(low, high, a, c, d, below[b], above[b])
                _add_product(low, high, b, c, d, below[a], above[a])
            elif op == SQR:
                _add_product(low, high, a, c, d, 2.0 * below[a], 2.0 * above[a])
            elif op == SIN:
                _add_product(low, high, a, c, d, max(-1.0, below[b]), min(1.0, above[b]))
            elif op == COS:
                _add_product(low, high, a, c, d, max(-1.0, -above[b]), min(1.0, -below[b]))
            elif op == EXP:
                _add_product(low, high, a, c, d, max(0.0, below[q]), above[q])
            else:
                x = below[q] * below[q]
                y = above[q] * above[q]
                least = min(x, y) * (1.0 - OUT) if below[q] > 0.0 or above[q] < 0.0 else 0.0
                _add_product(low, high, a, c, d, -max(x, y) * (1.0 + OUT), -least)
        total = total * UP + TINY
        if total < tight[i]:
            tight[i] = total
    for i in range(outputs.size):
        R[outputs[i]] = tight[i]
