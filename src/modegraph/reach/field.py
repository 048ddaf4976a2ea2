"""The closed loop of one mode between two breakpoints, compiled for the kernels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..expression.derivative import derivative
from ..expression.evaluate import Evaluator
from ..expression.ops import CONST, LOG, RECIP, VAR, WHERE
from ..expression.scalar import Expr, Graph
from ..expression.simplify import simplify
from ..expression.tape import Tape, compile_tape
from ..model.closed_loop import ClosedLoop, Segment

SIMPLIFY_SECONDS = 1.0
"""Longest time spent on cancelling terms of one closed loop; then the tape is used as written."""


@dataclass(frozen=True)
class Field:
    """x' = f(x, t, w, d) on one segment of the reference, with what is observed along it.

    Variables of all tapes, in order: states (plant, then memory), time, disturbance, unknowns.

    Attributes
    ----------
    start, end : float
        Seconds after entering the mode; ``end`` is inf for the last segment.
    rates : Tape
        Outputs f.
    jacobian : Tape
        Outputs df/dx (n*n, row by row), df/dw (n*q), then every node of the model as written that is
        not defined everywhere: denominators, logarithms, unresolved ``where``. Also those which
        simplification cancelled, for a cancelled pole is still a pole.
    observed : Tape
        Outputs: one per constraint face (satisfied where <= 0), u'u, then the tracking errors.
    faces : tuple[str, ...]
        Constraint name of each face.
    linear : bool
        Jacobian and disturbance matrix are constant.
    full_w : bool
        f is not affine in the disturbance.
    autonomous : bool
        f and the constraints do not depend on time.
    """

    start: float
    end: float
    states: int
    disturbances: int
    unknowns: tuple[str, ...]
    rates: Tape
    jacobian: Tape
    observed: Tape
    faces: tuple[str, ...]
    outputs: int
    linear: bool
    full_w: bool
    autonomous: bool
    reads: tuple[frozenset[int], ...]
    """For each state's rate: the states it reads."""
    observed_states: frozenset[int]
    """States that a constraint reads."""

    @property
    def time_index(self) -> int:
        return self.states

    @property
    def first_w(self) -> int:
        return self.states + 1

    @property
    def first_d(self) -> int:
        return self.states + 1 + self.disturbances

    @property
    def variables(self) -> int:
        return self.first_d + len(self.unknowns)

    def evaluator(self) -> Evaluator:
        """Float evaluation of the rates for a batch of points."""
        return Evaluator(self.rates)


def _obligations(graph: Graph, roots: Sequence[int]) -> list[int]:
    """Nodes that must be defined on the tube: reciprocals, logarithms, unresolved where.

    Inside the branches of a where only the branch taken must be defined; its own node covers that.
    """
    found: list[int] = []
    seen: set[int] = set()
    stack = list(roots)
    while stack:
        index = stack.pop()
        if index in seen:
            continue
        seen.add(index)
        op, a, b, c, _ = graph.nodes[index]
        if op in (RECIP, LOG, WHERE):
            found.append(index)
        if op == WHERE:
            stack.append(c)
        elif op > VAR:
            stack.extend(k for k in (a, b) if k >= 0)
    return sorted(found)


def compile_field(loop: ClosedLoop, segment: Segment) -> Field:
    """Trace -> simplify -> differentiate -> tapes, for one segment."""
    graph = loop.graph
    states, disturbance = list(loop.states), list(loop.disturbance)
    unknowns = list(loop.unknowns.values())
    variables = [*states, loop.time, *disturbance, *unknowns]
    written = list(segment.rhs)
    n, nw = len(states), len(disturbance)
    obligations = _obligations(graph, [e.index for e in written])
    by_w = derivative(written, disturbance) if nw else [[] for _ in written]
    affine = not any(e.depends_on(disturbance) for row in by_w for e in row)
    if nw and affine:
        zero = graph.constant(0).index
        at_zero = graph.rewrite([e.index for e in written], known={w.index: zero for w in disturbance})
        parts = [Expr(graph, k) for k in at_zero] + [e for row in by_w for e in row]
        parts = simplify(parts, seconds=SIMPLIFY_SECONDS).exprs
        rates = []
        for i in range(n):
            rate = parts[i]
            for j in range(nw):
                rate = rate + parts[n + i * nw + j] * disturbance[j]
            rates.append(rate)
        by_w = [parts[n + i * nw : n + (i + 1) * nw] for i in range(n)]
    else:
        rates = simplify(written, seconds=SIMPLIFY_SECONDS).exprs
        by_w = derivative(rates, disturbance) if nw else by_w
    by_x = derivative(rates, states)
    obligations += _obligations(graph, [*graph.dropped, *(e.index for e in rates)])
    unique = [Expr(graph, k) for k in dict.fromkeys(obligations)]
    jacobian = [e for row in by_x for e in row] + [e for row in by_w for e in row]
    faces = [face.expr for face in segment.constraints]
    energy = graph.constant(0)
    for u in segment.inputs:
        energy = energy + u * u
    observed = [*faces, energy, *segment.tracking]
    roots = [e.index for e in jacobian[: n * (n + nw)]]
    linear = all(graph.nodes[k].op == CONST for k in roots)
    return Field(
        start=segment.start,
        end=segment.end,
        states=n,
        disturbances=nw,
        unknowns=tuple(loop.unknowns),
        rates=compile_tape(rates, variables),
        jacobian=compile_tape([*jacobian, *unique], variables),
        observed=compile_tape(observed, variables),
        faces=tuple(face.name for face in segment.constraints),
        outputs=len(segment.tracking),
        linear=linear and not unique,
        full_w=bool(nw) and not affine,
        autonomous=not any(e.depends_on([loop.time]) for e in [*rates, *faces]),
        reads=tuple(frozenset(k for k in range(n) if rate.depends_on([states[k]])) for rate in rates),
        observed_states=frozenset(k for k in range(n) if any(e.depends_on([states[k]]) for e in faces)),
    )


def disturbance_box(loop: ClosedLoop, box: object | None) -> tuple[np.ndarray, np.ndarray]:
    """Centre and half-widths (q,) of the disturbance set, rounded so that they cover it."""
    if box is None:
        return np.zeros(0), np.zeros(0)
    lo, hi = np.asarray(box.lo, float), np.asarray(box.hi, float)  # type: ignore[attr-defined]
    return cover(lo, hi)


def cover(lo: np.ndarray, hi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Centre c and radius r (float arrays) with [lo, hi] inside [c - r, c + r] exactly."""
    centre = np.where(lo == hi, lo, 0.5 * lo + 0.5 * hi)
    radius = np.maximum(hi - centre, centre - lo)
    exact = (lo == hi) | ((centre == 0.0) & (hi == -lo))
    return centre, np.where(exact, radius, np.nextafter(radius, np.inf))
