"""Fractions written as what is left of them: N / D = Q + (N - Q D) / D.

A controller that inverts a model of its plant leaves N near a multiple of D: then Q is what the designer
wanted, and the rest is small. Errors of 1 / D count by what they are multiplied with, so the second form
is several times tighter, although it is no shorter.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from modegraph.expression.evaluate import Evaluator
from modegraph.expression.ops import RECIP
from modegraph.expression.rational import cost
from modegraph.expression.scalar import Expr
from modegraph.expression.simplify import Pass
from modegraph.expression.tape import compile_tape
from modegraph.expression.work import TooBig, Work

Floats = NDArray[np.float64]

SMALL = 0.5
"""The rest must be this much smaller than the fraction to be worth it."""
LONGEST = 3.0
"""Largest cost of a fraction written in this way, relative to the cost as it was."""


def residual(
    exprs: Sequence[Expr], variables: Sequence[Expr], typical: Floats, constants: Sequence[Expr], *, work: float
) -> list[Expr]:
    """The expressions, fractions with a small rest written as quotient and rest: equal wherever they are defined.

    Parameters
    ----------
    variables, typical : (nvar, B) array
        All variables, and values of them at which sizes are compared (floats; they prove nothing).
    constants : expressions
        Variables that are held at the middle of their typical values when the quotient is found, where the
        denominator depends on them.
    work : float
        After so much of it (units of `Work`) the expressions stay as they are.
    """
    if not exprs:
        return []
    graph = exprs[0].graph
    order = graph.reachable([e.index for e in exprs])
    if not any(graph.nodes[k].op == RECIP for k in order):
        return list(exprs)
    rational = Pass(graph, order, reduce=True, work=Work(work))
    middle = {v.index: 0.5 * (row.min() + row.max()) for v, row in zip(variables, typical, strict=True)}
    known = {c.index for c in constants}
    values = {a: Fraction(float(middle[k])) for a, k in rational.atom_nodes.items() if k in known}
    return [_split(rational, e, values, variables, typical) for e in exprs]


def _split(rational: Pass, e: Expr, values: dict[int, Fraction], variables: Sequence[Expr], typical: Floats) -> Expr:
    """One expression, as it is or as quotient and rest."""
    form = rational.forms[e.index]
    if form is None or not form.powers:
        return e
    try:
        parts = rational.field.split(form, values, rational.atom_nodes)
    except TooBig:
        return e
    if parts is None:
        return e
    graph = e.graph
    rest = Expr(graph, parts[1])
    whole = graph.add(*parts)
    if cost(graph, [whole], rational.work) > LONGEST * cost(graph, [e.index], rational.work):
        return e
    sizes = np.abs(Evaluator(compile_tape([e, rest], variables))(typical))
    if not np.isfinite(sizes).all() or sizes[1].sum() > SMALL * sizes[0].sum():
        return e
    return Expr(graph, whole)
