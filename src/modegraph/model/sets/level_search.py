"""Where a sublevel set is: a point deep inside (floats), and boxes that provably hold all of it."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from modegraph.model.sets.base import Floats
from modegraph.model.sets.level_function import LevelFunction
from modegraph.model.sets.quadric import extent, quadratic

FARTHEST = 4.0**24
SAMPLES = 400
DESCENTS = 6
MOST_CELLS = 3000
FEW_UNBOUNDED = 6
"""With up to this many coordinates of unknown extent, all 3^k regions around a cube are told apart."""


# -- floats ----------------------------------------------------------------------------------------


def lowest_point(function: LevelFunction) -> tuple[Floats, float]:
    """The point (dim,) with the least fn found, and that value (inf: fn is defined nowhere it was tried)."""
    best, least = np.zeros(function.dim), np.inf
    for reach in (1e3, 1e6, 1e12):
        for x in _candidates(function, reach):
            value = float(function.values(x[None])[0])
            if value < least:
                best, least = x, value
        if least <= float(function.level):
            break
    return best, least


def _candidates(function: LevelFunction, reach: float) -> Iterator[Floats]:
    """Ends of descents from random points within ``reach``, as found and rounded to short decimals."""
    from scipy.optimize import minimize

    rng = np.random.default_rng(11)
    n = function.dim
    scale = 10.0 ** rng.uniform(-3.0, np.log10(reach), (SAMPLES, 1))
    points = np.vstack([np.zeros((1, n)), rng.uniform(-1.0, 1.0, (SAMPLES, n)) * scale, rng.normal(size=(SAMPLES, n))])
    values = function.values(points)
    order = np.argsort(values)[:DESCENTS]
    yield points[0]
    for start in points[order[np.isfinite(values[order])]]:

        def cost(x: Floats) -> float:
            return float(min(function.values(x[None])[0], 1e300))

        smooth = minimize(cost, start, method="L-BFGS-B", bounds=[(-reach, reach)] * n).x
        rough = minimize(cost, smooth, method="Nelder-Mead", options={"maxfev": 200 * n, "xatol": 1e-10}).x
        for x in (start, smooth, np.clip(rough, -reach, reach)):
            yield x
            for digits in (9, 6, 3, 1):
                yield np.round(x, digits) + 0.0


# -- proofs ----------------------------------------------------------------------------------------


def bounding_box(function: LevelFunction) -> tuple[Floats, Floats] | None:
    """A box that provably contains the set, or None where no bound is proved.

    Linear and convex quadratic parts give theirs exactly; coordinates that are left are bounded by a
    cube outside of which fn > level is proved, the unbounded rest of space included.
    """
    lo, hi = np.full(function.dim, -np.inf), np.full(function.dim, np.inf)
    for part in function.parts:
        bound = part.bound(function.level)
        polynomial = None if bound is None else quadratic(function, part.expr.index)
        if polynomial is None or bound is None:
            continue
        for k, (below, above) in extent(polynomial, bound).items():
            lo[k], hi[k] = max(lo[k], below), min(hi[k], above)
    if (lo > hi).any():
        # Empty; a caller finds no point in it either.
        lo, hi = np.minimum(lo, hi), np.minimum(lo, hi)
    unbounded = ~(np.isfinite(lo) & np.isfinite(hi))
    if unbounded.any():
        size = 4.0**-8
        while not _excluded_around(function, lo, hi, size):
            size *= 4.0
            if size > FARTHEST:
                return None
        lo, hi = np.maximum(lo, -size), np.minimum(hi, size)
    cells = covering(function, lo, hi)
    if cells is None:
        return lo, hi
    return cells[0].min(axis=0), cells[1].max(axis=0)


def _excluded_around(function: LevelFunction, lo: Floats, hi: Floats, size: float) -> bool:
    """Whether no point of the set in [lo, hi] is outside the cube [-size, size]^n."""
    if (lo > size).any() or (hi < -size).any():
        return False
    free = np.flatnonzero((lo < -size) | (hi > size))
    sides = []
    for k in free:
        outer = [(lo[k], -size)] if lo[k] < -size else []
        sides.append([*outer, (max(lo[k], -size), min(hi[k], size)), *([(size, hi[k])] if hi[k] > size else [])])
    cells: list[tuple[Floats, Floats]] = []
    if len(free) <= FEW_UNBOUNDED:
        for choice in itertools.product(*sides):
            if any(b <= -size or a >= size for a, b in choice):
                cells.append(_with(lo, hi, free, choice))
    else:
        for k, side in zip(free, sides, strict=True):
            cells += [_with(lo, hi, [k], [end]) for end in side if end[1] <= -size or end[0] >= size]
    below, above = np.array([c[0] for c in cells]), np.array([c[1] for c in cells])
    for _ in range(8):
        keep = ~function.outside(below, above)
        below, above = below[keep], above[keep]
        if not len(below):
            return True
        if len(below) > MOST_CELLS // 4:
            return False
        below, above = _halved(below, above, above - below)
    return False


def _with(lo: Floats, hi: Floats, axes: object, ends: object) -> tuple[Floats, Floats]:
    below, above = lo.copy(), hi.copy()
    for k, (a, b) in zip(axes, ends, strict=True):  # type: ignore[call-overload]
        below[k], above[k] = a, b
    return below, above


def _halved(below: Floats, above: Floats, width: Floats) -> tuple[Floats, Floats]:
    """Every cell cut in two along its largest finite ``width``; one without is kept."""
    width = np.where(np.isfinite(width), width, -1.0)
    axis = width.argmax(axis=1)
    rows = np.arange(len(below))
    a, b = below[rows, axis], above[rows, axis]
    cut = width[rows, axis] > 0.0
    middle = np.where(cut, 0.5 * np.where(cut, a, 0.0) + 0.5 * np.where(cut, b, 0.0), b)
    left, right = above.copy(), below.copy()
    left[rows, axis], right[rows, axis] = middle, middle
    return np.vstack([below, right[cut]]), np.vstack([left, above[cut]])


def covering(
    function: LevelFunction, lo: Floats, hi: Floats, most: int = MOST_CELLS, tight: float = 2.0**-7
) -> tuple[Floats, Floats] | None:
    """Cells (lower, upper), each (B, dim), that hold all of the set within the box [lo, hi].

    None where the box is proved to hold nothing of it. Cells that reach the sides of their common
    hull are cut until they are ``tight`` relative to it, or until ``most`` cells were examined.
    """
    below, above = np.array([lo]), np.array([hi])
    if function.outside(below, above)[0]:
        return None
    examined = 1
    while examined < most:
        bottom, top = below.min(axis=0), above.max(axis=0)
        span = np.where(top > bottom, top - bottom, 1.0)
        relative = (above - below) / span
        outer = (below <= bottom) | (above >= top)
        # A point of a smooth set that touches a side has cells as wide as the root of their height.
        coarse = ((outer & (relative > tight)).any(axis=1)) & (relative.max(axis=1) > tight)
        chosen = np.flatnonzero(coarse)
        if not len(chosen):
            break
        chosen = chosen[np.argsort(-relative[chosen].max(axis=1), kind="stable")][: max(1, (most - examined) // 2)]
        new_below, new_above = _halved(below[chosen], above[chosen], relative[chosen])
        examined += len(new_below)
        if len(new_below) == len(chosen):
            break
        keep = ~function.outside(new_below, new_above)
        rest = np.ones(len(below), bool)
        rest[chosen] = False
        below, above = np.vstack([below[rest], new_below[keep]]), np.vstack([above[rest], new_above[keep]])
        if not len(below):
            return None
    return below, above


def all_inside(function: LevelFunction, lo: Floats, hi: Floats, most: int = MOST_CELLS) -> bool:
    """Whether every point of the box [lo, hi] is proved to be in the set."""
    if (lo == hi).all():
        return function.holds(lo)
    return _everywhere(function.inside, lambda x: function.values(x) > float(function.level), lo, hi, most)


def all_outside(function: LevelFunction, lo: Floats, hi: Floats, most: int = 400) -> bool:
    """Whether no point of the box [lo, hi] is in the set, proved."""
    return _everywhere(function.outside, lambda x: function.values(x) <= float(function.level), lo, hi, most)


def _everywhere(
    proved: Callable[[Floats, Floats], NDArray[np.bool_]],
    refuted: Callable[[Floats], NDArray[np.bool_]],
    lo: Floats,
    hi: Floats,
    most: int,
) -> bool:
    """Whether something is proved on cells (lower, upper) that cover [lo, hi]; points that refute it end the search."""
    below, above = np.array([lo]), np.array([hi])
    examined = 0
    while len(below):
        examined += len(below)
        left = ~proved(below, above)
        below, above = below[left], above[left]
        if examined > most or refuted(0.5 * below + 0.5 * above).any():
            return False
        count = len(below)
        below, above = _halved(below, above, above - below)
        if len(below) < 2 * count:
            return False
    return True
