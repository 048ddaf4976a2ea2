"""Inequalities in the references of two modes, decided pair by pair (numba).

At instant k what the source reaches is y = rows m_k(p) - rows c(p') and a spread, per part of its starts.
The *table* (``arguments.Instants``) holds the instants of all parts: ``part_flows`` (P + 1,) first flow of each part;
``lo, hi`` (P, k) for which references a part has starts; per flow ``middle, scale`` (F, k) of its scaled parameters,
``flow_terms`` (F + 1,) first row of ``exponents`` (M, k), ``flow_instants`` (F + 1,), ``flow_coefficients`` (F + 1,)
first of ``coefficients``, stored instant by instant, row by row; ``farthest`` (F,) bounds |m| + spread; per instant
``size`` (T, f) of rounded terms and ``spread`` (T, f), or (T, 1) for a round target.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from modegraph.enclosure.polynomial import KERNEL
from modegraph.enclosure.rounding import TINY

ROUNDED = 1e-12
"""More than all roundings of one inequality, relative to the sizes of its terms (a few hundred units)."""


@njit(**KERNEL)
def _powers(p, b, flow, table, out):
    """Values of a flow's monomials of the scaled parameters (p - middle) / scale; returns how many."""
    middle, scale, flow_terms, exponents = table.middle, table.scale, table.flow_terms, table.exponents
    first = flow_terms[flow]
    count = flow_terms[flow + 1] - first
    for m in range(count):
        value = 1.0
        for v in range(p.shape[1]):
            for _ in range(exponents[first + m, v]):
                value *= (p[b, v] - middle[flow, v]) / scale[flow, v]
        out[m] = value
    return count


@njit(**KERNEL)
def _gauge(k, b, first, terms, powers, shift, fixed, limits, rows, table, enough):
    """Upper bound of the gauge of pair b at instant k; infinite where it is above ``enough``."""
    coefficients, size, spread, is_round = table.coefficients, table.size, table.spread, rows.is_round
    count = shift.size
    total = 0.0
    worst = -np.inf
    room = limits[b, 0]
    cap = enough - spread[k, 0] / room
    for f in range(count):
        y = -shift[f]
        for m in range(terms):
            y += coefficients[first + f * terms + m] * powers[m]
        error = fixed[f] + ROUNDED * size[k, f]
        if is_round:
            # In units of the limit: the square of a tiny length would be 0.
            total += ((abs(y) + error) / room) ** 2
            if total > cap * cap or cap < 0.0:
                return np.inf
            continue
        reach = y + error + spread[k, f]
        reach += ROUNDED * abs(reach)
        if limits[b, f] > 0.0:
            gauge = reach / limits[b, f]
        else:
            gauge = 0.0 if reach <= limits[b, f] else np.inf
        if not gauge <= enough:
            return np.inf
        worst = max(worst, gauge)
    if is_round:
        worst = (np.sqrt(total) * rows.grow * (1.0 + ROUNDED) + spread[k, 0] / room) * (1.0 + ROUNDED)
    return worst if worst <= enough else np.inf


@njit(**KERNEL)
def _shifts(b, rows, targets, shift, fixed):
    """rows c of pair b and what it may be off by; returns the largest |c|."""
    centre, radius = targets.centre, targets.radius
    largest = 0.0
    for v in range(centre.shape[1]):
        largest = max(largest, abs(centre[b, v]))
    for f in range(rows.shape[0]):
        total = 0.0
        size = 0.0
        off = 0.0
        for v in range(centre.shape[1]):
            total += rows[f, v] * centre[b, v]
            size += abs(rows[f, v] * centre[b, v])
            off += abs(rows[f, v]) * radius[b, v]
        shift[f] = total
        fixed[f] = off + ROUNDED * size + TINY
    return largest


@njit(**KERNEL)
def _within(p, b, lo, hi, row):
    inside = True
    for v in range(p.shape[1]):
        inside = inside and lo[row, v] <= p[b, v] <= hi[row, v]
    return inside


