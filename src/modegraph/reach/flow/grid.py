"""Instants that are met exactly: every step length is a double whose sum with the time is exact."""

from __future__ import annotations

import math

GRID = 2.0**-36
"""Instants between breakpoints are multiples of this (seconds)."""


def is_exact(t0: float, t1: float) -> bool:
    """Whether the double t1 - t0 is exactly the difference."""
    # A sum rounded once is zero only if it is.
    return math.fsum((t1, -t0, -(t1 - t0))) == 0.0


def next_instant(t: float, h: float, limit: float) -> float:
    """The end of a step of about h from t, never past ``limit``, with an exact length.

    ``limit`` is met exactly; the last two steps before it are made alike.
    """
    if limit - t <= 1.001 * h and is_exact(t, limit):
        return limit
    if limit - t < 2.0 * h:
        h = 0.5 * (limit - t)
    unit = min(GRID, 2.0 ** (math.frexp(h)[1] - 20))
    target = math.floor((t + h) / unit) * unit
    if not t < target < limit:
        target = t + h
    if t < target <= limit and is_exact(t, target):
        return target
    # Differences of doubles within a factor of two are exact (Sterbenz).
    target = min(t + h, 2.0 * t) if t > 0.0 else h
    return min(target, limit) if is_exact(t, min(target, limit)) else math.nextafter(t, math.inf)
