"""Hundreds of runs of one loop at once: all corners of starts, unknowns and disturbance, and bang-bang between them.

What the library claims of a switch or a check, numbers included, is held against every one of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import modegraph as mg
from tests.soundness.loop import Reference, read

Vector = np.ndarray
HOLDS = 24
"""Pieces of constant disturbance in a run."""
MOST_CORNERS = 300
RANDOM = 200
LOOKS = 1500
"""Instants at which the runs are looked at."""


@dataclass(frozen=True)
class Crowd:
    """States x (times, n, k), inputs u (times, p, k), energy (times, k) at ``t``; x is right up to ``error`` (k,)."""

    t: Vector
    x: Vector
    u: Vector
    energy: Vector
    error: Vector


def crowd(mode: mg.Mode, until: float, rng: np.random.Generator) -> Crowd:
    """Runs of a mode with a Box of starts and one reference, without memory."""
    start, d, w = _choose(mode, rng)
    t = np.linspace(0.0, until, LOOKS)
    loose, tight = (_integrate(mode, start, d, w, t, rtol) for rtol in (1e-7, 1e-9))
    x, energy = tight[:, :-1], tight[:, -1]
    error = 2.0 * np.abs(loose - tight).max(axis=(0, 1)) + 1e-9
    u = np.stack([_input(mode, s, state) for s, state in zip(t, x, strict=True)])
    return Crowd(t, x, u, energy, error)


def _choose(mode: mg.Mode, rng: np.random.Generator) -> tuple[Vector, dict[str, Vector], Vector]:
    """Starts (n, k), unknowns {name: (k,)} and disturbances (HOLDS, q, k)."""
    start, box = mode.start, mode.system.disturbance
    assert isinstance(start, mg.Box)
    names, ranges = list(mode.system.unknowns), list(mode.system.unknowns.values())
    q = 0 if box is None else box.dim
    lo = np.array([*start.lo, *(r[0] for r in ranges), *([] if box is None else box.lo)])
    hi = np.array([*start.hi, *(r[1] for r in ranges), *([] if box is None else box.hi)])
    free = np.flatnonzero(lo < hi)
    corners = np.array(list(product((0.0, 1.0), repeat=len(free)))).T
    if corners.shape[1] > MOST_CORNERS:
        corners = corners[:, rng.choice(corners.shape[1], MOST_CORNERS, replace=False)]
    share = np.zeros((len(lo), corners.shape[1] + RANDOM))
    share[free] = np.hstack([corners, rng.uniform(0.0, 1.0, (len(free), RANDOM))])
    first = len(lo) - q
    # Of the unknowns the ends tell most.
    share[start.dim : first, corners.shape[1] :: 2] = np.round(share[start.dim : first, corners.shape[1] :: 2])
    value = np.clip(lo[:, None] + share * (hi - lo)[:, None], lo[:, None], hi[:, None])
    w = np.broadcast_to(value[first:], (HOLDS, q, value.shape[1])).copy()
    ends = rng.integers(0, 2, (HOLDS, q, RANDOM))
    w[:, :, -RANDOM:] = np.where(ends == 1, hi[first:, None], lo[first:, None])
    w[:, :, -RANDOM::4] = value[first:, -RANDOM::4]
    return value[: start.dim], dict(zip(names, value[start.dim : first], strict=True)), w


def _input(mode: mg.Mode, t: float, x: Vector) -> Vector:
    value = mode.reference.value(0.0, None)
    known = {"x": x, "t": t, "r": Reference.make(value)}
    u = np.atleast_2d(np.asarray(read(mode.controller, known), float))
    return np.broadcast_to(u, (u.shape[0], x.shape[1]))


def _integrate(mode: mg.Mode, x: Vector, d: Mapping[str, Vector], w: Vector, t: Vector, rtol: float) -> Vector:
    """States and energy (times, n + 1, k)."""
    runs = x.shape[1]
    y = np.vstack([x, np.zeros(runs)])
    out = np.empty((len(t), *y.shape))
    out[0] = y
    cuts = np.linspace(0.0, t[-1], HOLDS + 1)
    for push, (begin, end) in zip(w, pairwise(cuts), strict=True):

        def rate(s: float, flat: Vector, push: Vector = push) -> Vector:
            x = flat.reshape(-1, runs)[:-1]
            u = _input(mode, s, x)
            dx = np.asarray(read(mode.system.dynamics, {"x": x, "u": u, "w": push, "d": d}))
            return np.vstack([dx, (u**2).sum(axis=0)]).ravel()

        inside = np.flatnonzero((t > begin) & (t <= end))
        asked = np.unique(np.append(t[inside], end))
        found = solve_ivp(rate, (begin, end), y.ravel(), "DOP853", t_eval=asked, rtol=rtol, atol=1e-2 * rtol)
        assert found.success, found.message
        states = found.y.T.reshape(len(asked), *y.shape)
        out[inside] = states[np.searchsorted(asked, t[inside])]
        y = states[-1]
    return out


# -- what the runs contradict ----------------------------------------------------------------------


def contradicted(
    runs: Crowd,
    region: mg.Box | mg.Ball,
    verdict: mg.Verdict,
    figures: tuple[float | None, float | None],
    rooms: Mapping[str, Callable[[Any, Any], Any]],
) -> list[str]:
    """What of a certified switch into ``region``, its (energy, window) included, some run contradicts."""
    energy, window = figures
    assert verdict.time is not None
    earliest, latest = verdict.time
    gauge = _gauge(region, runs.x)
    # Between two looks the gauge falls below both by no more than it changes around them.
    change = np.abs(np.diff(gauge, axis=0))
    still = np.zeros_like(change[:1])
    jump = np.maximum(np.vstack([still, change]), np.vstack([change, still]))
    size = region.radius if isinstance(region, mg.Ball) else float(np.min(0.5 * (region.hi - region.lo)))
    blur = np.sqrt(runs.x.shape[1]) * runs.error / size
    until = int(np.searchsorted(runs.t, latest, side="right"))
    found = []
    least = gauge - jump - blur
    out = least[:until].min(axis=0) > 1.0
    if out.any():
        found.append(f"{out.sum()} runs are outside until {latest:.4g}: gauge {least[:until].min(axis=0).max():.4g}")
    # The best time of a part may be later than that of the switch.
    margin = 1.0 - float(least.min(axis=0).max())
    if verdict.margin is not None and margin < verdict.margin:
        found.append(f"the margin is {margin:.4g}, not {verdict.margin:.4g}")
    inside = gauge < 1.0 - blur
    soon = inside & (runs.t < earliest)[:, None]
    if soon.any():
        found.append(f"a run is inside at {runs.t[soon.any(axis=1).argmax()]:.5g}, before {earliest:.5g}")
    # Before the first look at which a run may be inside it has not switched.
    maybe = gauge <= 1.0 + jump + blur
    first = np.where(maybe.any(axis=0), maybe.argmax(axis=0), until)
    before = np.arange(len(runs.t))[:, None] < np.minimum(first, until)
    spent = np.where(before, runs.energy, 0.0).max()
    if energy is not None and spent > energy * (1.0 + 1e-6) + 1e-9:
        found.append(f"a run spends {spent:.6g}, more than {energy:.6g}")
    found += _short_of_room(runs, verdict, rooms, before)
    if window is not None and not found:
        found += _short_stay(runs, maybe, latest, window)
    return found


def checked(runs: Crowd, verdict: mg.Verdict, rooms: Mapping[str, Callable[[Any, Any], Any]]) -> list[str]:
    """What of a check some run contradicts, as far as it is proved."""
    until = np.inf if verdict.status is mg.Status.CERTIFIED else verdict.until or 0.0
    return _short_of_room(runs, verdict, rooms, np.broadcast_to((runs.t <= until)[:, None], runs.energy.shape))


def _gauge(region: mg.Box | mg.Ball, x: Vector) -> Vector:
    """(times, k): 1 on the boundary of the region, less inside."""
    if isinstance(region, mg.Ball):
        return np.linalg.norm(x - region.c[:, None], axis=1) / region.radius
    middle, half = 0.5 * (region.lo + region.hi), 0.5 * (region.hi - region.lo)
    return (np.abs(x - middle[:, None]) / half[:, None]).max(axis=1)


def _short_of_room(runs: Crowd, verdict: mg.Verdict, rooms: Mapping[str, Any], when: Vector) -> list[str]:
    found = []
    for name, room in rooms.items():
        left = np.stack([room(x, u) for x, u in zip(runs.x, runs.u, strict=True)])
        least = np.where(when, left + runs.error, np.inf).min()
        claimed = max(0.0, verdict.slack.get(name, 0.0))
        if least < claimed:
            found.append(f"the room of {name} is {least:.6g}, not {claimed:.6g}")
    return found


def _short_stay(runs: Crowd, maybe: Vector, latest: float, window: float) -> list[str]:
    """Every run stays inside for the window from some instant up to ``latest`` on, as far as the runs go."""
    stay = np.zeros(maybe.shape[1])
    longest = stay.copy()
    step = runs.t[1]
    for t, inside in zip(runs.t[::-1], maybe[::-1], strict=True):
        # To the end of the runs nothing ends a stay.
        stay = np.where(inside, np.inf if t == runs.t[-1] else stay + step, 0.0)
        if t <= latest:
            longest = np.maximum(longest, stay)
    if np.any(longest + 2.0 * step < window):
        return [f"a run stays inside for {longest.min():.4g} s at most, not {window:.4g}"]
    return []
