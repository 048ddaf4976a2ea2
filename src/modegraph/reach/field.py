"""The closed loop of one mode between two breakpoints, compiled for the kernels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from modegraph.expression.derivative import derivative
from modegraph.expression.ops import CONST, LOG, RECIP, VAR, WHERE
from modegraph.expression.residual import residual
from modegraph.expression.scalar import Expr, Graph
from modegraph.expression.simplify import simplify
from modegraph.expression.tape import Tape, compile_tape
from modegraph.model.closed_loop import ClosedLoop, Segment
from modegraph.model.sets.box import Box
from modegraph.model.sets.exact import inverse, matrix

SIMPLIFY_WORK = 1e6
"""Work spent on cancelling terms of one closed loop; then the tape is used as written. It is counted, not timed."""


@dataclass(frozen=True)
class Field:
    """x' = f(x, t, w, d) on one segment of the reference, with what is observed along it.

    Variables of all tapes, in order: states (plant, then memory; in the frame's coordinates where there
    is a frame), time, disturbance, unknowns, among them last the parameters of a class of references.

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
    steady : bool
        The Jacobian is constant.
    flat : bool
        f is affine in states, disturbance and unknowns together.
    full_w : bool
        f is not affine in the disturbance.
    autonomous : bool
        f, the constraints and what must be defined do not depend on time.
    """

    start: float
    end: float
    states: int
    frame: Frame | None
    disturbances: int
    unknowns: int
    rates: Tape
    jacobian: Tape
    observed: Tape
    faces: tuple[str, ...]
    outputs: int
    linear: bool
    steady: bool
    flat: bool
    full_w: bool
    autonomous: bool
    reads: tuple[frozenset[int], ...]
    """For each state's rate: the states it reads."""
    observed_states: frozenset[int]
    """States that a constraint reads, or a function that is not defined everywhere (cancelled or not)."""

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
        return self.first_d + self.unknowns


@dataclass(frozen=True)
class Frame:
    """Coordinates y with x = V y, V (n, n) of short dyadic numbers, its inverse exact.

    In the modes of the loop, errors of fast modes do not excite slow ones. In the coordinates of a
    mechanical plant they do: the boxes that bound what is nonlinear ignore how accelerations hang
    together through the inertia matrix.
    """

    V: NDArray[np.float64]
    exact_inverse: tuple[tuple[Fraction, ...], ...]

    @classmethod
    def of(cls, axes: NDArray[np.float64]) -> Frame | None:
        """The frame with nearly these columns; None if they are too nearly dependent."""
        V = np.round(axes * 1024.0) / 1024.0
        if not np.isfinite(V).all() or np.linalg.cond(V) > 1e3:
            return None
        rows = inverse(matrix(V))
        return None if rows is None else cls(V, tuple(tuple(row) for row in rows))

    @cached_property
    def inverse(self) -> NDArray[np.float64]:
        """The inverse, rounded to nearest (relative error of an entry at most 2**-53)."""
        return np.array([[float(v) for v in row] for row in self.exact_inverse])

    def substitute(self, graph: Graph, states: Sequence[Expr], exprs: Sequence[Expr]) -> list[Expr]:
        """Expressions in x rewritten with x = V y."""
        y = [graph.variable(f"~{k}") for k in range(len(states))]
        known = {}
        for i, x in enumerate(states):
            total = graph.constant(0)
            for k, weight in enumerate(self.V[i]):
                total = total + y[k] * float(weight)
            known[x.index] = total.index
        return [Expr(graph, k) for k in graph.rewrite([e.index for e in exprs], known=known)]

    def inverse_times(self, vector: Sequence[Expr]) -> list[Expr]:
        """V^-1 v, exactly."""
        graph = vector[0].graph
        out = []
        for row in self.exact_inverse:
            total = graph.constant(0)
            for weight, e in zip(row, vector, strict=True):
                if weight:
                    total = total + e * weight
            out.append(total)
        return out


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


