"""Choosing the branches of a function of one variable on an interval between its breakpoints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

from modegraph.expression.graph import ONE, ZERO, Node
from modegraph.expression.ops import ADD, ADDC, CONST, MULC, RELU, STEP, SUB, VAR, WHERE
from modegraph.expression.scalar import Expr, Graph


def resolve(exprs: Sequence[Expr], variable: Expr, lo: float, hi: float) -> list[Expr]:
    """The expressions on the open interval lo < variable < hi (either end may be infinite).

    Each where, max(., 0) and step whose argument is affine in `variable` alone and has one sign there is
    replaced by its branch, in exact arithmetic; the others stay.
    """
    if not exprs:
        return []
    graph = exprs[0].graph
    target = variable.index

    def replace(node: Node, a: int, b: int, c: int) -> int | None:
        if node.op not in (WHERE, RELU, STEP):
            return None
        sign = _sign(graph, c if node.op == WHERE else a, target, lo, hi)
        if sign == 0:
            return None
        if node.op == WHERE:
            return a if sign > 0 else b
        if node.op == RELU:
            return a if sign > 0 else graph.number(ZERO)
        return graph.number(ONE if sign > 0 else ZERO)

    return [Expr(graph, k) for k in graph.rewrite([e.index for e in exprs], replace)]


def unresolved(exprs: Sequence[Expr], variable: Expr) -> list[Expr]:
    """The case distinctions left whose condition depends on `variable` and on nothing else."""
    if not exprs:
        return []
    graph = exprs[0].graph
    mask = graph.masks[variable.index]
    return [
        Expr(graph, k)
        for k in graph.reachable([e.index for e in exprs])
        if graph.nodes[k].op == WHERE and graph.masks[graph.nodes[k].c] == mask
    ]


def _sign(graph: Graph, index: int, target: int, lo: float, hi: float) -> int:
    """Sign of an affine function on an open interval: 1 or -1, or 0 if it is neither."""
    line = _affine(graph, index, target)
    if line is None:
        return 0
    slope, offset = line
    if slope == 0:
        return (offset > 0) - (offset < 0)
    ends = [_end(slope, offset, lo), _end(slope, offset, hi)]
    if min(ends) >= 0:
        return 1
    return -1 if max(ends) <= 0 else 0


def _end(slope: Fraction, offset: Fraction, at: float) -> int:
    if math.isinf(at):
        return 1 if (slope > 0) == (at > 0) else -1
    value = slope * Fraction(at) + offset
    return (value > 0) - (value < 0)


def _affine(graph: Graph, index: int, target: int) -> tuple[Fraction, Fraction] | None:
    """(slope, offset) of a node that is affine in one variable alone, or None."""
    op, a, b, _, const = graph.nodes[index]
    if index == target:
        return ONE, ZERO
    if op == CONST and const is not None:
        return ZERO, const
    if op == VAR or op not in (ADD, SUB, MULC, ADDC):
        return None
    left = _affine(graph, a, target)
    if left is None:
        return None
    if op == MULC and const is not None:
        return const * left[0], const * left[1]
    if op == ADDC and const is not None:
        return left[0], left[1] + const
    right = _affine(graph, b, target)
    if right is None:
        return None
    return (left[0] + right[0], left[1] + right[1]) if op == ADD else (left[0] - right[0], left[1] - right[1])
