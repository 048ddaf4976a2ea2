"""`np.where` on a traced condition: continuous where that can be proved, a `where` node otherwise."""

from __future__ import annotations

from collections.abc import Sequence

from modegraph.expression.graph import ZERO
from modegraph.expression.ops import RELU
from modegraph.expression.rational import RATIONAL, Field, Form, atoms_of, combine
from modegraph.expression.relation import Relation
from modegraph.expression.scalar import Expr
from modegraph.expression.work import TooBig, Work

LONGEST = 400
WORK = 2e5
"""Nodes of a choice that is looked at, and the work it may take."""


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
    joined = _continuous(gap, then, otherwise)
    return joined if joined is not None else Expr(graph, graph.where(gap.index, then.index, otherwise.index))


def _continuous(gap: Expr, then: Expr, otherwise: Expr) -> Expr | None:
    """`then` where gap > 0, else `otherwise`, as a continuous expression; None if that is not proved.

    (then - otherwise) = q * gap on one side of gap = 0 gives otherwise + q max(gap, 0), or the mirror
    image. On that side max(u, 0) is resolved for every u affine in the gap with a sign there.
    """
    graph = gap.graph
    order = graph.reachable([gap.index, then.index, otherwise.index])
    if len(order) > LONGEST:
        return None
    ring = Field(graph, atoms_of(graph, order), reduce=False, work=Work(WORK))
    for side in (1, -1):
        forms = _one_sided(ring, order, gap.index, side)
        a, b, c = forms[then.index], forms[otherwise.index], forms[gap.index]
        if a is None or b is None or c is None:
            return None
        try:
            q = ring.quotient(ring.add(a, b, -1), c)
            if q is None:
                continue
            factor = ring.express(q, {k: k for k in ring.atoms})
        except TooBig:
            return None
        kink = graph.relu(gap.index if side > 0 else graph.neg(gap.index))
        base = otherwise if side > 0 else then
        for index in (gap.index, then.index, otherwise.index):
            graph.drop(index)
        return type(gap)(graph, graph.add(base.index, graph.mul(factor, kink)))
    return None


def _one_sided(ring: Field, order: Sequence[int], gap: int, side: int) -> dict[int, Form | None]:
    """Forms that hold where side * gap >= 0."""
    graph = ring.graph
    forms: dict[int, Form | None] = {}
    inside_gap = set(graph.reachable([gap]))
    for index in [*sorted(inside_gap), *(k for k in order if k not in inside_gap)]:
        node = graph.nodes[index]
        if node.op in RATIONAL:
            forms[index] = combine(ring, index, forms)
            continue
        forms[index] = ring.atom(index)
        argument, reference = forms.get(node.a), forms.get(gap)
        if node.op == RELU and argument is not None and reference is not None:
            line = ring.affine(argument, reference)
            if line is not None:
                slope, offset = line[0] * side, line[1]
                if slope >= 0 and offset >= 0:
                    forms[index] = argument
                elif slope <= 0 and offset <= 0:
                    forms[index] = ring.constant(ZERO)
    return forms
