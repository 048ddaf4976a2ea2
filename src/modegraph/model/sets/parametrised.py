"""Sets whose numbers are traced: S(p) for every p of a continuous class of references at once.

Inside a traced function, ``Box(lo, hi)`` with traced bounds makes a `ParametrisedSet`; it is written as
{centre + axes xi}, xi in a box [-1, 1]^m or in the unit ball, with centre and axes traced.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from modegraph.errors import ModegraphError
from modegraph.model.sets.ball import Ball
from modegraph.model.sets.base import Floats, Set
from modegraph.model.sets.box import Box
from modegraph.model.sets.ellipsoid import Ellipsoid
from modegraph.model.sets.zonotope import Zonotope

if TYPE_CHECKING:
    from modegraph.expression.scalar import Expr, Graph

KINDS = (Box, Ball, Ellipsoid, Zonotope)


@dataclass(frozen=True)
class Condition:
    """expr >= 0 is needed for the set to exist; ``wrong`` says what is wrong where it is not."""

    expr: Expr
    wrong: str


@dataclass(frozen=True)
class TracedSet:
    """{centre + axes xi}, or {centre + xi : xi in ellipsoid}; centre (n,), axes n rows of m.

    Attributes
    ----------
    round : bool
        |xi|_2 <= 1; otherwise xi in [-1, 1]^m.
    ellipsoid : Ellipsoid, optional
        About the origin; there are no axes then.
    conditions : tuple of Condition
        The set exists where all of them hold.
    """

    kind: type[Set]
    centre: list[Expr]
    axes: list[list[Expr]]
    round: bool
    ellipsoid: Ellipsoid | None
    conditions: tuple[Condition, ...]

    @property
    def dim(self) -> int:
        return len(self.centre)


class ParametrisedSet:
    """What a set's constructor was given, traced values among it."""

    def __init__(self, kind: type[Set], given: Sequence[Any], named: Mapping[str, Any]) -> None:
        if kind not in KINDS:
            names = ", ".join(k.__name__ for k in KINDS)
            raise ModegraphError(
                f"a {kind.__name__} cannot depend on the parameters of a continuous class; use one of {names}, "
                "or list the references with mg.Points([...])"
            )
        signature = inspect.signature(kind.__init__)
        self.kind = kind
        self.given: dict[str, Any] = dict(signature.bind(None, *given, **named).arguments)

    def traced(self, graph: Graph, owner: str) -> TracedSet:
        """Centre and axes as expressions of one graph.

        Raises
        ------
        ModegraphError
            For wrong shapes, and for an Ellipsoid whose shape is traced; begins with ``owner``.
        """
        from modegraph.expression.trace import as_vector

        name = self.kind.__name__

        def vector(field: str) -> list[Expr]:
            found = as_vector(self.given[field], None, role=f"{name}: {field}", owner=owner, graph=graph)
            if not found:
                raise ModegraphError(f"{owner}, {name}: {field} must be a non-empty vector")
            return found

        if self.kind is Box:
            return self._box(vector("lo"), vector("hi"), owner)
        centre = vector("c")
        if self.kind is Ball:
            radius = vector("radius")
            if len(radius) != 1:
                raise ModegraphError(
                    f"{owner}, Ball: radius must be one number, got {len(radius)}; "
                    "for one per coordinate use Ellipsoid or Box"
                )
            condition = Condition(radius[0], "the radius of the Ball is negative")
            return TracedSet(Ball, centre, _diagonal(radius * len(centre)), True, None, (condition,))
        if self.kind is Ellipsoid:
            return TracedSet(Ellipsoid, centre, [[] for _ in centre], True, self._ellipsoid(len(centre), owner), ())
        return TracedSet(Zonotope, centre, self._columns(graph, len(centre), owner), False, None, ())

    def _box(self, lo: list[Expr], hi: list[Expr], owner: str) -> TracedSet:
        if len(lo) != len(hi):
            raise ModegraphError(
                f"{owner}, Box: lo has {len(lo)} coordinates but hi has {len(hi)}; give one bound each"
            )
        conditions = tuple(
            Condition(b - a, f"coordinate {k} of the Box is inverted (lo above hi)")
            for k, (a, b) in enumerate(zip(lo, hi, strict=True))
        )
        centre = [(a + b) * 0.5 for a, b in zip(lo, hi, strict=True)]
        radius = [(b - a) * 0.5 for a, b in zip(lo, hi, strict=True)]
        return TracedSet(Box, centre, _diagonal(radius), False, None, conditions)

    def _ellipsoid(self, n: int, owner: str) -> Ellipsoid:
        from modegraph.expression.array import is_traced

        if is_traced([self.given["shape"]]):
            raise ModegraphError(
                f"{owner}, Ellipsoid: shape must not depend on the reference in a continuous class; keep it fixed, "
                "or use a Ball, Box or Zonotope, whose size may"
            )
        try:
            return Ellipsoid(np.zeros(n), self.given["shape"])
        except ModegraphError as error:
            raise ModegraphError(f"{owner}, {error}") from None

    def _columns(self, graph: Graph, n: int, owner: str) -> list[list[Expr]]:
        from modegraph.expression.array import nested, plain
        from modegraph.expression.trace import as_vector

        where = f"{owner}, Zonotope: generators"
        table = plain(nested(self.given["generators"]))
        if table.ndim < 2:
            table = table.reshape(-1, 1)
        if table.ndim != 2 or len(table) != n:
            raise ModegraphError(f"{where} must be a matrix with {n} rows, one for each coordinate; got {table.shape}")
        return [as_vector(row, None, role="Zonotope: generators", owner=owner, graph=graph) for row in table]


Set._parametrised = ParametrisedSet


def _diagonal(entries: list[Expr]) -> list[list[Expr]]:
    zero = entries[0].graph.constant(0)
    return [[e if i == j else zero for j in range(len(entries))] for i, e in enumerate(entries)]


def numbers(instance: Set) -> tuple[Floats, Floats]:
    """Centre (n,) and axes (n, m) of a set of numbers, as :class:`TracedSet` has them (up to rounding)."""
    if isinstance(instance, Box):
        return 0.5 * instance.lo + 0.5 * instance.hi, np.diag(0.5 * instance.hi - 0.5 * instance.lo)
    if isinstance(instance, Ball):
        return instance.c, np.eye(instance.dim) * instance.radius
    if isinstance(instance, Zonotope):
        return instance.c, instance.generators
    assert isinstance(instance, Ellipsoid)
    return instance.c, np.zeros((instance.dim, 0))