def compile_field(loop: ClosedLoop, segment: Segment, frame: Frame | None = None) -> Field:
    """Trace -> simplify -> differentiate -> tapes, for one segment, in the coordinates of a frame."""
    graph = loop.graph
    states, disturbance = list(loop.states), list(loop.disturbance)
    unknowns = [*loop.unknowns.values(), *loop.parameters]
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
        parts = simplify(parts, work=SIMPLIFY_WORK).exprs
        parts[:n] = residual(parts[:n], variables, loop.typical, unknowns, work=SIMPLIFY_WORK)
        rates = []
        for i in range(n):
            rate = parts[i]
            for j in range(nw):
                rate = rate + parts[n + i * nw + j] * disturbance[j]
            rates.append(rate)
        by_w = [parts[n + i * nw : n + (i + 1) * nw] for i in range(n)]
    else:
        rates = simplify(written, work=SIMPLIFY_WORK).exprs
        rates = residual(rates, variables, loop.typical, unknowns, work=SIMPLIFY_WORK)
        by_w = derivative(rates, disturbance) if nw else by_w
    obligations += _obligations(graph, [*graph.dropped, *(e.index for e in rates)])
    unique = [Expr(graph, k) for k in dict.fromkeys(obligations)]
    faces = [face.expr for face in segment.constraints]
    energy = graph.constant(0)
    for u in segment.inputs:
        energy = energy + u * u
    observed = [*faces, energy, *segment.tracking]
    if frame is not None:
        columns = [[by_w[i][j] for i in range(n)] for j in range(nw)]
        framed = frame.substitute(graph, states, [*rates, *(e for c in columns for e in c), *unique, *observed])
        inner = [graph.variable(f"~{k}") for k in range(n)]
        variables[:n] = states = inner
        rates = frame.inverse_times(framed[:n])
        columns = [frame.inverse_times(framed[n + j * n : n + (j + 1) * n]) for j in range(nw)]
        by_w = [[columns[j][i] for j in range(nw)] for i in range(n)]
        unique = framed[n + n * nw : n + n * nw + len(unique)]
        observed = framed[n + n * nw + len(unique) :]
        faces = observed[: len(faces)]
    by_x = derivative(rates, states)
    jacobian = [e for row in by_x for e in row] + [e for row in by_w for e in row]
    roots = [e.index for row in (*by_x, *by_w) for e in row]
    linear = all(graph.nodes[k].op == CONST for k in roots)
    by_unknown = derivative(rates, unknowns) if linear and unknowns else []
    return Field(
        start=segment.start,
        end=segment.end,
        states=n,
        frame=frame,
        disturbances=nw,
        unknowns=len(unknowns),
        rates=compile_tape(rates, variables),
        jacobian=compile_tape([*jacobian, *unique], variables),
        observed=compile_tape(observed, variables),
        faces=tuple(face.name for face in segment.constraints),
        outputs=len(segment.tracking),
        linear=linear and not unique,
        steady=all(graph.nodes[k].op == CONST for k in roots[: n * n]),
        flat=linear and not any(e.depends_on([*states, *disturbance, *unknowns]) for row in by_unknown for e in row),
        full_w=bool(nw) and not affine,
        autonomous=not any(e.depends_on([loop.time]) for e in [*rates, *faces, *unique]),
        reads=tuple(frozenset(k for k in range(n) if rate.depends_on([states[k]])) for rate in rates),
        observed_states=frozenset(k for k in range(n) if any(e.depends_on([states[k]]) for e in [*faces, *unique])),
    )


def disturbance_box(box: Box | None) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Centre and half-widths (q,) of the disturbance set, rounded so that they cover it."""
    if box is None:
        return np.zeros(0), np.zeros(0)
    return cover(np.asarray(box.lo, float), np.asarray(box.hi, float))


def cover(lo: NDArray[np.float64], hi: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Centre c and radius r (float arrays) with [lo, hi] inside [c - r, c + r] exactly."""
    centre = np.where(lo == hi, lo, 0.5 * lo + 0.5 * hi)
    radius = np.maximum(hi - centre, centre - lo)
    exact = (lo == hi) | ((centre == 0.0) & (hi == -lo))
    return centre, np.where(exact, radius, np.nextafter(radius, np.inf))
