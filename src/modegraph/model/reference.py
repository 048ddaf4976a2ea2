"""References a mode tracks: constants, classes of them, and what every reference can do."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from modegraph.errors import ModegraphError
from modegraph.model.immutable import Immutable
from modegraph.model.sets import Box, Set
from modegraph.model.sets.base import frozen, vector

if TYPE_CHECKING:
    from modegraph.expression.scalar import Expr, Graph

Floats = NDArray[np.float64]
Side = Literal["left", "right"]

MOST_PARAMETERS = 6
"""Of a continuous class: each is a variable of the flowpipe."""


@dataclass(frozen=True)
class Piece:
    """A traced reference between two breakpoints: value and exact time derivatives, (m,) each."""

    start: float
    end: float
    value: list[Expr]
    dot: list[Expr]
    ddot: list[Expr]


class ReferenceValue(np.ndarray[Any, Any]):
    """A reference at one instant: an (m,) float array with ``.dot``, ``.ddot`` (m,) and parameters ``.p``.

    Indexing with a slice keeps the derivatives of what is left; arithmetic gives plain arrays.
    """

    dot: Any
    ddot: Any
    p: Any

    def __new__(cls, value: ArrayLike, dot: ArrayLike, ddot: ArrayLike, p: ArrayLike | None) -> ReferenceValue:
        self = np.array(value, dtype=float).view(cls)
        self.dot = np.array(dot, dtype=float)
        self.ddot = np.array(ddot, dtype=float)
        self.p = None if p is None else np.array(p, dtype=float)
        return self

    def __getitem__(self, key: Any) -> Any:
        plain = self.view(np.ndarray)
        part = plain[key]
        if "ddot" not in self.__dict__ or not isinstance(part, np.ndarray):
            return part
        return ReferenceValue(part, self.dot[key], self.ddot[key], self.p)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **kwargs: Any) -> Any:
        plain = [v.view(np.ndarray) if isinstance(v, ReferenceValue) else v for v in inputs]
        return getattr(ufunc, method)(*plain, **kwargs)


class Reference(Immutable, ABC):
    """A class of references r(t; p), t seconds since the mode was entered: finite, or p in a box."""

    region: Box | None = None
    """The parameters of a continuous class; None where the class is finite."""
    duration: float
    """Seconds after which the value is held and the derivatives are zero."""
    breakpoints: tuple[float, ...]
    """Instants inside (0, duration) where the reference may have a kink or a jump."""

    @property
    @abstractmethod
    def dim(self) -> int:
        """Number m of values."""

    @property
    @abstractmethod
    def is_constant(self) -> bool:
        """Whether every reference of the class is a set-point."""

    @abstractmethod
    def parameters(self) -> list[Floats | None]:
        """The names of the references of a finite class: one parameter vector each; None for the only one."""

    @abstractmethod
    def pieces(self, graph: Graph, time: Expr, p: Floats | list[Expr] | None, owner: str) -> list[Piece]:
        """Trace the reference named p, or all of a continuous class: p then lists traced parameters.

        The last piece ends at ``inf``.
        """

    @abstractmethod
    def at(self, t: float, p: ArrayLike | None = None, side: Side = "right") -> ReferenceValue:
        """The reference named p at time t, with derivatives; at a jump, the limit from ``side``."""

    def value(self, t: float, p: ArrayLike | None = None) -> Floats:
        """The value (m,) at time t, from the right at a jump, held after the duration."""
        return np.array(self.at(t, p))

    def find(self, p: object = None) -> Floats | None:
        """The parameters of one reference as a user names it; None for the only one of its class.

        Raises
        ------
        ModegraphError
            If there is no such reference; the message says what exists.
        """
        if self.region is None:
            return self.parameters()[self.match(p)]
        size = self.region.dim
        within = f"{text_of(self.region.lo)} to {text_of(self.region.hi)}"
        if p is None or (isinstance(p, Sequence | np.ndarray) and np.size(p) == 0):
            raise ModegraphError(f"the references are a continuous class, {within}; name one of them")
        try:
            wanted = np.atleast_1d(np.asarray(p, dtype=float))
        except (TypeError, ValueError):
            raise ModegraphError(f"{p!r} names no reference; the class is {within}") from None
        if wanted.shape != (size,):
            numbers = "1 number" if size == 1 else f"{size} numbers"
            raise ModegraphError(f"{p!r} names no reference; give {numbers} within {within}")
        if not self.region.contains(wanted):
            raise ModegraphError(f"{text_of(wanted)} names no reference; the class is {within}")
        return frozen(wanted)

    def match(self, p: object = None) -> int:
        """Index in :meth:`parameters` of a reference of a finite class as a user names it.

        None or () names the only reference of a singleton class.

        Raises
        ------
        ModegraphError
            If there is no such reference; the message lists those that exist.
        """
        known = self.parameters()
        if p is None or (isinstance(p, Sequence | np.ndarray) and np.size(p) == 0):
            if len(known) == 1:
                return 0
            raise ModegraphError(f"there are {len(known)} references; name one of them: {_listing(known)}")
        try:
            wanted = np.atleast_1d(np.asarray(p, dtype=float))
        except (TypeError, ValueError):
            raise ModegraphError(f"{p!r} names no reference; there is: {_listing(known)}") from None
        for k, own in enumerate(known):
            if own is not None and np.array_equal(own, wanted):
                return k
        raise ModegraphError(f"{text_of(wanted)} names no reference; there is: {_listing(known)}")


class Points(Immutable, Sequence[Floats]):
    """Finitely many reference values or trajectory parameters; iterating gives (m,) arrays."""

    def __init__(self, points: ArrayLike | Sequence[ArrayLike]) -> None:
        listed = list(points) if isinstance(points, Sequence | np.ndarray) else None
        if listed is None:
            raise ModegraphError(f"Points takes a list of points, got {type(points).__name__}")
        if not listed:
            raise ModegraphError("Points: the reference class is empty; give at least one point")
        rows = [vector(point, f"Points: point {k}") for k, point in enumerate(listed)]
        for k, row in enumerate(rows):
            if row.size != rows[0].size:
                raise ModegraphError(
                    f"Points: point {k} has {row.size} values but point 0 has {rows[0].size}; give all the same length"
                )
            for j in range(k):
                if np.array_equal(rows[j], row):
                    raise ModegraphError(f"Points: points {j} and {k} are the same, {text_of(row)}; drop one")
        self.points = frozen(np.array(rows))

    @property
    def dim(self) -> int:
        return int(self.points.shape[1])

    def __len__(self) -> int:
        return len(self.points)

    def __getitem__(self, key: Any) -> Any:
        return self.points[key]

    def __iter__(self) -> Iterator[Floats]:
        return iter(self.points)

    def __repr__(self) -> str:
        return f"Points({self.points.tolist()})"


class Setpoint(Reference):
    """Constant references: one value, those of a :class:`Points`, or of a Box. Made by :func:`setpoint`."""

    duration = 0.0
    breakpoints = ()

    def __init__(self, points: Points | Box, given: object) -> None:
        self.points = points
        self.region = points if isinstance(points, Box) else None
        self.given = given

    @property
    def dim(self) -> int:
        return self.points.dim

    @property
    def is_constant(self) -> bool:
        return True

    def parameters(self) -> list[Floats | None]:
        if isinstance(self.points, Box):
            raise ModegraphError("a continuous class of references cannot be listed; name one by its parameters")
        return list(self.points)

    def pieces(self, graph: Graph, time: Expr, p: Floats | list[Expr] | None, owner: str) -> list[Piece]:
        value = p if isinstance(p, list) else [graph.constant(float(v)) for v in self._value(p)]
        zero = [graph.constant(0)] * self.dim
        return [Piece(0.0, math.inf, value, zero, zero)]

    def at(self, t: float, p: ArrayLike | None = None, side: Side = "right") -> ReferenceValue:
        value = self._value(p)
        return ReferenceValue(value, np.zeros(self.dim), np.zeros(self.dim), value)

    def _value(self, p: object) -> Floats:
        value = self.find(p)
        assert value is not None
        return value

    def __repr__(self) -> str:
        return f"setpoint({self.given!r})"


def setpoint(value: ArrayLike | Points | Box) -> Setpoint:
    """A constant reference.

    Parameters
    ----------
    value : array or scalar
        One constant reference (m,).
    value : Points
        Finitely many.
    value : Box
        Every value in it (a continuous class): at most six coordinates.

    Raises
    ------
    ModegraphError
        If it is nothing of the kind.
    """
    if isinstance(value, Points):
        return Setpoint(value, value)
    if isinstance(value, Box):
        return Setpoint(parameter_box(value, "setpoint"), value)
    if isinstance(value, Set):
        raise ModegraphError(
            f"setpoint takes reference values, not a {type(value).__name__}; pass an array, Points([...]) or a Box"
        )
    if isinstance(value, Reference) or callable(value):
        raise ModegraphError(
            "setpoint takes a constant; for a time-varying reference use mg.trajectory(signal, duration)"
        )
    if np.ndim(value) > 1:
        raise ModegraphError(
            f"setpoint: one reference is a vector, got an array of shape {np.shape(value)};"
            " for several references use setpoint(Points([...]))"
        )
    if np.size(value) == 0:
        raise ModegraphError("setpoint: the reference is empty; give at least one value")
    return Setpoint(Points([vector(value, "setpoint: value")]), value)


def parameter_box(box: Box, what: str) -> Box:
    """The box, if it has few enough parameters; ``what`` opens the error."""
    if box.dim > MOST_PARAMETERS:
        raise ModegraphError(
            f"{what}: a continuous class has at most {MOST_PARAMETERS} parameters, this Box has {box.dim}; "
            "fix the others, or list the references with mg.Points([...])"
        )
    return box


def text_of(p: ArrayLike | None) -> str:
    """A parameter vector for people, such as "(0.5, 1)"; "" without parameters."""
    if p is None:
        return ""
    return "(" + ", ".join(f"{float(v):.12g}" for v in np.atleast_1d(np.asarray(p, dtype=float))) + ")"


def _listing(known: list[Floats | None]) -> str:
    shown = [text_of(p) or "None (the only one)" for p in known[:6]]
    return ", ".join(shown) + (f", ... ({len(known)} in all)" if len(known) > 6 else "")
