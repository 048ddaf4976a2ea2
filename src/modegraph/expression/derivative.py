"""Exact derivatives of traced scalars, on the same graph."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from modegraph.errors import ModegraphError
from modegraph.expression.graph import ONE, ZERO
from modegraph.expression.ops import (
    ADD,
    ADDC,
    ATAN,
    COS,
    EXP,
    LOG,
    MUL,
    MULC,
    RECIP,
    RELU,
    SIN,
    SQR,
    SUB,
    VAR,
    WHERE,
)  # fmt: skip
from modegraph.expression.scalar import Expr, Graph


def derivative(exprs: Sequence[Expr], variables: Sequence[Expr]) -> list[list[Expr]]:
    """Partial derivatives ``result[i][j] = d exprs[i] / d variables[j]``.

    Zeros and ones are folded and results are shared with the graph. Across a kink: relu'(a) is 1
    where a > 0, else 0; ``where`` differentiates its branches; step' is 0.

    A derivative is undefined only where the expression is, so folding inside it adds no obligation.
    """
    if not exprs:
        return []
    graph = exprs[0].graph
    for variable in variables:
        if graph.nodes[variable.index].op != VAR:
            raise ModegraphError(f"{variable.text()} is not a variable to differentiate by")
    order = graph.reachable([e.index for e in exprs])
    obligations = len(graph.dropped)
    columns = [_column(graph, order, graph.nodes[v.index].a) for v in variables]
    del graph.dropped[obligations:]
    return [[Expr(graph, column.get(e.index, graph.number(ZERO))) for column in columns] for e in exprs]


def _column(graph: Graph, order: list[int], number: int) -> dict[int, int]:
    """Derivatives of the nodes that depend on a variable, by node."""
    bit = 1 << number
    zero = graph.number(ZERO)
    found: dict[int, int] = {}
    for index in order:
        if graph.masks[index] & bit:
            key = (index, number)
            if key not in graph.derivatives:
                graph.derivatives[key] = _rule(graph, index, found, zero)
            found[index] = graph.derivatives[key]
    return found


def _rule(graph: Graph, index: int, found: dict[int, int], zero: int) -> int:
    op, a, b, c, const = graph.nodes[index]
    if op == VAR:
        return graph.number(ONE)
    da = found.get(a, zero)
    if op == ADD:
        return graph.add(da, found.get(b, zero))
    if op == SUB:
        return graph.sub(da, found.get(b, zero))
    if op == MUL:
        return graph.add(graph.mul(da, b), graph.mul(a, found.get(b, zero)))
    if op == SQR:
        return graph.scale(graph.mul(a, da), Fraction(2))
    if op == MULC and const is not None:
        return graph.scale(da, const)
    if op == ADDC:
        return da
    if op == SIN:
        return graph.mul(graph.cos(a), da)
    if op == COS:
        return graph.neg(graph.mul(graph.sin(a), da))
    if op == RECIP:
        return graph.neg(graph.mul(graph.sqr(index), da))
    if op == EXP:
        return graph.mul(index, da)
    if op == LOG:
        return graph.mul(graph.recip(a), da)
    if op == ATAN:
        return graph.mul(graph.recip(graph.shift(graph.sqr(a), ONE)), da)
    if op == RELU:
        return graph.mul(graph.step(a), da)
    if op == WHERE:
        return graph.where(c, da, found.get(b, zero))
    return zero
