"""Traced scalars: `Graph` makes them, `Expr` is one, and it behaves like a Python number.

What a number can do and a traced scalar cannot (decide a branch, become a float) raises a
`ModegraphError` with the remedy.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from numbers import Rational
from typing import Any, NoReturn

import numpy as np

from modegraph.errors import ModegraphError
from modegraph.expression import functions
from modegraph.expression.graph import Node, Nodes
from modegraph.expression.ops import (
    ADD,
    ADDC,
    ATAN,
    CONST,
    COS,
    EXP,
    LOG,
    MUL,
    MULC,
    RECIP,
    RELU,
    SIN,
    SQR,
    STEP,
    SUB,
    VAR,
    WHERE,
)  # fmt: skip
from modegraph.expression.protocol import RULES
from modegraph.expression.relation import Relation
from modegraph.expression.text import render

Number = int | float | Fraction


def exact(value: object) -> Fraction | None:
    """The exact value of a real number (a float is that double), or None for anything else.

    Raises `ModegraphError` for NaN and infinities.
    """
    if isinstance(value, (float, np.floating)):
        if not math.isfinite(value):
            raise ModegraphError(f"the constant {float(value)} is not finite; check the expression it comes from")
        return Fraction(*value.as_integer_ratio())
    if isinstance(value, (bool, np.bool_, np.integer)):
        return Fraction(int(value))
    return Fraction(value) if isinstance(value, Rational) else None


class Graph(Nodes):
    """Append-only hash-consed graph of traced scalars."""

    def constant(self, value: Number) -> Expr:
        """A constant, kept exactly. Raises `ModegraphError` unless it is a finite real number."""
        number = exact(value)
        if number is None:
            raise ModegraphError(f"{value!r} is not a real number")
        return Expr(self, self.number(number))

    def variable(self, name: str) -> Expr:
        """The variable of this name; the same name is the same variable."""
        try:
            k = self.names.index(name)
        except ValueError:
            k = len(self.names)
            self.names.append(name)
        return Expr(self, self.node(VAR, k))

    def variables(self, names: Iterable[str]) -> list[Expr]:
        """One variable for each name."""
        return [self.variable(name) for name in names]

    def remake(self, node: Node, a: int, b: int, c: int) -> int:
        """The operation of `node` on new operands, folded."""
        op, const = node.op, node.const
        if op in (CONST, VAR):
            return self.node(*node)
        if op == MULC:
            assert const is not None
            return self.scale(a, const)
        if op == ADDC:
            assert const is not None
            return self.shift(a, const)
        if op == WHERE:
            return self.where(c, a, b)
        if op in _BINARY:
            return _BINARY[op](self, a, b)
        return _UNARY[op](self, a)

    def rewrite(
        self, roots: Sequence[int], replace: Callable[[Node, int, int, int], int | None] | None = None,
        known: Mapping[int, int] | None = None,
    ) -> list[int]:  # fmt: skip
        """Rebuild the roots bottom-up.

        `known` maps nodes to what stands for them. `replace` sees each other node together with its
        rebuilt operands and returns what stands for it, or None to apply the same operation.
        """
        done: dict[int, int] = dict(known or {})
        for index in self.reachable(list(roots)):
            if index in done:
                continue
            node = self.nodes[index]
            if node.op in (CONST, VAR):
                done[index] = index
                continue
            a = done[node.a]
            b = done[node.b] if node.b >= 0 else -1
            c = done[node.c] if node.c >= 0 else -1
            new = replace(node, a, b, c) if replace is not None else None
            if new is None and index in self.origins:
                new = self._branch(index, done)
            if new is None:
                same = (a, b, c) == (node.a, node.b, node.c)
                new = index if same else self.remake(node, a, b, c)
                if not same:
                    self._inherit(index, new, done)
            done[index] = new
        return [done[k] for k in roots]

    def _branch(self, index: int, done: Mapping[int, int]) -> int | None:
        """What an absolute value, maximum or minimum is once its kink has been decided."""
        kind, operands = self.origins[index]
        if kind == "sqrt":
            return None
        gap = operands[0] if kind == "abs" else self.sub(*operands)
        kink = done.get(self.relu(gap))
        above, below = operands[0], operands[-1]
        if kind == "min":
            above, below = below, above
        if kink is None or above not in done or below not in done:
            return None
        if kink == done.get(gap):
            return done[above]
        if self.value(kink) == 0:
            return self.neg(done[below]) if kind == "abs" else done[below]
        return None

    def _inherit(self, old: int, new: int, done: Mapping[int, int]) -> None:
        """Notes survive a rewriting; so do origins, because lowering again gives the same node."""
        if old in self.notes and self.nodes[new].op in (RECIP, LOG):
            self.notes.setdefault(new, self.notes[old])
        kind, operands = self.origins.get(old, ("", ()))
        if kind and all(k in done for k in operands):
            _LOWERINGS[kind](self, *(done[k] for k in operands))


_BINARY: dict[int, Callable[[Nodes, int, int], int]] = {ADD: Nodes.add, SUB: Nodes.sub, MUL: Nodes.mul}
_UNARY: dict[int, Callable[[Nodes, int], int]] = {
    SQR: Nodes.sqr, SIN: Nodes.sin, COS: Nodes.cos, RECIP: Nodes.recip, EXP: Nodes.exp, LOG: Nodes.log,
    ATAN: Nodes.atan, RELU: Nodes.relu, STEP: Nodes.step,
}  # fmt: skip

_LOWERINGS: dict[str, Callable[..., int]] = {
    "abs": Nodes.absolute,
    "max": Nodes.maximum,
    "min": Nodes.minimum,
    "sqrt": Nodes.square_root,
}


class Expr:
    """One traced scalar: a node of a graph."""

    __slots__ = ("graph", "index")

    def __init__(self, graph: Graph, index: int) -> None:
        self.graph = graph
        self.index = index

    @property
    def is_constant(self) -> bool:
        """Whether this is a constant number (after folding)."""
        return self.graph.nodes[self.index].op == CONST

    @property
    def value(self) -> Fraction:
        """The exact value of a constant. Raises `ModegraphError` for anything else."""
        number = self.graph.value(self.index)
        if number is None:
            raise ModegraphError(f"{self.text()} is not a constant")
        return number

    def depends_on(self, variables: Iterable[Expr]) -> bool:
        """Whether any of the variables occurs."""
        mask = 0
        for variable in variables:
            mask |= self.graph.masks[variable.index]
        return bool(self.graph.masks[self.index] & mask)

    def same(self, other: Expr) -> bool:
        """Whether both are the same node (``==`` is refused because it reads like a relation)."""
        return self.graph is other.graph and self.index == other.index

    def text(self, width: int = 80) -> str:
        """Readable infix form, shortened in the middle to about `width` characters."""
        return render(self.graph, self.index, width)

    def __repr__(self) -> str:
        return f"<{self.text()}>"

    def __hash__(self) -> int:
        return hash((id(self.graph), self.index))

    def _operand(self, other: object) -> int | None:
        if isinstance(other, Expr):
            if other.graph is not self.graph:
                raise ModegraphError(f"{other.text()} was traced in another call; keep no traced values in globals")
            return other.index
        value = exact(other)
        return None if value is None else self.graph.number(value)

    def _lift(self, other: object) -> Expr | None:
        index = self._operand(other)
        return None if index is None else Expr(self.graph, index)

    def __add__(self, other: object) -> Expr:
        b = self._operand(other)
        return NotImplemented if b is None else Expr(self.graph, self.graph.add(self.index, b))

    __radd__ = __add__

    def __sub__(self, other: object) -> Expr:
        b = self._operand(other)
        return NotImplemented if b is None else Expr(self.graph, self.graph.sub(self.index, b))

    def __rsub__(self, other: object) -> Expr:
        a = self._operand(other)
        return NotImplemented if a is None else Expr(self.graph, self.graph.sub(a, self.index))

    def __mul__(self, other: object) -> Expr:
        b = self._operand(other)
        return NotImplemented if b is None else Expr(self.graph, self.graph.mul(self.index, b))

    __rmul__ = __mul__

    def __truediv__(self, other: object) -> Expr:
        b = self._operand(other)
        if b is None:
            return NotImplemented
        return Expr(self.graph, self.graph.mul(self.index, self.graph.recip(b)))

    def __rtruediv__(self, other: object) -> Expr:
        a = self._operand(other)
        if a is None:
            return NotImplemented
        return Expr(self.graph, self.graph.mul(a, self.graph.recip(self.index)))

    def __pow__(self, other: object) -> Expr:
        exponent = self._lift(other)
        return NotImplemented if exponent is None else functions.power(self, exponent)

    def __rpow__(self, other: object) -> Expr:
        base = self._lift(other)
        return NotImplemented if base is None else functions.power(base, self)

    def __neg__(self) -> Expr:
        return Expr(self.graph, self.graph.neg(self.index))

    def __pos__(self) -> Expr:
        return self

    def __abs__(self) -> Expr:
        return functions.absolute(self)

    def conjugate(self) -> Expr:
        """Itself: traced values are real."""
        return self

    @property
    def real(self) -> Expr:
        """Itself: traced values are real."""
        return self

    def __le__(self, other: object) -> Relation:
        return self._relation(other, swap=False, strict=False)

    def __lt__(self, other: object) -> Relation:
        return self._relation(other, swap=False, strict=True)

    def __ge__(self, other: object) -> Relation:
        return self._relation(other, swap=True, strict=False)

    def __gt__(self, other: object) -> Relation:
        return self._relation(other, swap=True, strict=True)

    def _relation(self, other: object, *, swap: bool, strict: bool) -> Relation:
        if isinstance(other, (float, np.floating)) and math.isinf(other):
            raise ModegraphError(f"{self.text()} is compared with infinity; leave an unbounded limit out")
        right = self._lift(other)
        if right is None:
            return NotImplemented
        return Relation(right, self, strict) if swap else Relation(self, right, strict)

    def __eq__(self, other: object) -> NoReturn:
        raise ModegraphError(
            f"== between traced values ({self.text(40)}) is not a constraint that can be proved; "
            "use two inequalities, or np.where with < for a case distinction"
        )

    def __ne__(self, other: object) -> NoReturn:
        raise ModegraphError(
            f"!= between traced values ({self.text(40)}) is not a constraint that can be proved; "
            "use < or >, or np.where for a case distinction"
        )

    def __bool__(self) -> bool:
        raise ModegraphError(
            f"a branch on the traced value {self.text(40)}: `if`, `and`, `or`, `not`, min() and max() cannot "
            "be traced; use np.where(condition, a, b), np.minimum or np.maximum"
        )

    def __float__(self) -> float:
        raise ModegraphError(
            f"the traced value {self.text(40)} cannot become a float: use np.sin, np.sqrt, ... instead of "
            "the math module, and arrays made in the function with np.zeros or np.array (import numpy as np)"
        )

    def __int__(self) -> int:
        raise ModegraphError(f"the traced value {self.text(40)} cannot become an integer; it has no fixed value")

    def __complex__(self) -> complex:
        raise ModegraphError(f"the traced value {self.text(40)} cannot become complex; only real functions are traced")

    def __index__(self) -> int:
        raise ModegraphError(f"the traced value {self.text(40)} cannot be used as an index; use np.where to choose")

    def _refuse_rounding(self, *_: object) -> NoReturn:
        raise ModegraphError(
            f"rounding, // and % of the traced value {self.text(40)} are discontinuous and not supported; "
            "use a continuous function, or np.where with breakpoints for a signal"
        )

    __floordiv__ = __rfloordiv__ = __mod__ = __rmod__ = __divmod__ = __rdivmod__ = _refuse_rounding
    __round__ = __floor__ = __ceil__ = __trunc__ = _refuse_rounding

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **kwargs: Any) -> Any:
        return RULES.ufunc(ufunc, method, inputs, kwargs)

    def __array_function__(self, func: Callable[..., Any], types: Any, args: Any, kwargs: Any) -> Any:
        return RULES.function(func, args, kwargs)

    # NumPy calls these on the elements of plain object arrays.
    def sqrt(self) -> Expr:
        """Square root."""
        return functions.sqrt(self)

    def sin(self) -> Expr:
        """Sine."""
        return functions.sin(self)

    def cos(self) -> Expr:
        """Cosine."""
        return functions.cos(self)

    def tan(self) -> Expr:
        """Tangent."""
        return functions.tan(self)

    def exp(self) -> Expr:
        """Exponential."""
        return functions.exp(self)

    def log(self) -> Expr:
        """Natural logarithm."""
        return functions.log(self)

    def tanh(self) -> Expr:
        """Hyperbolic tangent."""
        return functions.tanh(self)

    def sinh(self) -> Expr:
        """Hyperbolic sine."""
        return functions.sinh(self)

    def cosh(self) -> Expr:
        """Hyperbolic cosine."""
        return functions.cosh(self)

    def arctan(self) -> Expr:
        """Inverse tangent."""
        return functions.arctan(self)
