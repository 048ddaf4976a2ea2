"""Upper bounds of polynomials over boxes inside [-1, 1]^m, and balls in them, bisected only as far as asked (numba)."""

from __future__ import annotations

import numpy as np
from numba import njit

from modegraph.enclosure.polynomial import KERNEL, SHORT
from modegraph.enclosure.rounding import TINY, UNIT, UP

ODD, EVEN = 1, 2
"""Monomials of degree two and more that range over [-1, 1], and over [0, 1]."""


@njit(**SHORT)
def linear_bound(c, radius, middle):
    """sup of sum_v c[v] eta_v over eta in [-1, 1]^m, rounded up.

    Where ``radius`` is not empty, only eta with |middle + radius eta|_2 <= 1 in the first variables count.
    """
    size = 0.0
    for v in range(c.size):
        size += abs(c[v])
    box = size * (1.0 + 4.0 * c.size * UNIT)
    m = radius.size
    if m == 0:
        return box
    # Scaled before squaring: tiny coefficients must not underflow to a length of zero.
    top = 1e-300
    for v in range(m):
        top = max(top, abs(c[v] / radius[v]))
    square = 0.0
    ball = 0.0
    plain = 0.0
    for v in range(m):
        x = c[v] / radius[v]
        square += (x / top) ** 2
        ball -= x * middle[v]
        plain += abs(x)
    ball += np.sqrt(square) * top
    for v in range(m, c.size):
        ball += abs(c[v])
    ball += (plain + size) * (8.0 * (m + 4)) * UNIT + m * 1e-307
    return ball if ball < box else box


@njit(**SHORT)
def piece_bound(polynomial, sign, kinds, linear, radius, middle, rounding):
    """Upper bound of a polynomial (N,) times a sign over a piece; infinite where it is no number.

    kinds : (N,) ODD, EVEN, or 0 for the constant and what is linear
    linear : (m,) which monomial each variable is, -1: none
    rounding : of a sum of N terms, relative to their sizes
    """
    c = np.zeros(linear.size)
    for v in range(linear.size):
        if linear[v] >= 0:
            c[v] = sign * polynomial[linear[v]]
    total = sign * polynomial[0] + linear_bound(c, radius, middle)
    size = 0.0
    for k in range(polynomial.size):
        x = sign * polynomial[k]
        size += abs(x)
        if kinds[k] == ODD:
            total += abs(x)
        elif kinds[k] == EVEN and x > 0.0:
            total += x
    total += rounding * size + TINY
    return total if total == total else np.inf


@njit(**SHORT)
def piece_bounds(polynomials, kinds, linear, radius, middle, rounding):
    """Upper bounds (r,) of polynomials (r, N) over a piece."""
    out = np.zeros(polynomials.shape[0])
    for i in range(out.size):
        out[i] = piece_bound(polynomials[i], 1.0, kinds, linear, radius, middle, rounding)
    return out


@njit(**KERNEL)
def _cell_bound(c, exponents, top, lo, hi, low_power, high_power, gradient_lo, gradient_hi):
    """Upper bound of sum_k c[k] xi^alpha_k on a cell: natural powers, and the mean value form.

    Returns (bound, variable to split). All products of powers lie in [-1, 1].
    """
    count, m = exponents.shape
    for v in range(m):
        for e in range(1, top + 1):
            a = lo[v] ** e
            b = hi[v] ** e
            if e % 2 == 0 and lo[v] < 0.0 < hi[v]:
                low_power[v, e] = 0.0
                high_power[v, e] = max(a, b)
            else:
                low_power[v, e] = min(a, b)
                high_power[v, e] = max(a, b)
        gradient_lo[v] = 0.0
        gradient_hi[v] = 0.0
    natural = 0.0
    centre = 0.0
    size = 0.0
    for k in range(count):
        x = c[k]
        if x == 0.0:
            continue
        size += abs(x)
        low = 1.0
        high = 1.0
        middle = 1.0
        for v in range(m):
            e = exponents[k, v]
            if e > 0:
                p = low * low_power[v, e]
                q = low * high_power[v, e]
                r = high * low_power[v, e]
                s = high * high_power[v, e]
                low = min(min(p, q), min(r, s))
                high = max(max(p, q), max(r, s))
                middle *= (0.5 * (lo[v] + hi[v])) ** e
        natural += x * high if x > 0.0 else x * low
        centre += x * middle
        for u in range(m):
            if exponents[k, u] > 0:
                low = 1.0
                high = 1.0
                for v in range(m):
                    e = exponents[k, v] - (1 if v == u else 0)
                    if e > 0:
                        p = low * low_power[v, e]
                        q = low * high_power[v, e]
                        r = high * low_power[v, e]
                        s = high * high_power[v, e]
                        low = min(min(p, q), min(r, s))
                        high = max(max(p, q), max(r, s))
                y = x * exponents[k, u]
                gradient_lo[u] += y * low if y > 0.0 else y * high
                gradient_hi[u] += y * high if y > 0.0 else y * low
    mean = centre
    worst = 0
    most = -1.0
    for u in range(m):
        swing = max(abs(gradient_lo[u]), abs(gradient_hi[u])) * 0.5 * (hi[u] - lo[u])
        mean += swing
        if swing > most:
            most = swing
            worst = u
    # Powers, products and sums: at most count + top m + 8 roundings on a path, and m of them in mean,
    # where the gradient's terms are at most top times as large.
    slack = 1.01 * (count + 4 * top * m + 16) * UNIT * size * (1.0 + m * top)
    return min(natural, mean) + slack * UP + TINY, worst


@njit(**KERNEL)
def upper_bound(c, exponents, lo, hi, limit, cells):
    """An upper bound of the polynomial on the box [lo, hi], at most ``cells`` bisections.

    Stops as soon as the bound is at most ``limit``, or cannot become so.
    """
    m = exponents.shape[1]
    top = np.int64(0)
    for k in range(exponents.shape[0]):
        for v in range(m):
            top = max(top, exponents[k, v])
    low_power = np.ones((m, top + 1))
    high_power = np.ones((m, top + 1))
    g_lo = np.zeros(m)
    g_hi = np.zeros(m)
    L = np.zeros((cells + 2, m))
    H = np.zeros((cells + 2, m))
    bound = np.zeros(cells + 2)
    split = np.zeros(cells + 2, np.int64)
    # Entry by entry: assigning whole rows takes a second to compile.
    for v in range(m):
        L[0, v] = lo[v]
        H[0, v] = hi[v]
    bound[0], split[0] = _cell_bound(c, exponents, top, L[0], H[0], low_power, high_power, g_lo, g_hi)
    count = 1
    for _ in range(cells):
        worst = 0
        for i in range(1, count):
            if bound[i] > bound[worst]:
                worst = i
        if bound[worst] <= limit or m == 0:
            break
        for u in range(m):
            L[count, u] = L[worst, u]
            H[count, u] = H[worst, u]
        v = split[worst]
        middle = 0.5 * (L[worst, v] + H[worst, v])
        L[count, v] = middle
        H[worst, v] = middle
        bound[count], split[count] = _cell_bound(
            c, exponents, top, L[count], H[count], low_power, high_power, g_lo, g_hi
        )
        bound[worst], split[worst] = _cell_bound(
            c, exponents, top, L[worst], H[worst], low_power, high_power, g_lo, g_hi
        )
        count += 1
    best = bound[0]
    for i in range(1, count):
        best = max(best, bound[i])
    return best
