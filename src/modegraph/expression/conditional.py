"""`np.where` on a traced condition: continuous where that can be proved, a `where` node otherwise."""

from __future__ import annotations

from modegraph.expression.relation import Relation
from modegraph.expression.scalar import Expr


def choose(condition: Relation, then: Expr, otherwise: Expr) -> Expr:
    """`then` where the condition holds, else `otherwise`.

    If (then - otherwise) is divisible by (rhs - lhs) as a rational function, the result is continuous
    and is written with max(., 0) instead of a case distinction.
    """
    known = condition.constant
    if known is not None:
        return then if known else otherwise
    graph = then.graph
    if condition.strict:
        gap = condition.rhs - condition.lhs
    else:
        gap, then, otherwise = condition.lhs - condition.rhs, otherwise, then
    from modegraph.expression.rational import continuous_choice

    joined = continuous_choice(gap, then, otherwise)
    return joined if joined is not None else Expr(graph, graph.where(gap.index, then.index, otherwise.index))