@njit(**KERNEL)
def affine_centres(p, c0, C, off, limit):
    """Centres c0 + C p (B, n), what they may be off by, and limits (B, f), for references p (B, k)."""
    B = p.shape[0]
    centre = np.empty((B, c0.size))
    radius = np.empty((B, c0.size))
    limits = np.empty((B, limit.size))
    for b in range(B):
        for i in range(c0.size):
            total = c0[i]
            size = abs(c0[i])
            for v in range(p.shape[1]):
                total += C[i, v] * p[b, v]
                size += abs(C[i, v] * p[b, v])
            centre[b, i] = total
            radius[b, i] = off[i] + ROUNDED * size
        limits[b] = limit
    return centre, radius, limits


@njit(**KERNEL)
def first_crossings(source, target, classes, targets, rows, table, quick):
    """For pairs (B,): the gauge of the worst part at its best instant, and the last of the first instants
    that prove a part (row of ``size``; -1 where some part has none).

    source (B, k), target (B, k'), each inside its class of ``classes``, lo and hi (1, k), or nothing is proved.
    With ``quick`` the gauge is only known to be at most 1 or not: parts behind the first failure and instants behind
    the first proof are not looked at.
    """
    part_flows, flow_instants = table.part_flows, table.flow_instants
    B = source.shape[0]
    gauge = np.full(B, np.inf)
    instant = np.full((B, part_flows.size - 1), -1)
    shift = np.empty(rows.rows.shape[0])
    base = np.empty(rows.rows.shape[0])
    fixed = np.empty(rows.rows.shape[0])
    powers = np.empty(table.exponents.shape[0] + 1)
    for b in range(B):
        if not (_within(source, b, *classes[0], 0) and _within(target, b, *classes[1], 0)):
            continue
        largest = _shifts(b, rows.rows, targets, shift, base)
        met = False
        worst = -np.inf
        for part in range(part_flows.size - 1):
            if not _within(source, b, table.lo, table.hi, part):
                instant[b, part] = -2
                continue
            met = True
            best = np.inf
            found = -1
            for flow in range(part_flows[part], part_flows[part + 1]):
                terms = _powers(source, b, flow, table, powers)
                for f in range(fixed.size):
                    fixed[f] = base[f] + (table.farthest[flow] + largest) * rows.slack[f]
                first = table.flow_coefficients[flow]
                for k in range(flow_instants[flow], flow_instants[flow + 1]):
                    enough = 1.0 if quick else max(1.0, best)
                    value = _gauge(k, b, first, terms, powers, shift, fixed, targets.limits, rows, table, enough)
                    first += terms * fixed.size
                    if value < best:
                        best = value
                    if value <= 1.0 and found < 0:
                        found = k
                        if quick:
                            break
                if quick and found >= 0:
                    break
            instant[b, part] = found
            worst = max(worst, best)
            if quick and found < 0:
                worst = np.inf
                break
        if met:
            gauge[b] = worst
    return gauge, instant


@njit(**KERNEL)
def part_gauges(part, source, targets, rows, table):
    """The gauges (B, K) of one part at all its instants."""
    part_flows, flow_instants = table.part_flows, table.flow_instants
    B = source.shape[0]
    begin = flow_instants[part_flows[part]]
    out = np.empty((B, flow_instants[part_flows[part + 1]] - begin))
    shift = np.empty(rows.rows.shape[0])
    base = np.empty(rows.rows.shape[0])
    fixed = np.empty(rows.rows.shape[0])
    powers = np.empty(table.exponents.shape[0] + 1)
    for b in range(B):
        largest = _shifts(b, rows.rows, targets, shift, base)
        for flow in range(part_flows[part], part_flows[part + 1]):
            terms = _powers(source, b, flow, table, powers)
            for f in range(fixed.size):
                fixed[f] = base[f] + (table.farthest[flow] + largest) * rows.slack[f]
            first = table.flow_coefficients[flow]
            for k in range(flow_instants[flow], flow_instants[flow + 1]):
                out[b, k - begin] = _gauge(
                    k, b, first, terms, powers, shift, fixed, targets.limits, rows, table, np.inf
                )
                first += terms * fixed.size
    return out
