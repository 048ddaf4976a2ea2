"""Instants at which traced functions switch in time by themselves: ``np.where(t < 2.0, 1.0, 0.0)``."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction

from modegraph.expression.derivative import derivative
from modegraph.expression.ops import RELU, STEP, WHERE
from modegraph.expression.scalar import Expr
from modegraph.model.trajectory import at_instant


def switching_times(exprs: Sequence[Expr], time: Expr, start: float, end: float) -> list[float]:
    """Instants strictly between start and end where a condition affine in time alone changes sign.

    Only instants that are doubles can be met exactly; others are left out (the reach layer encloses
    a kink; a jump stays unresolved and is refused).
    """
    instants: set[float] = set()
    for _, condition in _timed(exprs, time):
        slope = derivative([condition], [time])[0][0]
        if not slope.is_constant or not slope.value:
            continue
        offset = at_instant([condition], time, 0.0)[0]
        if offset.is_constant:
            root = -offset.value / slope.value
            if start < root < end and Fraction(float(root)) == root:
                instants.add(float(root))
    return sorted(instants)


def jumps(exprs: Sequence[Expr], time: Expr) -> list[Expr]:
    """Case distinctions and steps left in the expressions that depend on time alone."""
    return [node for node, _ in _timed(exprs, time) if time.graph.nodes[node.index].op != RELU]


def _timed(exprs: Sequence[Expr], time: Expr) -> Iterator[tuple[Expr, Expr]]:
    """Kinks, steps and case distinctions with their conditions, of those that depend on time alone."""
    graph = time.graph
    for index in graph.reachable([e.index for e in exprs]):
        node = graph.nodes[index]
        if node.op in (RELU, STEP, WHERE):
            condition = node.c if node.op == WHERE else node.a
            if graph.masks[condition] == graph.masks[time.index]:
                yield Expr(graph, index), Expr(graph, condition)
