"""Ready-made trajectories from rest at a to rest at b."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from modegraph.errors import ModegraphError
from modegraph.model.reference import Floats
from modegraph.model.sets.base import vector
from modegraph.model.trajectory import Trajectory, positive, trajectory


def quintic(a: ArrayLike, b: ArrayLike, duration: float) -> Trajectory:
    """The quintic from a to b (m,): rest to rest, accelerations zero at both ends."""
    start, end = _ends(a, b, "quintic")
    length = positive(duration, "quintic: duration")

    def signal(t: Any) -> Any:
        s = t / length
        return _between(start, end, s**3 * (10.0 - 15.0 * s + 6.0 * s**2))

    return trajectory(signal, length)


def minimum_energy(a: ArrayLike, b: ArrayLike, duration: float) -> Trajectory:
    """The rest-to-rest cubic from a to b (m,), the minimum of the integral of |r''|^2."""
    start, end = _ends(a, b, "minimum_energy")
    length = positive(duration, "minimum_energy: duration")

    def signal(t: Any) -> Any:
        s = t / length
        return _between(start, end, s**2 * (3.0 - 2.0 * s))

    return trajectory(signal, length)


def minimum_time(a: ArrayLike, b: ArrayLike, *, speed: ArrayLike, acceleration: ArrayLike) -> Trajectory:
    """The fastest rest-to-rest motion on the straight line from a to b under limits per coordinate.

    A synchronised trapezoid of the speed along the line (a triangle when the speed limit is not
    reached). Ramps and duration are rounded up to doubles that add up exactly, so the limits hold
    and the signal is continuous at its breakpoints.

    Parameters
    ----------
    a, b : (m,) arrays, different
    speed, acceleration : scalar or (m,)
        Limits of |r_k'| and |r_k''|, > 0.
    """
    start, end = _ends(a, b, "minimum_time")
    way = [abs(Fraction(y) - Fraction(x)) for x, y in zip(start.tolist(), end.tolist(), strict=True)]
    if not any(way):
        raise ModegraphError("minimum_time: a and b are the same point, there is no motion; use setpoint(a)")
    speeds = _limit(speed, len(way), "speed")
    accelerations = _limit(acceleration, len(way), "acceleration")
    top = float(min(limit / part for limit, part in zip(speeds, way, strict=True) if part))
    steepest = float(min(limit / part for limit, part in zip(accelerations, way, strict=True) if part))
    if top * top < steepest:
        ramp, rest = top / steepest, 1.0 / top
    else:
        ramp = rest = math.sqrt(1.0 / steepest)
    quantum = 16.0 * math.ulp(ramp + rest)
    ramp, rest = (math.ceil(part / quantum) * quantum for part in (ramp, rest))
    while not all(
        part <= v * Fraction(rest) and part <= a * Fraction(rest) * Fraction(ramp)
        for part, v, a in zip(way, speeds, accelerations, strict=True)
    ):
        ramp, rest = ramp + quantum, rest + quantum
    if ramp >= rest:
        return trajectory(_triangle(start, end, ramp), 2.0 * ramp, breakpoints=(ramp,))
    return trajectory(_trapezoid(start, end, ramp, rest), ramp + rest, breakpoints=(ramp, rest))


def _trapezoid(start: Floats, end: Floats, ramp: float, rest: float) -> Callable[[Any], Any]:
    """Speed rises over [0, ramp], is 1 / rest on [ramp, rest] and falls over [rest, ramp + rest]."""

    def signal(t: Any) -> Any:
        left = ramp + rest - t
        rising = t**2 / ramp / rest / 2.0
        falling = 1.0 - left**2 / ramp / rest / 2.0
        cruising = (t - ramp / 2.0) / rest
        return _between(start, end, np.where(t < ramp, rising, np.where(t < rest, cruising, falling)))

    return signal


def _triangle(start: Floats, end: Floats, ramp: float) -> Callable[[Any], Any]:
    """Speed rises over [0, ramp] and falls over [ramp, 2 ramp]."""

    def signal(t: Any) -> Any:
        left = 2.0 * ramp - t
        rising = t**2 / ramp / ramp / 2.0
        falling = 1.0 - left**2 / ramp / ramp / 2.0
        return _between(start, end, np.where(t < ramp, rising, falling))

    return signal


def _between(start: Floats, end: Floats, s: Any) -> Any:
    """The point at fraction s of the way; exactly ``start`` at 0 and ``end`` at 1."""
    return start * (1.0 - s) + end * s


def _ends(a: ArrayLike, b: ArrayLike, what: str) -> tuple[Floats, Floats]:
    start, end = vector(a, f"{what}: a"), vector(b, f"{what}: b")
    if start.size != end.size:
        raise ModegraphError(f"{what}: a has {start.size} values but b has {end.size}; give the same number")
    return start, end


def _limit(value: ArrayLike, m: int, what: str) -> list[Fraction]:
    limits = vector(value, f"minimum_time: {what}")
    if limits.size not in (1, m):
        raise ModegraphError(f"minimum_time: {what} must be one number or {m}, got {limits.size}")
    if not (limits > 0).all():
        raise ModegraphError(f"minimum_time: {what} must be > 0 in every coordinate, got {limits.tolist()}")
    return [Fraction(limit) for limit in np.broadcast_to(limits, (m,)).tolist()]
