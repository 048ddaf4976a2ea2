"""Sublevel sets of a function: of any shape, in any number of parts."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from modegraph.errors import ModegraphError
from modegraph.model.sets import exact
from modegraph.model.sets.base import Floats, Set, frozen, vector
from modegraph.model.sets.level_function import LevelFunction
from modegraph.model.sets.level_search import all_inside, bounding_box, covering, lowest_point
from modegraph.model.sets.quadric import ellipsoids

if TYPE_CHECKING:
    from fractions import Fraction

    from modegraph.model.sets.ellipsoid import Ellipsoid

LARGEST_GUESS = 12
"""Up to this many coordinates are tried when fn itself must tell how many it reads."""


class Sublevel(Set):
    """{x : fn(x) <= level}; it need be neither convex nor connected.

    As a start set it must be bounded, provably: for a function that does not grow in every direction,
    intersect it with a box by an outer maximum,
    ``lambda x: np.maximum(V(x) - c, np.max(np.abs(x) - size))``.

    Parameters
    ----------
    fn : callable
        Plain NumPy; reads x (dim,), returns one number, in any unit. Points where it is undefined are
        not in the set.
    level : float
        In the unit of fn.
    dim : int, optional
        Number of coordinates. By default that of the first mode or `Target` the set is used with; before
        that, what fn reads where it reads coordinates one by one.

    Raises
    ------
    ModegraphError
        If fn is not a function of x or level not a finite number; on first use, if fn cannot be traced
        or is not one number.
    """

    _fields = ("fn", "level")

    def __init__(self, fn: Callable[..., Any], level: float, dim: int | None = None) -> None:
        if not callable(fn):
            raise ModegraphError(f"Sublevel: fn must be a function of x, got {type(fn).__name__}")
        size = vector(level, "Sublevel: level")
        if size.size != 1:
            raise ModegraphError(f"Sublevel: level must be one number, got {size.size}")
        if dim is not None and (isinstance(dim, bool) or not isinstance(dim, int) or dim < 1):
            raise ModegraphError(f"Sublevel: dim must be a positive number of coordinates, not {dim!r}")
        self.fn = fn
        self.level = float(size[0])
        self._dim = dim

    # -- dimension -------------------------------------------------------------------------------

    def settle(self, *dims: int) -> None:
        if self._dim is None:
            problem: ModegraphError | None = None
            for dim in dims:
                try:
                    self._known(dim)
                except ModegraphError as error:
                    problem = problem or error
                    continue
                self.__dict__["_dim"] = dim
                return
            assert problem is not None
            raise problem

    @property
    def dim(self) -> int:
        return self._guess if self._dim is None else self._dim

    @cached_property
    def _guess(self) -> int:
        """The number of coordinates that fn reads, if it reads the same ones of a longer vector."""
        for dim in range(1, LARGEST_GUESS):
            try:
                used, longer = (len(_read(LevelFunction(self.fn, self.level, k))) for k in (dim, dim + 1))
            except ModegraphError:
                continue
            if used == longer:
                return dim
            break
        raise ModegraphError(
            "Sublevel: how many coordinates the set has cannot be told from fn; write Sublevel(fn, level, dim=...)"
        )

    @cached_property
    def _functions(self) -> dict[int, LevelFunction]:
        return {}

    def _known(self, dim: int) -> LevelFunction:
        if dim not in self._functions:
            self._functions[dim] = LevelFunction(self.fn, self.level, dim)
        return self._functions[dim]

    @property
    def function(self) -> LevelFunction:
        """fn, traced."""
        return self._known(self.dim)

    # -- where it is -----------------------------------------------------------------------------

    @cached_property
    def _lowest(self) -> tuple[Floats, float]:
        point, value = lowest_point(self.function)
        self._require_faithful(point)
        return frozen(point), value

    def _require_faithful(self, around: Floats) -> None:
        """Call fn with plain numbers at some points: it must return what its trace gives."""
        from modegraph.expression.repeatable import Comparison, impure

        compare = Comparison([self.function.root], self.function.x)
        steps = np.random.default_rng(5).uniform(-0.1, 0.1, (3, len(around)))
        for point in around + steps * (1.0 + np.abs(around)):
            try:
                with np.errstate(all="ignore"):
                    called = np.asarray(self.fn(point.copy()), dtype=float).reshape(1)
            except (ArithmeticError, ValueError):
                continue
            if compare.first_wrong(point, called) is not None:
                place = ", ".join(f"{value:.6g}" for value in point)
                there = compare.values(point)[0][0]
                what = f"at x = ({place}) it is {called[0]:.9g}, but its trace gives {there:.9g}"
                raise impure("Sublevel, fn", what)

    @property
    def center(self) -> Floats:
        return self._lowest[0]

    @property
    def lowest(self) -> float:
        """The least value of fn found (floats): where margins are measured from."""
        return self._lowest[1]

    def is_empty(self) -> bool:
        """Whether no point with fn <= level was found (floats)."""
        return not self._contains(self.center)

    @cached_property
    def _box(self) -> tuple[Floats, Floats] | None:
        found = bounding_box(self.function)
        return None if found is None else (frozen(found[0]), frozen(found[1]))

    def is_bounded(self) -> bool:
        """Whether the set is proved to be bounded."""
        return self._box is not None

    def bounding_box(self) -> tuple[Floats, Floats]:
        """(lo, hi), each (dim,): doubles that enclose the set, proved.

        Raises
        ------
        ModegraphError
            If no bound is proved.
        """
        if self._box is None:
            raise ModegraphError(f"{self!r} is not proved to be bounded; {self.remedy}")
        return self._box

    remedy = (
        "if it is, intersect it with a box: Sublevel(lambda x: np.maximum(fn(x) - level, np.max(np.abs(x) - size)), 0)"
    )
    """What to do about a set that is not proved to be bounded."""

    @cached_property
    def ellipsoids(self) -> tuple[Ellipsoid, Ellipsoid] | None:
        """(inside, around) this set, proved and nearly equal, where it is an ellipsoid itself; else None."""
        return ellipsoids(self.function)

    def hull_within(self, lo: Floats, hi: Floats, most: int = 200) -> tuple[Floats, Floats] | None:
        """A box around what lies in the box [lo, hi], proved; None where nothing of the set does."""
        cells = covering(self.function, lo, hi, most, tight=2.0**-4)
        return None if cells is None else (cells[0].min(axis=0), cells[1].max(axis=0))

    def holds_box(self, lo: Floats, hi: Floats) -> bool:
        """Whether the box [lo, hi] is proved to lie in the set."""
        return all_inside(self.function, lo, hi)

    def support_at_most(self, direction: exact.Row, bound: Fraction) -> bool:
        """Whether direction'x <= bound is proved for every x of the set, from the box around it."""
        if self._box is None:
            return False
        lo, hi = (exact.fractions(side) for side in self._box)
        return exact.dot(direction, [b if a > 0 else c for a, b, c in zip(direction, hi, lo, strict=True)]) <= bound

    def is_lower_level_of(self, other: Sublevel) -> bool:
        """Whether both have the same function, as traced, and this one no higher level."""
        from modegraph.expression.scalar import Graph
        from modegraph.model.sets.level_function import trace

        if self.level > other.level:
            return False
        if self.fn is other.fn:
            return True
        graph = Graph()
        x = graph.variables([f"x[{k}]" for k in range(self.dim)])
        mine, dropped = trace(self.fn, graph, x), len(graph.dropped)
        return mine.same(trace(other.fn, graph, x)) and len(graph.dropped) == dropped

    def contains(self, x: ArrayLike) -> bool:
        """Whether fn(x) <= level for the point x, (dim,).

        Exact where fn is rational at x; where sines and the like decide within rounding, a yes is proved
        and False means "not proved".
        """
        point = np.atleast_1d(np.asarray(x, dtype=float))
        if self._dim is None and point.ndim == 1 and point.size:
            return bool(np.isfinite(point).all()) and self._known(point.size).holds(point)
        return super().contains(x)

    def _contains(self, x: Floats) -> bool:
        return self.function.holds(x)

    # -- points and pictures ---------------------------------------------------------------------

    def sample(self, n: int, seed: int | None = None) -> Floats:
        """n random points of the set, (n, dim); each one is verified by :meth:`contains`.

        Uniform over the set, as far as cells around it can be told from it; of an unbounded set, over
        its part near the point of least fn.
        """
        if self.is_empty():
            raise ModegraphError(f"{self!r}: no point with fn <= level was found, so there is none to sample")
        return super().sample(n, seed)

    def draw_within(self, n: int, rng: np.random.Generator, lo: Floats, hi: Floats) -> Floats:
        """Up to n points (k, dim) of the set in the box [lo, hi] (floats), k = 0 where none was found."""
        function = self.function
        cells = covering(function, lo, hi, most=400, tight=2.0**-5)
        if cells is None:
            return np.zeros((0, self.dim))
        below, above = cells
        span = np.where(hi > lo, hi - lo, 1.0)
        weight = np.prod(np.maximum((above - below) / span, 1e-9), axis=1)
        found = np.zeros((0, self.dim))
        for _ in range(20):
            chosen = rng.choice(len(below), 4 * n, p=weight / weight.sum())
            points = below[chosen] + rng.random((4 * n, self.dim)) * (above[chosen] - below[chosen])
            found = np.vstack([found, points[function.values(points) <= self.level]])
            if len(found) >= n:
                break
        return found[:n]

    def _draw(self, n: int, rng: np.random.Generator) -> Floats:
        lo, hi = self._box or (self.center - 1.0 - np.abs(self.center), self.center + 1.0 + np.abs(self.center))
        points = self.draw_within(n, rng, lo, hi)
        missing = np.tile(self.center, (n - len(points), 1))
        return np.vstack([points, missing])

    def outline(self, dims: tuple[int, int]) -> Floats:
        (a, b), (c, d) = (side[list(dims)] for side in self.bounding_box())
        return np.array([(a, b), (c, b), (c, d), (a, d)])

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sublevel) and self.fn is other.fn and self.level == other.level

    def __hash__(self) -> int:
        return hash((type(self).__name__, id(self.fn), self.level + 0.0))

    def __repr__(self) -> str:
        return f"Sublevel({getattr(self.fn, '__name__', None) or repr(self.fn)}, {self.level})"


def _read(function: LevelFunction) -> list[int]:
    """Numbers of the coordinates that fn depends on."""
    return [k for k, x in enumerate(function.x) if function.root.depends_on([x])]
