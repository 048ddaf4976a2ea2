"""The function of a sublevel set: traced, split into parts, and bounded over boxes.

fn <= level is a list of inequalities e <= bound, one for each argument of an outer maximum (or absolute
value); an outer square root is squared away, so that norms are defined at zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from modegraph.errors import ModegraphError
from modegraph.expression.ops import ADDC
from modegraph.model.sets import exact
from modegraph.model.sets.base import Floats

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from modegraph.enclosure.intervals import IntervalEvaluator
    from modegraph.expression.evaluate import Evaluator
    from modegraph.expression.scalar import Expr, Graph
    from modegraph.expression.tape import Tape

ROLE = "fn"


@dataclass(frozen=True)
class Part:
    """offset + e (or offset + sqrt(e), e never negative), one argument of the outer maximum."""

    expr: Expr
    offset: Fraction
    root: bool

    def bound(self, level: Fraction) -> Fraction | None:
        """The part is at most ``level`` exactly where e is at most this; None: nowhere."""
        room = level - self.offset
        if not self.root:
            return room
        return room**2 if room >= 0 else None


class LevelFunction:
    """{x : fn(x) <= level} as tapes over x (dim,).

    Raises
    ------
    ModegraphError
        If fn cannot be traced with that many coordinates, or does not return one number.
    """

    def __init__(self, fn: Callable[..., Any], level: float, dim: int) -> None:
        from modegraph.expression.scalar import Graph

        self.level, self.dim = Fraction(level), dim
        self.graph = Graph()
        self.x = self.graph.variables([f"x[{k}]" for k in range(dim)])
        self.root = trace(fn, self.graph, self.x)
        self.parts = [self._part(index, offset) for index, offset in self._arguments(self.root.index, Fraction(0))]

    # -- structure -------------------------------------------------------------------------------

    def _arguments(self, index: int, offset: Fraction) -> list[tuple[int, Fraction]]:
        """The arguments of an outer maximum, with what is added to them outside of it."""
        graph = self.graph
        index, offset = self._named(index, offset)
        kind, operands = graph.origins.get(index, ("", ()))
        if kind == "max":
            return [found for k in operands for found in self._arguments(k, offset)]
        if kind == "abs":
            mirrored = graph.neg(operands[0])
            return [found for k in (operands[0], mirrored) for found in self._arguments(k, offset)]
        node = graph.nodes[index]
        if node.op == ADDC and node.const is not None:
            return self._arguments(node.a, offset + node.const)
        return [(index, offset)]

    def _named(self, index: int, offset: Fraction) -> tuple[int, Fraction]:
        """The maximum or absolute value that differs from a node by a constant, which folding has merged."""
        graph = self.graph

        def base(k: int) -> tuple[int, Fraction]:
            node = graph.nodes[k]
            return (k, Fraction(0)) if node.const is None or node.op != ADDC else (node.a, node.const)

        inner, shift = base(index)
        for k, (kind, _) in graph.origins.items():
            other, merged = base(k)
            if other == inner and kind in ("max", "abs"):
                return k, offset + shift - merged
        return index, offset

    def _part(self, index: int, offset: Fraction) -> Part:
        from modegraph.expression.graph import NONNEGATIVE
        from modegraph.expression.scalar import Expr

        kind, operands = self.graph.origins.get(index, ("", ()))
        if kind == "sqrt" and self.graph.signs[operands[0]] >= NONNEGATIVE:
            return Part(Expr(self.graph, operands[0]), offset, True)
        return Part(Expr(self.graph, index), offset, False)

    @cached_property
    def tape(self) -> Tape:
        """Outputs: one for each part, then what folding removed although it may be undefined."""
        from modegraph.expression.scalar import Expr
        from modegraph.expression.tape import compile_tape

        dropped = [Expr(self.graph, k) for k in dict.fromkeys(self.graph.dropped)]
        return compile_tape([*(part.expr for part in self.parts), *dropped], self.x)

    @cached_property
    def gradient(self) -> Tape | None:
        """Outputs: the partial derivatives, part by part; None where a case distinction may jump."""
        from modegraph.expression.derivative import derivative
        from modegraph.expression.ops import STEP, WHERE
        from modegraph.expression.tape import compile_tape

        exprs = [part.expr for part in self.parts]
        nodes = self.graph.reachable([e.index for e in exprs])
        if any(self.graph.nodes[k].op in (STEP, WHERE) for k in nodes):
            return None
        return compile_tape([d for row in derivative(exprs, self.x) for d in row], self.x)

    @cached_property
    def bounds(self) -> tuple[Floats, Floats]:
        """The bound of every part, rounded down and up; -inf where it holds nowhere."""
        exact_bounds = [part.bound(self.level) for part in self.parts]
        return (
            np.array([-np.inf if b is None else exact.round_down(b) for b in exact_bounds]),
            np.array([-np.inf if b is None else exact.round_up(b) for b in exact_bounds]),
        )

    # -- floats ----------------------------------------------------------------------------------

    @cached_property
    def _evaluator(self) -> Evaluator:
        from modegraph.expression.evaluate import Evaluator

        return Evaluator(self.tape)

    def values(self, points: Floats) -> Floats:
        """fn at points (B, dim) in floats, (B,); inf where it is undefined."""
        with np.errstate(all="ignore"):
            out = self._evaluator(np.ascontiguousarray(points.T))[: len(self.parts)]
            total = self.totals(out, np.array([float(part.offset) for part in self.parts]))
        return np.where(np.isnan(total), np.inf, total)

    def totals(self, values: Floats, offsets: Floats) -> Floats:
        """fn (B,) from the values of its parts (parts, B), in floats."""
        roots = np.array([part.root for part in self.parts])
        each = np.where(roots[:, None], np.sqrt(np.maximum(values, 0.0)), values) + offsets[:, None]
        return np.asarray(each.max(axis=0))

    # -- proofs ----------------------------------------------------------------------------------

    @cached_property
    def _intervals(self) -> tuple[IntervalEvaluator, IntervalEvaluator | None]:
        from modegraph.enclosure.intervals import IntervalEvaluator

        return IntervalEvaluator(self.tape), None if self.gradient is None else IntervalEvaluator(self.gradient)

    def ranges(self, lo: Floats, hi: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """Ranges (parts, B) of the parts over boxes (B, dim), and where everything is defined (B,)."""
        low, high, defined = self._intervals[0](lo.T, hi.T)
        count = len(self.parts)
        low, high = low[:count], high[:count]
        slopes = self._intervals[1]
        if slopes is not None:
            below, above = self._mean_value(slopes, lo, hi)
            usable = np.isfinite(below) & np.isfinite(above) & defined
            low, high = np.where(usable, np.maximum(low, below), low), np.where(usable, np.minimum(high, above), high)
        return low, high, defined

    def _mean_value(self, slopes: IntervalEvaluator, lo: Floats, hi: Floats) -> tuple[Floats, Floats]:
        """f(m) + f'(box) (box - m)."""
        with np.errstate(all="ignore"):
            middle = np.clip(0.5 * lo + 0.5 * hi, lo, hi)
            radius = np.nextafter(np.maximum(hi - middle, middle - lo), np.inf).T
            low, high, _ = self._intervals[0](middle.T, middle.T)
            count = len(self.parts)
            steep = np.maximum(*(np.abs(side) for side in slopes(lo.T, hi.T)[:2])).reshape(count, self.dim, -1)
            swing = (steep * radius).sum(axis=1) * (1.0 + 2.0**-48)
            return np.nextafter(low[:count] - swing, -np.inf), np.nextafter(high[:count] + swing, np.inf)

    def outside(self, lo: Floats, hi: Floats) -> NDArray[np.bool_]:
        """For boxes (B, dim): True where fn > level is proved on the whole box (or fn is undefined)."""
        low, _, _ = self.ranges(lo, hi)
        return np.asarray((low > self.bounds[1][:, None]).any(axis=0))

    def inside(self, lo: Floats, hi: Floats) -> NDArray[np.bool_]:
        """For boxes (B, dim): True where fn is proved to be defined and at most level on the whole box."""
        _, high, defined = self.ranges(lo, hi)
        return np.asarray(defined & (high <= self.bounds[0][:, None]).all(axis=0))

    def holds(self, x: Floats) -> bool:
        """Whether fn(x) <= level: exactly where x makes every operation rational, else as far as it is proved.

        False where fn is undefined.
        """
        point = exact.fractions(x)
        try:
            values = [exact_value(self.graph, part.expr.index, point) for part in self.parts]
            values += [exact_value(self.graph, k, point) for k in self.graph.dropped]
        except Irrational:
            return bool(self.inside(x[None], x[None])[0])
        if any(value is None for value in values):
            return False
        limits = [part.bound(self.level) for part in self.parts]
        return all(
            value is not None and limit is not None and value <= limit
            for value, limit in zip(values[: len(limits)], limits, strict=True)
        )


