"""Boxes: a lower and an upper bound for every coordinate."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from modegraph.errors import ModegraphError
from modegraph.model.sets import exact
from modegraph.model.sets.base import Face, Floats, Set, vector

_MOST_VERTICES = 4096


class Box(Set):
    """{x : lo <= x <= hi}, coordinate by coordinate; lo = hi is allowed.

    Parameters
    ----------
    lo, hi : (dim,) array or scalar
        Finite, lo <= hi.
    """

    _fields = ("lo", "hi")

    def __init__(self, lo: ArrayLike, hi: ArrayLike) -> None:
        self.lo = vector(lo, "Box: lo")
        self.hi = vector(hi, "Box: hi")
        if self.lo.shape != self.hi.shape:
            raise ModegraphError(
                f"Box: lo has {self.lo.size} coordinates but hi has {self.hi.size}; give one bound each"
            )
        inverted = np.flatnonzero(self.lo > self.hi)
        if inverted.size:
            k = int(inverted[0])
            raise ModegraphError(
                f"Box: coordinate {k} is inverted: lo = {self.lo[k]} is above hi = {self.hi[k]}; exchange them"
            )

    @property
    def dim(self) -> int:
        return self.lo.size

    @property
    def center(self) -> Floats:
        middle = [float((a + b) / 2) for a, b in zip(*self._rational(), strict=True)]
        return np.clip(np.array(middle), self.lo, self.hi)

    def bounding_box(self) -> tuple[Floats, Floats]:
        return self.lo, self.hi

    def faces(self) -> list[Face]:
        result: list[Face] = []
        unit = exact.identity(self.dim)
        for axis, lo, hi in zip(unit, *self._rational(), strict=True):
            result += [(axis, hi), ([-value for value in axis], -lo)]
        return result

    def vertices(self) -> Iterator[exact.Row] | None:
        sides = [(a,) if a == b else (a, b) for a, b in zip(*self._rational(), strict=True)]
        if 2 ** sum(len(side) > 1 for side in sides) > _MOST_VERTICES:
            return None
        return (list(corner) for corner in itertools.product(*sides))

    def support_at_most(self, direction: exact.Row, bound: Fraction) -> bool:
        lo, hi = self._rational()
        farthest = [b if a > 0 else c for a, b, c in zip(direction, hi, lo, strict=True)]
        return exact.dot(direction, farthest) <= bound

    def _rational(self) -> tuple[exact.Row, exact.Row]:
        return exact.fractions(self.lo), exact.fractions(self.hi)

    def _contains(self, x: Floats) -> bool:
        return bool(((self.lo <= x) & (x <= self.hi)).all())

    def _draw(self, n: int, rng: np.random.Generator) -> Floats:
        weight = rng.random((n, self.dim))
        return np.clip(self.lo * (1.0 - weight) + self.hi * weight, self.lo, self.hi)

    def outline(self, dims: tuple[int, int]) -> Floats:
        (a, b), (c, d) = self.lo[list(dims)], self.hi[list(dims)]
        return np.array([(a, b), (c, b), (c, d), (a, d)])
