"""Start sets of a continuous class of references, as polynomials in xi and in the parameters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.intervals import IntervalEvaluator
from modegraph.enclosure.monomials import Monomials
from modegraph.enclosure.rounding import UNIT
from modegraph.errors import ModegraphError
from modegraph.expression.evaluate import Evaluator
from modegraph.expression.scalar import Expr
from modegraph.expression.tape import Tape, compile_tape
from modegraph.model.class_start import StartClass
from modegraph.model.sets import Set
from modegraph.model.sets.parametrised import numbers
from modegraph.reach.field import cover
from modegraph.reach.pointwise import evaluate_over
from modegraph.reach.start.piece import Chart, Piece, ellipsoid_axes

Floats = NDArray[np.float64]

ROUNDED = 2.0**-46
"""What the numbers of a start set may differ by when they are computed in floats, relative to the largest."""


def class_chart(start: StartClass, unknown_lo: Floats, unknown_hi: Floats) -> Chart:
    """The chart whose ``form`` is c(p) + L(p) xi; the last of the unknowns are the parameters p."""
    tape, columns = _form(start)
    middle = np.asarray(start.region.center, float)
    m = len(columns)
    evaluate = Evaluator(tape)

    def numbers_at(p: Floats) -> tuple[Floats, Floats]:
        at = np.zeros((m + len(p), m + 1))
        at[m:] = p[:, None]
        at[:m, 1:] = np.eye(m)
        values = evaluate(at)
        return values[:, 0], values[:, 1:] - values[:, :1]

    centre, axes = numbers_at(middle)
    # The numbers may be larger inside the class than at its corners.
    below = np.concatenate([-np.ones(m), start.region.lo])[:, None]
    above = np.concatenate([np.ones(m), start.region.hi])[:, None]
    low, high, _ = IntervalEvaluator(tape)(below, above)
    rounded = ROUNDED * np.maximum(np.abs(low), np.abs(high))[:, 0]
    return Chart(
        centre, axes, start.set.round, None, unknown_lo, unknown_hi,
        parameters=len(middle), form=tape, rounded=rounded,
    )  # fmt: skip


def _form(start: StartClass) -> tuple[Tape, list[int]]:
    """x as a tape in xi, then p; and the columns of the axes that are not zero."""
    traced = start.set
    graph = traced.centre[0].graph
    rows: list[list[Expr]] = traced.axes
    if traced.ellipsoid is not None:
        rows = [[graph.constant(float(v)) for v in row] for row in ellipsoid_axes(traced.ellipsoid)]

    def zero(e: Expr) -> bool:
        return e.is_constant and e.value == 0

    columns = [k for k in range(len(rows[0])) if not all(zero(row[k]) for row in rows)]
    xi = graph.variables([f"~xi[{k}]" for k in columns])
    states = []
    for centre, row in zip(traced.centre, rows, strict=True):
        total = centre
        for variable, k in zip(xi, columns, strict=True):
            total = total + row[k] * variable
        states.append(total)
    return compile_tape(states, [*xi, *start.parameters]), columns


def start_polynomials(piece: Piece, table: Monomials) -> tuple[Floats, Floats, Floats]:
    """States (n, N) and unknowns (nd, N) over the table, and a box (n,) around what the states miss.

    The box is infinite where the start set cannot be enclosed over the whole piece.
    """
    states, unknowns, slack = piece.polynomials(table.linear, table.size)
    tape = piece.chart.form
    if tape is None:
        return states, unknowns, slack
    m = piece.chart.free
    inputs = np.zeros((len(tape.variables), table.size))
    inputs[:m, 0] = piece.middle[:m]
    inputs[np.arange(m), table.linear[:m]] = piece.radius[:m]
    inputs[m:] = unknowns[len(unknowns) - (len(inputs) - m) :]
    states, off, bad = evaluate_over(tape, table, table.order, inputs, np.zeros(len(inputs)))
    assert piece.chart.rounded is not None
    slack = (off + piece.chart.rounded) * (1.0 + 4.0 * UNIT)
    return states, unknowns, np.full(len(slack), np.inf) if bad >= 0 else np.asarray(slack)


def require_same_start(start: StartClass, chart: Chart, instance: Set, p: Floats, owner: str) -> None:
    """The start set of one reference, computed in floats, is that of the class up to ``rounded``: proved in intervals.

    Raises
    ------
    ModegraphError
        If rounding makes it another set; begins with ``owner``.
    """
    traced = start.set
    n = traced.dim
    exprs = [[c, *row] for c, row in zip(traced.centre, traced.axes, strict=True)]
    centre, axes = numbers(instance) if type(instance) is traced.kind else (np.zeros(0), np.zeros((0, 0)))
    if len(centre) == n and axes.shape[1] + 1 == len(exprs[0]):
        given = np.concatenate([centre[:, None], axes], axis=1)
        evaluate = IntervalEvaluator(compile_tape([e for row in exprs for e in row], start.parameters))
        low, high, _ = evaluate(p[:, None], p[:, None])
        lo, hi = low.reshape(given.shape), high.reshape(given.shape)
        off = np.maximum(np.abs(given - lo), np.abs(given - hi)).sum(axis=1)
        shape = traced.ellipsoid
        same = shape is None or np.array_equal(shape.shape, instance.shape)  # type: ignore[attr-defined]
        # Half: the numbers compared are rounded themselves.
        if same and chart.rounded is not None and (off <= 0.5 * chart.rounded).all():
            return
    raise ModegraphError(
        f"{owner}: the start set computed in floats is not that of the formula with exact numbers; write the formula "
        "so that rounding changes only its last digits"
    )


def parameters_of(piece: Piece) -> list[tuple[int, int]]:
    """Which variables of a piece are parameters of the class: (variable, number of the parameter)."""
    first = len(piece.chart.unknown_lo) - piece.chart.parameters
    return [(piece.chart.free + k, int(i) - first) for k, i in enumerate(piece.uncertain) if i >= first]


def scale_of(piece: Piece, variable: int) -> tuple[float, float]:
    """(c, r): an uncertain unknown is c + r eta with eta in [-1, 1] the variable of the flowpipe; c, r exact."""
    lo, hi = piece.unknown_range(int(piece.uncertain[variable - piece.chart.free]))
    centre, radius = cover(np.array([lo]), np.array([hi]))
    return float(centre[0]), float(radius[0])