class Irrational(Exception):
    """A value is not a rational number, or too long a one."""


LONGEST = 20_000
"""Bits of a rational number after which exact evaluation gives up."""


def exact_value(graph: Graph, index: int, point: exact.Row) -> Fraction | None:
    """The exact value of a node; None where it is undefined. Raises `Irrational` where it is not rational."""
    from modegraph.expression import ops

    known: dict[int, Fraction | None] = {}

    def value(k: int) -> Fraction | None:
        if k not in known:
            known[k] = compute(k)
            number = known[k]
            if number is not None and number.numerator.bit_length() + number.denominator.bit_length() > LONGEST:
                raise Irrational
        return known[k]

    def compute(k: int) -> Fraction | None:
        op, i, j, c, const = graph.nodes[k]
        if op == ops.CONST:
            return const
        if op == ops.VAR:
            return point[i]
        if op == ops.WHERE:
            condition = value(c)
            return None if condition is None else value(i if condition > 0 else j)
        a = value(i)
        b = value(j) if op in ops.BINARY else Fraction(0)
        if a is None or b is None or (op == ops.RECIP and a == 0) or (op == ops.LOG and a <= 0):
            return None
        return _rational(op, a, b, const if const is not None else Fraction(0))

    for k in graph.reachable([index]):
        if graph.nodes[k].op != ops.WHERE and not graph.partial[k]:
            value(k)
    return value(index)


