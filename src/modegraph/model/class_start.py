"""The start sets of a continuous class of references: traced over its parameters, proved to exist for all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from modegraph.errors import ModegraphError
from modegraph.expression.derivative import derivative
from modegraph.expression.repeatable import Comparison, impure, twice
from modegraph.expression.scalar import Expr, Graph
from modegraph.expression.tape import compile_tape
from modegraph.expression.trace import call
from modegraph.model.mode import Mode
from modegraph.model.reference import Floats, text_of
from modegraph.model.sets import Box, Ellipsoid, Set
from modegraph.model.sets.exact import fractions
from modegraph.model.sets.level_function import Irrational, exact_value
from modegraph.model.sets.parametrised import Condition, ParametrisedSet, TracedSet, numbers
from modegraph.model.start import checked_start, mode_start, require_dimension, require_same
from modegraph.model.traced_reference import TracedReference
from modegraph.model.trajectory import at_instant

MOST_CELLS = 4000
"""Parts of the class that are looked at before a question is left undecided."""

PLAINLY = 0.01
"""Relative difference of two sets that is no rounding any more."""


@dataclass(frozen=True, eq=False)
class StartClass:
    """S(p) for every p of ``region``, in exact arithmetic; each of them is a set that exists.

    Attributes
    ----------
    parameters : list[Expr]
        Variables, parallel to the coordinates of ``region``; ``set`` is traced in them.
    center : (n,) array
        A central point of the start set of the middle reference.
    """

    parameters: list[Expr]
    region: Box
    set: TracedSet
    center: Floats

    @property
    def dim(self) -> int:
        return self.set.dim

    @cached_property
    def is_affine(self) -> bool:
        """The centre is affine in the parameters and the axes do not depend on them."""
        moved = [e for row in derivative(self.set.centre, self.parameters) for e in row]
        return all(e.is_constant for e in [*moved, *(e for row in self.set.axes for e in row)])


def class_start(mode: Mode) -> StartClass | Set:
    """The start sets of a mode whose references are a continuous class; a Set where they are all the same.

    Raises
    ------
    ModegraphError
        If ``start`` cannot be traced, or a set is inverted, undefined or of the wrong dimension for
        some reference of the class, or that cannot be decided. Names the mode and the reference.
    """
    region = mode.reference.region
    assert region is not None
    owner = mode.label
    if isinstance(mode.start, Set):
        return checked_start(mode, mode.start, owner)
    graph = Graph()
    parameters = graph.variables([f"p[{k}]" for k in range(region.dim)])
    time = graph.variable("t")

    def read() -> TracedSet | Set:
        returned = returned_start(mode, graph, time, parameters)
        if not isinstance(returned, ParametrisedSet):
            return checked_start(mode, returned, owner)
        return returned.traced(graph, f"{owner}, start")

    traced = twice(read, _exprs, graph, f"{owner}, start")
    if isinstance(traced, Set):
        again = read()
        assert isinstance(again, Set)
        require_same(traced, again, owner)
        return traced
    require_dimension(mode, traced.dim, owner)
    entries = [*traced.centre, *(e for row in traced.axes for e in row)]
    dropped = [Expr(graph, k) for k in dict.fromkeys(graph.dropped)]
    _require_existence(entries, dropped, traced.conditions, parameters, region, f"{owner}, start")
    _require_faithful(mode, traced, parameters, region)
    middle = mode_start(mode, region.center)
    return StartClass(parameters, region, traced, np.asarray(middle.center, float))


def _exprs(traced: TracedSet | Set) -> list[Expr]:
    if isinstance(traced, Set):
        return []
    return [*traced.centre, *(e for row in traced.axes for e in row), *(c.expr for c in traced.conditions)]


def _require_faithful(mode: Mode, traced: TracedSet, parameters: list[Expr], region: Box) -> None:
    """Some of the sets computed with plain numbers must be those of the trace.

    Not the place for digits lost to rounding: what a proof needs of them is proved with it.
    """
    compare = Comparison([e for c, row in zip(traced.centre, traced.axes, strict=True) for e in (c, *row)], parameters)
    for p in (region.center, *(region.lo + part * (region.hi - region.lo) for part in (0.29, 0.83))):
        p = np.clip(p, region.lo, region.hi)
        instance = mode_start(mode, p)
        where = f"mode {mode.label_of(p)!r}, start"
        same = type(instance) is traced.kind
        if same and isinstance(instance, Ellipsoid) and traced.ellipsoid is not None:
            same = np.array_equal(instance.shape, traced.ellipsoid.shape)
        centre, axes = numbers(instance) if same else (np.zeros(0), np.zeros((0, 0)))
        called = np.column_stack([centre, axes]).ravel()
        there = compare.values(p)[0]
        close = called.shape == there.shape and np.abs(called - there).max() <= PLAINLY * (1.0 + np.abs(there).max())
        if not close and (called.shape != there.shape or compare.first_wrong(p, called) is not None):
            raise impure(
                where, f"for the reference {text_of(p)} it gives {instance!r}, which is not what its trace gives"
            )


def returned_start(mode: Mode, graph: Graph, time: Expr, parameters: list[Expr]) -> Any:
    """What the function ``start`` of a mode returns for the reference at t = 0, traced in these parameters."""
    first = mode.reference.pieces(graph, time, parameters, mode.label)[0]
    value, dot, ddot = (at_instant(part, time, 0.0) for part in (first.value, first.dot, first.ddot))
    reference = TracedReference.of(value, dot, ddot, parameters)
    assert callable(mode.start)
    return call(mode.start, {"r": reference}, role="start", owner=mode.label)


def _decided_exactly(condition: Condition, parameters: Sequence[Expr], region: Box, where: str) -> bool:
    """Whether a condition is affine in the parameters: then the worst corner of the class decides it, exactly."""
    slopes = derivative([condition.expr], parameters)[0]
    if not all(slope.is_constant for slope in slopes):
        return False
    corner = np.array([b if slope.value < 0 else a for slope, a, b in zip(slopes, region.lo, region.hi, strict=True)])
    try:
        worst = exact_value(condition.expr.graph, condition.expr.index, fractions(corner))
    except Irrational:
        return False
    if worst is None:
        return False
    if worst < 0:
        raise _empty(condition, corner, where)
    return True


def _empty(condition: Condition, p: Floats, where: str) -> ModegraphError:
    return ModegraphError(
        f"{where}: {condition.wrong} for the reference {text_of(p)}, so its start set is empty and everything would "
        "be true of it; correct the formula, or the class"
    )


def _require_existence(
    entries: Sequence[Expr],
    dropped: Sequence[Expr],
    conditions: Sequence[Condition],
    parameters: Sequence[Expr],
    region: Box,
    where: str,
) -> None:
    """Prove in intervals, over ever smaller parts of the class, that every entry is defined and every condition holds.

    Raises
    ------
    ModegraphError
        With a reference at which a condition is proved to fail, or for which nothing could be proved.
    """
    from modegraph.enclosure.intervals import IntervalEvaluator

    conditions = [c for c in conditions if not _decided_exactly(c, parameters, region, where)]
    ranges = IntervalEvaluator(compile_tape([*(c.expr for c in conditions), *entries, *dropped], parameters))
    count = len(conditions)

    def look(lo: Floats, hi: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """Ranges of the conditions (count, B) over parts (B, k), and where everything is defined and finite."""
        low, high, defined = ranges(np.ascontiguousarray(lo.T), np.ascontiguousarray(hi.T))
        return low[:count], high[:count], defined & np.isfinite(low).all(axis=0) & np.isfinite(high).all(axis=0)

    def refute(points: Floats) -> None:
        _, high, _ = look(points, points)
        for k, condition in enumerate(conditions):
            bad = np.flatnonzero(high[k] < 0.0)
            if len(bad):
                raise _empty(condition, points[bad[0]], where)

    lo, hi = region.lo[None], region.hi[None]
    corners = np.stack(np.meshgrid(*zip(region.lo, region.hi, strict=True), indexing="ij"), axis=-1)
    refute(corners.reshape(-1, region.dim))
    seen = 0
    while len(lo):
        low, _, defined = look(lo, hi)
        left = ~(defined & (low >= 0.0).all(axis=0))
        lo, hi, defined = lo[left], hi[left], defined[left]
        if not len(lo):
            return
        middle = np.clip(0.5 * lo + 0.5 * hi, lo, hi)
        refute(middle)
        seen += 2 * len(lo)
        axis = np.argmax((hi - lo) / np.maximum(region.hi - region.lo, 1e-300), axis=1)
        row = np.arange(len(lo))
        thin = ~((lo[row, axis] < middle[row, axis]) & (middle[row, axis] < hi[row, axis]))
        if seen > MOST_CELLS or thin.any():
            bad = int(np.argmax(~defined)) if not defined.all() else 0
            what = (
                "it is not proved that the start set is defined"
                if not defined.all()
                else f"it is undecided whether {' or '.join(dict.fromkeys(c.wrong for c in conditions))}"
            )
            raise ModegraphError(
                f"{where}: {what} near the reference {text_of(middle[bad])}; keep the formula away from that limit "
                "by a margin, or make the class smaller"
            )
        right = lo.copy()
        right[row, axis] = middle[row, axis]
        left_hi = hi.copy()
        left_hi[row, axis] = middle[row, axis]
        lo, hi = np.vstack([lo, right]), np.vstack([left_hi, hi])
