"""Taylor coefficients of the elementary functions at a point, with their errors (numba kernels).

``taylor_coefficients`` proposes the floats; ``taylor_errors`` bounds what they miss:
|series[k] - f^(k)(x)/k!| <= error[k] and |f^(d+1)|/(d+1)! <= lagrange on [x - r, x + r].
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from modegraph.enclosure.polynomial import KERNEL
from modegraph.enclosure.rounding import LIBM, UNIT, UP
from modegraph.expression.ops import ATAN, COS, EXP, LOG, SIN


@njit(**KERNEL)
def taylor_coefficients(op, x, dmax, series):
    """series[k] ~ f^(k)(x)/k! for k = 0..dmax."""
    if op in (SIN, COS):
        sine = math.sin(x)
        cosine = math.cos(x)
        f = 1.0
        for k in range(dmax + 1):
            if k > 1:
                f /= k
            phase = (k + (0 if op == SIN else 1)) % 4
            if phase == 0:
                series[k] = f * sine
            elif phase == 1:
                series[k] = f * cosine
            elif phase == 2:
                series[k] = -f * sine
            else:
                series[k] = -f * cosine
    elif op == EXP:
        f = math.exp(x)
        for k in range(dmax + 1):
            if k > 1:
                f /= k
            series[k] = f
    elif op == LOG:
        if not x > 0.0:
            series[:] = np.nan
            return
        series[0] = math.log(x)
        f = 1.0
        for k in range(1, dmax + 1):
            f /= x
            series[k] = f / k if k % 2 == 1 else -f / k
    elif op == ATAN:
        # f^(k)/k! = (-1)^(k-1) sin(k phi) rho^-k / k with x + i = rho e^(i phi).
        series[0] = math.atan(x)
        rho = math.sqrt(1.0 + x * x)
        phi = math.atan2(1.0, x)
        f = 1.0
        for k in range(1, dmax + 1):
            f /= rho
            series[k] = math.sin(k * phi) * f / k if k % 2 == 1 else -math.sin(k * phi) * f / k


@njit(**KERNEL)
def taylor_errors(op, x, r, dmax, series, size, error):
    """Fill size[k] >= |series[k]| and error[k]; return the Lagrange factor (inf: r too large)."""
    if op in (SIN, COS):
        f = 1.0
        for k in range(dmax + 1):
            if k > 1:
                f /= k
            size[k] = abs(series[k])
            error[k] = f * (LIBM + (k + 2) * UNIT) * UP
        return f / (dmax + 1) * UP
    if op == EXP:
        f = 1.0
        for k in range(dmax + 1):
            if k > 1:
                f /= k
            size[k] = abs(series[k])
            error[k] = size[k] * 1.01 * (LIBM + (k + 2) * UNIT)
        return math.exp(x + r) * (1.0 + 8.0 * (abs(x) + r + 1.0) * UNIT) * f / (dmax + 1) * UP
    if op == LOG:
        low = (x - r) - 2.0 * UNIT * (abs(x) + r)
        for k in range(dmax + 1):
            size[k] = abs(series[k])
            error[k] = size[k] * 1.01 * (LIBM + (k + 2) * UNIT)
        if not low > 0.0:
            return np.inf
        f = 1.0
        for _ in range(dmax + 1):
            f /= low
        return f / (dmax + 1) * UP
    # ATAN
    rho = math.sqrt(1.0 + x * x)
    f = 1.0
    size[0] = abs(series[0])
    error[0] = size[0] * 1.01 * LIBM + UNIT * UNIT
    for k in range(1, dmax + 1):
        f /= rho
        size[k] = abs(series[k])
        # phi <= pi is off by LIBM phi, k phi by one rounding more, rho^-k by k (2 + 1) roundings.
        error[k] = f / k * (4.0 * k * (LIBM + UNIT) + LIBM + (4 * k + 4) * UNIT) * UP
    least = max(0.0, abs(x) - r)
    return (1.0 + least * least * (1.0 - 8.0 * UNIT)) ** (-0.5 * (dmax + 1)) / (dmax + 1) * UP