def _rational(op: int, a: Fraction, b: Fraction, const: Fraction) -> Fraction:
    """One operation; the elementary functions are rational at one rational point only (Lindemann)."""
    from modegraph.expression import ops

    if op in (ops.SIN, ops.COS, ops.EXP, ops.ATAN, ops.LOG):
        if a != (1 if op == ops.LOG else 0):
            raise Irrational
        return Fraction(1 if op in (ops.COS, ops.EXP) else 0)
    if op == ops.RECIP:
        return 1 / a
    if op == ops.RELU:
        return max(a, Fraction(0))
    if op == ops.STEP:
        return Fraction(1 if a > 0 else 0)
    results = {ops.ADD: a + b, ops.SUB: a - b, ops.MUL: a * b, ops.SQR: a * a, ops.MULC: const * a, ops.ADDC: a + const}
    return results[op]


def trace(fn: Callable[..., Any], graph: Graph, x: list[Expr]) -> Expr:
    """fn(x) as a traced scalar."""
    from modegraph.expression.array import TracedArray
    from modegraph.expression.repeatable import twice
    from modegraph.expression.trace import as_vector, call

    array = TracedArray(x)
    array.flags.writeable = False

    def read() -> list[Expr]:
        return as_vector(
            call(fn, {"x": array}, role=ROLE, owner="Sublevel"), None, role=ROLE, owner="Sublevel", graph=graph
        )

    entries = twice(read, list, graph, f"Sublevel, {ROLE}")
    if len(entries) != 1:
        raise ModegraphError(
            f"Sublevel, fn returned {len(entries)} entries, expected one number; "
            "for several inequalities return the np.max of them"
        )
    return entries[0]
