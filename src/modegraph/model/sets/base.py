"""What every set offers, and the checks their constructors share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from modegraph.attach import with_methods
from modegraph.errors import ModegraphError
from modegraph.model.immutable import Immutable
from modegraph.model.sets import exact

if TYPE_CHECKING:
    from modegraph import api

Floats = NDArray[np.float64]
Face = tuple[exact.Row, Fraction]


@with_methods
class Set(Immutable, ABC):
    """A closed set of states, inputs or disturbances, convex unless it is a Sublevel; its doubles are exact numbers.

    Sets are immutable: their arrays are read-only copies of what was given.
    """

    if TYPE_CHECKING:  # from upper layers
        plot = api.plot_set

    _fields: ClassVar[tuple[str, ...]]
    _parametrised: ClassVar[Callable[..., Any]]
    """ParametrisedSet: its file imports this one, and the folder's ``__init__`` imports both."""

    def __new__(cls, *args: Any, **kwargs: Any) -> Any:
        """Traced numbers (``start`` of a continuous class of references) make a ParametrisedSet instead."""
        from modegraph.expression.array import is_traced

        if is_traced([*args, *kwargs.values()]):
            return Set._parametrised(cls, args, kwargs)
        return super().__new__(cls)

    @property
    @abstractmethod
    def dim(self) -> int:
        """Number of coordinates."""

    @property
    @abstractmethod
    def center(self) -> Floats:
        """A central point, (dim,)."""

    @abstractmethod
    def bounding_box(self) -> tuple[Floats, Floats]:
        """(lo, hi), each (dim,): doubles that enclose the set, rounded outward."""

    @abstractmethod
    def support_at_most(self, direction: exact.Row, bound: Fraction) -> bool:
        """Whether direction'x <= bound for every x of the set, decided exactly."""

    @abstractmethod
    def _contains(self, x: Floats) -> bool:
        """Membership of a finite (dim,) point, decided exactly."""

    @abstractmethod
    def _draw(self, n: int, rng: np.random.Generator) -> Floats:
        """n points, (n, dim), in the set up to rounding."""

    @abstractmethod
    def outline(self, dims: tuple[int, int]) -> Floats:
        """Corners, (k, 2) in order, of the projection onto two coordinates, for drawing."""

    def settle(self, *dims: int) -> None:
        """Take the first of these dimensions that fits, if the set does not know its own (only a Sublevel may not)."""

    def is_empty(self) -> bool:
        """Whether the set has no point at all (only a Polytope or a Sublevel can be empty)."""
        return False

    def is_bounded(self) -> bool:
        """Whether the set is bounded (only a Polytope or a Sublevel can be unbounded)."""
        return True

    def faces(self) -> list[Face] | None:
        """Pairs (a, b): the set is {x : a'x <= b for all of them}, exactly; None without a short list."""
        return None

    def vertices(self) -> Iterator[exact.Row] | None:
        """Points whose convex hull is the set, exactly; None without a short list."""
        return None

    def contains(self, x: ArrayLike) -> bool:
        """Whether the point x, (dim,), lies in the set. Exact: no tolerance, no rounding.

        A point with a coordinate that is not finite lies in no set.
        """
        point = np.asarray(x, dtype=float)
        if point.ndim == 0 and self.dim == 1:
            point = point.reshape(1)
        if point.shape != (self.dim,):
            raise ModegraphError(
                f"{type(self).__name__}.contains: the point has shape {point.shape}, but the set lives "
                f"in {_count(self.dim)}; pass a vector of length {self.dim}"
            )
        return bool(np.isfinite(point).all()) and self._contains(point)

    def sample(self, n: int, seed: int | None = None) -> Floats:
        """n random points of the set, (n, dim); each one is verified by :meth:`contains`.

        A point that rounding put outside is moved towards the centre until it is inside.
        """
        points = self._draw(int(n), np.random.default_rng(seed))
        for row in points:
            self._pull_inside(row)
        return points

    def _pull_inside(self, row: Floats) -> None:
        center = self.center
        offset = row - center
        for exponent in range(52, -1, -1):
            if self._contains(row):
                return
            row[:] = center + offset * (1.0 - 2.0**-exponent)
        if not self._contains(row):
            raise ModegraphError(
                f"{self!r} is so thin that no point with double coordinates was found in it; "
                "give it some thickness, or use a Box with lo = hi in the thin coordinate"
            )

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and all(
            np.array_equal(getattr(self, name), getattr(other, name)) for name in self._fields
        )

    def __hash__(self) -> int:
        values = (np.asarray(getattr(self, name), dtype=float) + 0.0 for name in self._fields)
        return hash((type(self).__name__, *((value.shape, value.tobytes()) for value in values)))

    def __repr__(self) -> str:
        parts = (np.asarray(getattr(self, name)).tolist() for name in self._fields)
        return f"{type(self).__name__}({', '.join(map(str, parts))})"


def frozen(values: Floats) -> Floats:
    """A read-only copy."""
    copy = np.array(values, dtype=float)
    copy.flags.writeable = False
    return copy


def vector(value: ArrayLike, what: str) -> Floats:
    """A finite vector as a read-only array; a scalar is a vector of length one. ``what`` opens the error."""
    array = _floats(value, what)
    if array.ndim == 0:
        array = array.reshape(1)
    if array.ndim != 1 or array.size == 0:
        raise ModegraphError(f"{what} must be a non-empty vector, got an array of shape {array.shape}")
    _require_finite(array, what)
    return frozen(array)


def table(value: ArrayLike, what: str) -> Floats:
    """A finite two-dimensional array, read-only; a scalar is a 1 x 1 matrix."""
    array = _floats(value, what)
    if array.ndim == 0:
        array = array.reshape(1, 1)
    if array.ndim != 2:
        raise ModegraphError(f"{what} must be a matrix, got an array of shape {array.shape}")
    _require_finite(array, what)
    return frozen(array)


def _floats(value: ArrayLike, what: str) -> Floats:
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "biufO":
            raise TypeError
        return np.asarray(array, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise ModegraphError(f"{what} must be real numbers, got {_short(value)}") from None


def _require_finite(array: Floats, what: str) -> None:
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        where = ", ".join(str(int(k)) for k in bad[0])
        raise ModegraphError(
            f"{what}[{where}] is {array[tuple(bad[0])]}; every number must be finite"
            " (for a set without a bound in some coordinate use Polytope(A, b))"
        )


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _count(n: int) -> str:
    return f"{n} dimension" + ("" if n == 1 else "s")
