"""Loops that the library cuts into parts and encloses again, and loops at kinks: recipes whose numbers a seed draws.

Wide unknowns are cut; a disturbance makes every part start again from a set around its end, and two or more of
them go on from one such set together. Funnels are looked for at kinks, and for unknowns that are known exactly.
Model functions take one state (n,) or many at once (n, k).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np

import modegraph as mg

Vector = np.ndarray
Range = tuple[float, float]
FAR = 9.0
"""Targets and limits this far away in p and v are no condition on them."""


@dataclass(frozen=True)
class Instance:
    """One mode and its targets; ``rooms`` {constraint: (x, u) -> room left} says in numbers what the mode limits."""

    name: str
    mode: mg.Mode
    targets: tuple[mg.Target, ...]
    horizon: float
    rooms: Mapping[str, Callable[[Any, Any], Any]] = field(default_factory=dict)


@dataclass(frozen=True)
class Spring:
    """p'' = -m p - friction p' - cubic p^3 - bend(p) + w0, and beside it s' = -rate(m) s + w1; m sums the unknowns.

    The rate is linear, from ``soft`` at the least m to ``stiff`` at the largest; ``draw`` of it is the input's.
    """

    unknowns: Mapping[str, Range]
    soft: float
    stiff: float
    push: tuple[float, float]
    draw: float = 0.02
    friction: float = 1.0
    cubic: float = 1.0
    bend: Callable[[Any], Any] | None = None

    @property
    def ends(self) -> Range:
        """Least and largest m."""
        return sum(lo for lo, _ in self.unknowns.values()), sum(hi for _, hi in self.unknowns.values())

    def rate(self, m: Any) -> Any:
        lo, hi = self.ends
        return self.soft + (self.stiff - self.soft) / (hi - lo) * (m - lo)

    def slope(self, x: Any, u: Any, w: Any, d: Any) -> Any:
        m = sum(d[name] for name in self.unknowns)
        force = m * x[0] + self.friction * x[1] + self.cubic * x[0] ** 3
        if self.bend is not None:
            force = force + self.bend(x[0])
        return np.array([x[1], w[0] - force, u[0] + w[1] - (self.rate(m) - self.draw) * x[2]])

    def mode(self, name: str, start: mg.Box, limit: float) -> mg.Mode:
        push = np.array(self.push)
        plant = mg.System(
            self.slope, states="p v s", inputs="u", disturbance=mg.Box(-push, push), unknowns=dict(self.unknowns)
        )
        return mg.Mode(
            name,
            plant,
            controller=lambda x: -self.draw * x[2:3],
            reference=mg.setpoint([0.0]),
            start=start,
            constraints=lambda x: {"swing": abs(x[0]) <= limit},
        )

    def late(self, s: float, t: float) -> float:
        """The largest s after t seconds: that of the slowest rate and the strongest push."""
        return max(self.linear(s, w, m, t) for w, m in product((-self.push[1], self.push[1]), self.ends))

    def linear(self, s: float, w: float, m: float, t: float) -> float:
        """s after t seconds, for constant w and m."""
        rate = self.rate(m)
        return float(w / rate + (s - w / rate) * math.exp(-rate * t))


def _draw(rng: np.random.Generator, lo: float, hi: float, digits: int = 2) -> float:
    return round(float(rng.uniform(lo, hi)), digits)


def _swinging(
    name: str, rng: np.random.Generator, spring: Spring, horizon: float, shares: Vector, wide: float = 0.1
) -> Instance:
    """The spring from around p = 1.5; targets s <= level for levels that the slowest pass after shares of the horizon.

    One more level is a little lower than the slowest gets within the horizon.
    """
    s = _draw(rng, 3.0, 5.0)
    p = _draw(rng, 1.4, 1.6)
    limit = 8.0
    levels = [spring.late(s, share * horizon) for share in shares]
    levels.append(spring.late(s, horizon) * float(rng.uniform(0.85, 0.97)))
    lo, hi = np.array([p - wide, -wide, s]), np.array([p + wide, wide, s])
    goals = [mg.Target(f"s <= {level:.4g}", mg.Box([-FAR, -FAR, -FAR], [FAR, FAR, level])) for level in levels]
    return Instance(
        name,
        spring.mode(name, mg.Box(lo, hi), limit),
        tuple(goals),
        horizon,
        {"swing": lambda x, u: limit - np.abs(x[0])},
    )


def slow_parts(seed: int) -> Instance:
    """A wide unknown that decides how slow s is: what the range loses at a new start is lost for good."""
    rng = np.random.default_rng([31, seed])
    lo = _draw(rng, 0.4, 0.6)
    spring = Spring(
        {"m": (lo, lo + _draw(rng, 3.8, 4.1))},
        soft=_draw(rng, 0.25, 0.35, 3),
        stiff=_draw(rng, 0.05, 0.1, 3),
        push=(0.05, 0.06),
    )
    return _swinging(f"slow parts {seed}", rng, spring, 25.0, rng.uniform(0.3, 0.9, 1))


def parts_together(seed: int) -> Instance:
    """Parts that reach the targets after they were enclosed together, each by a clock of its own."""
    rng = np.random.default_rng([32, seed])
    lo = _draw(rng, 0.4, 0.6)
    soft = _draw(rng, 0.27, 0.33, 3)
    spring = Spring(
        {"m": (lo, lo + 4.0)},
        soft=soft,
        stiff=soft * float(rng.uniform(0.75, 0.9)),
        push=(0.05, 0.05),
    )
    return _swinging(f"parts together {seed}", rng, spring, 12.0, rng.uniform(0.3, 0.5, 2))


def many_parts(seed: int) -> Instance:
    """Two unknowns, or a wide start: more than two parts go on together."""
    rng = np.random.default_rng([33, seed])
    wide = 0.2 if seed % 2 else 0.1
    lo = _draw(rng, 0.2, 0.4)
    each = {"a": (lo, lo + 4.0)} if seed % 2 else {"a": (lo, lo + 2.0), "b": (lo, lo + 2.0)}
    soft = _draw(rng, 0.25, 0.35, 3)
    spring = Spring(each, soft=soft, stiff=soft * float(rng.choice([0.5, 0.85])), push=(0.05, 0.05))
    return _swinging(f"many parts {seed}", rng, spring, 15.0, rng.uniform(0.35, 0.6, 2), wide)


def bent_parts(seed: int) -> Instance:
    """The same with a kink in the spring."""
    rng = np.random.default_rng([34, seed])
    c, at = _draw(rng, 0.2, 0.6), _draw(rng, 0.2, 0.6)
    bends: list[Callable[[Any], Any]] = [
        lambda p: c * np.maximum(p, 0.0),
        lambda p: c * np.clip(p, -at, at),
        lambda p: c * (np.abs(p - at) - at),
        lambda p: c * (np.abs(p) * p),
    ]
    lo = _draw(rng, 0.4, 0.7)
    spring = Spring(
        {"m": (lo, lo + _draw(rng, 2.0, 4.0))},
        soft=_draw(rng, 0.25, 0.35, 3),
        stiff=_draw(rng, 0.06, 0.2, 3),
        push=(0.05, 0.05),
        bend=bends[seed % len(bends)],
    )
    return _swinging(f"bent parts {seed}", rng, spring, 15.0, rng.uniform(0.3, 0.9, 1))


def _oscillator(
    name: str, slope: Callable[..., Any], start: mg.Box, goals: tuple[mg.Target, ...], horizon: float, **options: Any
) -> Instance:
    """p' = v, v' = slope, from ``start``."""
    limit = 4.0
    mode = mg.Mode(
        name,
        mg.System(slope, states="p v", inputs="u", **options),
        controller=lambda x: -0.1 * x[1:2],
        reference=mg.setpoint([0.0]),
        start=start,
        constraints=lambda u: {"input": abs(u[0]) <= limit},
    )
    return Instance(name, mode, goals, horizon, {"input": lambda x, u: limit - np.abs(u[0])})


def known_unknowns(seed: int) -> Instance:
    """Two or three unknowns of which one, in every place of the declaration in turn, has a range of one point."""
    rng = np.random.default_rng([35, seed])
    places = [(count, place) for count in (2, 3) for place in range(count)]
    count, place = places[seed % len(places)]
    known = _draw(rng, 0.4, 0.9)
    width = (0.9, 1.1) if count == 2 else (0.3, 0.4)
    ranges = [(lo, lo + _draw(rng, *width)) for lo in rng.uniform(0.8, 1.1, count).round(2).tolist()]
    ranges[place] = (known, known)
    names = list("abc"[:count])
    friction = _draw(rng, 0.32, 0.4)
    wide = _draw(rng, 0.3, 0.4)

    def slope(x: Any, u: Any, d: Any) -> Any:
        stiff = sum(d[name] for name in names)
        return np.array([x[1], u[0] - stiff * x[0] - friction * x[1] - x[0] ** 3])

    start = mg.Box([1.0 - wide, -wide], [1.0 + wide, wide])
    goals = (mg.Target("rest", mg.Ball([0.0, 0.0], 0.15)),)
    return _oscillator(
        f"known unknowns {seed}", slope, start, goals, 40.0, unknowns=dict(zip(names, ranges, strict=True))
    )


def settled_kinks(seed: int) -> Instance:
    """A settled loop with kinks at p = 0, from starts of one point, of a few ulps, or of a little more, in p."""
    rng = np.random.default_rng([36, seed])
    right = _draw(rng, 0.8, 1.2)
    left = right if seed % 2 else _draw(rng, 0.8, 1.2)
    friction = _draw(rng, 0.5, 0.8)
    p = _draw(rng, 0.4, 0.8)
    forces: list[Callable[[Any], Any]] = [
        lambda p: right * np.maximum(p, 0.0) - left * np.maximum(-p, 0.0),
        lambda p: right * np.clip(p, 0.0, FAR) + left * np.clip(p, -FAR, 0.0),
        lambda p: 0.5 * (right + left) * p + 0.5 * (right - left + 0.2) * np.abs(p),
    ]
    force = forces[seed % len(forces)]
    width = float(rng.choice([0.0, 0.0, 2.0**-52, 1e-12]))
    start = mg.Box([p, -0.2], [p + width, 0.2])
    slope = lambda x, u: np.array([x[1], u[0] - force(x[0]) - friction * x[1] - x[0] ** 3])
    size = float(rng.choice([0.08, 0.12]))
    goals = (
        mg.Target("rest", mg.Box([-size, -size], [size, size])),
        mg.Target("side", mg.Box([0.5 * size, -size], [2.0 * size, size])),
    )
    return _oscillator(f"settled kinks {seed}", slope, start, goals, 10.0)


FAMILIES = {
    make.__name__: make for make in (slow_parts, parts_together, many_parts, bent_parts, known_unknowns, settled_kinks)
}
