"""The start sets of a node as formulas, as exact numbers, and as the sets that a run enters.

For one reference p there are two: the formula in exact numbers, and what the user's function computes in floats.
They differ in last digits; what is claimed of a class must hold for both.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.targets.family import require_plain
from modegraph.enclosure.intervals import IntervalEvaluator
from modegraph.enclosure.rounding import TINY, UNIT
from modegraph.expression.array import is_traced, nested
from modegraph.expression.derivative import derivative
from modegraph.expression.scalar import Expr, Graph
from modegraph.expression.tape import compile_tape
from modegraph.model.class_start import StartClass, class_start, returned_start
from modegraph.model.mode import Mode
from modegraph.model.sets import Box, Polytope, Set, exact
from modegraph.model.sets.level_function import Irrational, exact_value
from modegraph.model.sets.parametrised import KINDS, ParametrisedSet, TracedSet
from modegraph.model.sets.rational import RationalSet
from modegraph.model.start import mode_start
from modegraph.model.target import Target
from modegraph.reach.start.class_chart import class_chart

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StartFamily:
    """S(p) for p in ``region`` (None: one set).

    Attributes
    ----------
    shape : TracedSet
        Centre and axes in the ``parameters``; constants where the set is one (of a Polytope, a point inside).
    plain : (n,) bool array
        Coordinates whose numbers are written as numbers: no float operation is between formula and set.
    allowance : (n,) array
        What a coordinate of the set computed in floats may be off from the formula.
    own : callable
        The set in floats for a reference (k,).
    """

    region: Box | None
    parameters: list[Expr]
    shape: TracedSet
    plain: NDArray[np.bool_]
    allowance: Floats
    own: Callable[[Floats], Set]

    @property
    def dim(self) -> int:
        return self.shape.dim

    @property
    def graph(self) -> Graph:
        return self.shape.centre[0].graph

    def bounds(self) -> tuple[Floats, Floats]:
        """The class as lo, hi (1, k)."""
        if self.region is None:
            return np.zeros((1, 0)), np.zeros((1, 0))
        return np.array(self.region.lo, float)[None], np.array(self.region.hi, float)[None]

    def covers(self, p: Floats) -> NDArray[np.bool_]:
        """Which references (B, k) belong to the class."""
        lo, hi = self.bounds()
        return np.asarray(((p >= lo) & (p <= hi)).all(axis=1))

    def functions(self, exprs: Sequence[Expr]) -> Functions:
        return Functions(list(exprs), self.parameters)

    def exact(self, p: Floats) -> RationalSet | Set | None:
        """The set of the formula for one reference (k,); None where it is undefined or not rational."""
        if self.shape.kind is Polytope:
            return self.own(p)
        shape, point = self.shape, exact.fractions(p)
        try:
            centre = [exact_value(self.graph, e.index, point) for e in shape.centre]
            rows = [[exact_value(self.graph, e.index, point) for e in row] for row in shape.axes]
        except Irrational:
            return None
        if any(v is None for v in [*centre, *(v for row in rows for v in row)]):
            return None
        middle = [Fraction(v) for v in centre if v is not None]
        generators = [[Fraction(v) for v in column if v is not None] for column in zip(*rows, strict=True)]
        if shape.round and shape.ellipsoid is None:
            return RationalSet(shape.kind, middle, [], radius=generators[0][0])
        return RationalSet(shape.kind, middle, generators, ellipsoid=shape.ellipsoid)


class Functions:
    """Ranges of functions of the parameters over boxes of them, with all roundings."""

    def __init__(self, exprs: list[Expr], parameters: list[Expr]) -> None:
        self.count = len(exprs)
        slopes = derivative(exprs, parameters)
        self.line: tuple[Floats, Floats] | None = None
        """Offsets (count,) and rates (count, k), nearest doubles, where all functions are affine."""
        zero = [Fraction(0)] * len(parameters)
        if all(e.is_constant for row in slopes for e in row):
            try:
                offsets = [exact_value(e.graph, e.index, zero) for e in exprs]
            except Irrational:
                offsets = [None]
            if all(v is not None for v in offsets):
                rates = [[float(e.value) for e in row] for row in slopes]
                self.line = (
                    np.array([float(v) for v in offsets if v is not None]),
                    np.array(rates).reshape(self.count, len(parameters)),
                )
        self._evaluate = None if self.line else IntervalEvaluator(compile_tape(exprs, parameters))

    def ranges(self, lo: Floats, hi: Floats) -> tuple[Floats, Floats]:
        """(B, count) from below and from above, over boxes (B, k)."""
        if self.line is None:
            assert self._evaluate is not None
            if not len(lo):
                return np.zeros((0, self.count)), np.zeros((0, self.count))
            low, high, _ = self._evaluate(np.ascontiguousarray(lo.T), np.ascontiguousarray(hi.T))
            return low.T, high.T
        offset, rates = self.line
        # Numbers rounded to doubles, a product and a sum of k + 1 terms: gamma(k + 4) of their sizes.
        size = np.abs(offset) + np.maximum(np.abs(lo), np.abs(hi)) @ self._sizes.T
        error = 2.0 * (rates.shape[1] + 4) * UNIT * size + TINY
        if lo is hi:
            middle = offset + lo @ rates.T
            return middle - error, middle + error
        up, down = self._signed
        return offset + lo @ up.T + hi @ down.T - error, offset + hi @ up.T + lo @ down.T + error

    @cached_property
    def _sizes(self) -> Floats:
        assert self.line is not None
        return np.abs(self.line[1])

    @cached_property
    def _signed(self) -> tuple[Floats, Floats]:
        assert self.line is not None
        return np.maximum(self.line[1], 0.0), np.minimum(self.line[1], 0.0)


def start_family(mode: Mode | Target, p: Floats | None) -> StartFamily | None:
    """The start sets of a node: of a Target, of a mode under the reference p, or (p = None) under a whole class.

    None where they are not of a kind that can be traced.

    Raises
    ------
    ModegraphError
        Where the sets in floats are not those of the formula.
    """
    if isinstance(mode, Target):
        return _one(mode.set, None)
    if mode.reference.region is None or p is not None:
        return _one(mode_start(mode, p), None)
    start = class_start(mode)
    if isinstance(start, Set):
        return _one(start, mode.reference.region)
    require_plain(mode, start)
    graph = Graph()
    parameters = graph.variables([f"p[{k}]" for k in range(start.region.dim)])
    returned = returned_start(mode, graph, graph.variable("t"), parameters)
    assert isinstance(returned, ParametrisedSet)
    shape = returned.traced(graph, mode.label)
    return StartFamily(
        start.region, parameters, shape, _plain(returned, shape), _allowance(start), lambda q: mode_start(mode, q)
    )


def _allowance(start: StartClass) -> Floats:
    chart = class_chart(start, np.zeros(0), np.zeros(0))
    assert chart.rounded is not None
    return np.asarray(chart.rounded)


def _one(region: Set, references: Box | None) -> StartFamily | None:
    """One set for all references."""
    if type(region) not in (*KINDS, Polytope):
        return None
    graph = Graph()
    count = 0 if references is None else references.dim
    parameters = graph.variables([f"p[{k}]" for k in range(count)])
    if isinstance(region, Polytope):
        middle = [graph.constant(float(v)) for v in region.chebyshev[0]]
        shape = TracedSet(Polytope, middle, [[] for _ in middle], False, None, ())
    else:
        given = [getattr(region, name) for name in region._fields]
        shape = ParametrisedSet(type(region), given, {}).traced(graph, "start")
    n = shape.dim
    return StartFamily(references, parameters, shape, np.ones(n, bool), np.zeros(n), lambda q: region)


def _plain(returned: ParametrisedSet, shape: TracedSet) -> NDArray[np.bool_]:
    """Coordinates that no traced value is in."""
    n = shape.dim

    def written(value: Any) -> NDArray[np.bool_]:
        entries = nested(value)
        if entries.ndim == 0 or len(entries) != n:
            return np.full(n, not is_traced([entries]))
        return np.array([not is_traced([entry]) for entry in entries])

    known = [written(value) for name, value in returned.given.items() if name not in ("self", "shape")]
    return np.asarray(np.logical_and.reduce(known))
