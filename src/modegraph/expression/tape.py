"""The flat program that kernels interpret.

One row of `Tape.ops` is one operation ``[op, a, b, c]`` on earlier rows (unused entries are -1):

====== ============================================================================
CONST  the constant
VAR    variable number a
ADD    a + b;  SUB a - b;  MUL a * b;  SQR a * a
MULC   constant * a;  ADDC a + constant
SIN    a, b = row of the cosine = own row + 1;  COS a, b = row of the sine = own row - 1
RECIP  1 / a
EXP    a
LOG    a, b = row of 1 / a
ATAN   a, b = row of 1 / (1 + a^2)
RELU   max(a, 0);  STEP 1 where a > 0, else 0
WHERE  a where c > 0, else b
====== ============================================================================
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from modegraph.errors import ModegraphError
from modegraph.expression.graph import ONE
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
from modegraph.expression.scalar import Expr, Graph
from modegraph.expression.text import render

__all__ = [
    "ADD", "ADDC", "ATAN", "CONST", "COS", "EXP", "LOG", "MUL", "MULC", "RECIP", "RELU", "SIN", "SQR", "STEP",
    "SUB", "VAR", "WHERE", "Tape", "compile_tape", "enclose_constant",
]  # fmt: skip


@dataclass(frozen=True, eq=False)
class Tape:
    """A compiled set of expressions.

    Attributes
    ----------
    ops : (size, 4) int64
        See the module's table.
    const : (size,) float64
        The double nearest to the row's exact constant; 0 for rows without one.
    const_rad : (size,) float64
        |exact constant - double|, rounded up; 0 where the double is exact.
    variables : (nvar,) int64
        Row of each variable, in the order given, unused ones included.
    outputs : (nout,) int64
        Row of each root.
    describe : callable
        Makes ``labels``; they are needed for messages only, and take a third of the time of a tape.
    """

    ops: NDArray[np.int64]
    const: NDArray[np.float64]
    const_rad: NDArray[np.float64]
    variables: NDArray[np.int64]
    outputs: NDArray[np.int64]
    describe: Callable[[], tuple[str, ...]]

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """Readable text of each row, or the message of an operation that may be undefined."""
        return self.describe()

    @property
    def size(self) -> int:
        """Number of rows."""
        return len(self.ops)


def enclose_constant(value: Fraction) -> tuple[float, float]:
    """Nearest double and a rigorous upper bound of its error. Raises where doubles overflow."""
    try:
        centre = float(value)
    except OverflowError:
        raise ModegraphError("a constant of the model is larger than any double") from None
    error = abs(value - Fraction(centre))
    radius = float(error)
    if Fraction(radius) < error:
        radius = math.nextafter(radius, math.inf)
    return centre, radius


def compile_tape(roots: Sequence[Expr], variables: Sequence[Expr]) -> Tape:
    """Lower expressions to a tape.

    Raises `ModegraphError` if a root depends on a variable that is not listed.
    """
    if not roots and not variables:
        raise ModegraphError("a tape needs at least one expression or variable")
    graph = (roots[0] if roots else variables[0]).graph
    position = {v.index: k for k, v in enumerate(variables)}
    rows = _rows(graph, [e.index for e in (*roots, *variables)])
    place = {index: k for k, index in enumerate(rows)}
    ops = np.full((len(rows), 4), -1, dtype=np.int64)
    const = np.zeros(len(rows))
    radius = np.zeros(len(rows))
    for k, index in enumerate(rows):
        op, a, b, c, value = graph.nodes[index]
        if value is not None:
            const[k], radius[k] = enclose_constant(value)
        if op == VAR:
            if index not in position:
                raise ModegraphError(f"{graph.names[a]} is not among the variables of the tape")
            ops[k, :2] = VAR, position[index]
            continue
        partner = _partner(graph, index)
        ops[k] = (
            op,
            place[a] if a >= 0 else -1,
            place[partner] if partner >= 0 else place[b] if b >= 0 else -1,
            place[c] if c >= 0 else -1,
        )
    return Tape(
        ops=ops,
        const=const,
        const_rad=radius,
        variables=np.array([place[v.index] for v in variables], dtype=np.int64),
        outputs=np.array([place[e.index] for e in roots], dtype=np.int64),
        describe=lambda: tuple(graph.notes.get(index) or render(graph, index, 80) for index in rows),
    )


def _partner(graph: Graph, index: int) -> int:
    """The companion node an operation of the tape points at with b, or -1."""
    op, a = graph.nodes[index][:2]
    if op == SIN:
        return index + 1
    if op == COS:
        return index - 1
    if op == LOG:
        return graph.node(RECIP, a)
    if op == ATAN:
        return graph.recip(graph.shift(graph.sqr(a), ONE))
    return -1


def _rows(graph: Graph, roots: list[int]) -> list[int]:
    """Needed nodes, companions included; ascending numbers are a valid order of evaluation."""
    needed: set[int] = set()
    fresh = graph.reachable(roots)
    while fresh:
        needed.update(fresh)
        partners = [p for p in (_partner(graph, k) for k in fresh) if p >= 0 and p not in needed]
        fresh = [k for k in graph.reachable(partners) if k not in needed] if partners else []
    return sorted(needed)
