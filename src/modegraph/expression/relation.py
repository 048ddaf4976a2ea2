"""Inequalities between traced scalars, as constraints and as conditions of `np.where`."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NoReturn

from modegraph.errors import ModegraphError
from modegraph.expression.graph import NONNEGATIVE
from modegraph.expression.ops import ADDC, MULC
from modegraph.expression.protocol import RULES

if TYPE_CHECKING:
    from modegraph.expression.scalar import Expr, Graph

_REMEDY = (
    "a relation between traced values cannot decide a branch: write a chained comparison `a <= x <= b` as "
    "two entries, `and`/`or` as separate constraints, and an `if` as np.where(condition, a, b)"
)


class Relation:
    """lhs <= rhs (strict: lhs < rhs, which as a constraint means the same)."""

    __slots__ = ("lhs", "rhs", "strict")

    def __init__(self, lhs: Expr, rhs: Expr, strict: bool = False) -> None:
        self.lhs = lhs
        self.rhs = rhs
        self.strict = strict

    @property
    def constant(self) -> bool | None:
        """The truth value of a relation between constants, else None."""
        gap = self.rhs - self.lhs
        if not gap.is_constant:
            return None
        return gap.value > 0 if self.strict else gap.value >= 0

    def faces(self) -> list[Expr]:
        """Expressions g, all of which are <= 0 exactly where the relation holds.

        ``abs(e) <= c`` gives two, ``maximum(a, b) <= c`` likewise; ``sqrt(a) <= c`` with a sum of
        squares a and a constant c >= 0 becomes the smooth a <= c^2.
        """
        graph = self.lhs.graph
        for root, bound, sign in ((self.lhs, self.rhs, 1), (self.rhs, self.lhs, -1)):
            argument = _square_root_of(graph, root.index)
            if argument is not None and bound.is_constant and bound.value >= 0:
                return [sign * (type(root)(graph, argument) - bound.value**2)]
        uppers = [type(self.lhs)(graph, k) for k in _split(graph, self.lhs.index, upper=True)]
        lowers = [type(self.lhs)(graph, k) for k in _split(graph, self.rhs.index, upper=False)]
        return [upper - lower for upper in uppers for lower in lowers]

    def text(self, width: int = 80) -> str:
        """Readable infix form."""
        return f"{self.lhs.text(width // 2)} {'<' if self.strict else '<='} {self.rhs.text(width // 2)}"

    def __repr__(self) -> str:
        return f"<{self.text()}>"

    def __bool__(self) -> bool:
        known = self.constant
        if known is None:
            raise ModegraphError(f"{self.text()}: {_REMEDY}")
        return known

    def _refuse(self, *_: object) -> NoReturn:
        raise ModegraphError(f"{self.text()}: {_REMEDY}")

    __and__ = __rand__ = __or__ = __ror__ = __xor__ = __rxor__ = __invert__ = _refuse
    __lt__ = __le__ = __gt__ = __ge__ = __add__ = __radd__ = __mul__ = __rmul__ = __sub__ = __rsub__ = _refuse
    __eq__ = __ne__ = _refuse
    __hash__ = None  # type: ignore[assignment]

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **kwargs: Any) -> Any:
        self._refuse()

    def __array_function__(self, func: Callable[..., Any], types: Any, args: Any, kwargs: Any) -> Any:
        return RULES.function(func, args, kwargs)


def _square_root_of(graph: Graph, index: int) -> int | None:
    origin = graph.origins.get(index)
    if origin is not None and origin[0] == "sqrt" and graph.signs[origin[1][0]] >= NONNEGATIVE:
        return origin[1][0]
    return None


def _split(graph: Graph, index: int, *, upper: bool) -> list[int]:
    """Nodes whose maximum (upper) or minimum is this node."""
    node = graph.nodes[index]
    kind, operands = graph.origins.get(index, ("", ()))
    if kind == "abs" and upper:
        return [operands[0], graph.neg(operands[0])]
    if kind == ("max" if upper else "min"):
        return [k for operand in operands for k in _split(graph, operand, upper=upper)]
    if node.op == ADDC and node.const is not None:
        return [graph.shift(k, node.const) for k in _split(graph, node.a, upper=upper)]
    if node.op == MULC and node.const is not None:
        factor: Fraction = node.const
        return [graph.scale(k, factor) for k in _split(graph, node.a, upper=upper == (factor > 0))]
    return [index]
