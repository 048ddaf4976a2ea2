"""Determinants, inverses and linear systems of small traced matrices.

Up to `DIVISION_FREE` rows by minors: the determinant is the only denominator, so nothing is assumed
about pivots. Larger systems are eliminated; every pivot is then a denominator of its own.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from modegraph.errors import ModegraphError
from modegraph.expression import functions
from modegraph.expression.array import Objects, graph_of, nested, wrap
from modegraph.expression.scalar import Expr, Graph
from modegraph.expression.ufuncs import lift

DIVISION_FREE = 4


def _square(matrix: Any, name: str) -> tuple[Graph, Objects]:
    graph = graph_of([matrix])
    assert graph is not None
    return graph, _entries(graph, matrix, name)


def _entries(graph: Graph, matrix: Any, name: str) -> Objects:
    objects = nested(matrix)
    if objects.ndim != 2 or objects.shape[0] != objects.shape[1] or not objects.size:
        raise ModegraphError(f"np.linalg.{name} needs a square matrix, got shape {objects.shape}")
    result = np.empty(objects.shape, dtype=object)
    for index in np.ndindex(objects.shape):
        result[index] = lift(graph, objects[index])
    return result


class _Minors:
    """Minors of a matrix by rows and columns, each computed once."""

    def __init__(self, graph: Graph, matrix: Objects) -> None:
        self._graph = graph
        self._matrix = matrix
        self._known: dict[tuple[tuple[int, ...], tuple[int, ...]], Expr] = {}

    def __call__(self, rows: tuple[int, ...], columns: tuple[int, ...]) -> Expr:
        if not rows:
            return self._graph.constant(1)
        key = (rows, columns)
        if key not in self._known:
            total = self._graph.constant(0)
            for k, column in enumerate(columns):
                entry = self._matrix[rows[0], column]
                if entry.is_constant and entry.value == 0:
                    continue
                term = entry * self(rows[1:], columns[:k] + columns[k + 1 :])
                total = total - term if k % 2 else total + term
            self._known[key] = total
        return self._known[key]


def det(matrix: Any) -> Expr:
    """Determinant, division-free."""
    graph, m = _square(matrix, "det")
    everything = tuple(range(len(m)))
    return _Minors(graph, m)(everything, everything)


def inv(matrix: Any) -> Any:
    """Inverse; the determinant (or a pivot) must be proved nonzero where it is used."""
    graph, m = _square(matrix, "inv")
    if len(m) > DIVISION_FREE:
        return wrap(_eliminate(graph, m, _entries(graph, np.eye(len(m)), "inv"), "inv"))
    adjugate, reciprocal = _adjugate(graph, m, "inv")
    return wrap(adjugate * reciprocal)


def solve(matrix: Any, right: Any) -> Any:
    """Solution of a square system for one right-hand side (n,) or several (n, k)."""
    graph = graph_of([matrix, right])
    assert graph is not None
    m = _entries(graph, matrix, "solve")
    objects = nested(right)
    if objects.ndim not in (1, 2) or len(objects) != len(m):
        raise ModegraphError(f"np.linalg.solve: the right-hand side has shape {objects.shape}, the matrix {m.shape}")
    columns = np.empty((len(m), objects.size // len(m)), dtype=object)
    for index in np.ndindex(columns.shape):
        columns[index] = lift(graph, objects.reshape(columns.shape)[index])
    if len(m) > DIVISION_FREE:
        result = _eliminate(graph, m, columns, "solve")
    else:
        adjugate, reciprocal = _adjugate(graph, m, "solve")
        result = (adjugate @ columns) * reciprocal
    return wrap(result.reshape(objects.shape))


def _adjugate(graph: Graph, m: Objects, name: str) -> tuple[Objects, Expr]:
    everything = tuple(range(len(m)))
    minors = _Minors(graph, m)
    determinant = minors(everything, everything)
    adjugate = np.empty(m.shape, dtype=object)
    for i in everything:
        for j in everything:
            minor = minors(everything[:j] + everything[j + 1 :], everything[:i] + everything[i + 1 :])
            adjugate[i, j] = -minor if (i + j) % 2 else minor
    note = f"the determinant of np.linalg.{name} reaches 0: {determinant.text(60)}"
    return adjugate, Expr(graph, graph.recip(determinant.index, note))


def _eliminate(graph: Graph, m: Objects, right: Objects, name: str) -> Objects:
    """Gauss-Jordan elimination; constant pivots are preferred, structural zeros skipped."""
    m, right = m.copy(), right.copy()
    for k in range(len(m)):
        pivot = min(range(k, len(m)), key=lambda i: _pivot_rank(m[i, k]))
        if _pivot_rank(m[pivot, k]) == _ZERO_PIVOT:
            raise ModegraphError(f"np.linalg.{name}: the matrix is singular (column {k})")
        m[[k, pivot]], right[[k, pivot]] = m[[pivot, k]], right[[pivot, k]]
        note = f"pivot {k} of np.linalg.{name} reaches 0: {m[k, k].text(60)}"
        reciprocal = Expr(graph, graph.recip(m[k, k].index, note))
        m[k], right[k] = m[k] * reciprocal, right[k] * reciprocal
        for i in range(len(m)):
            factor = m[i, k]
            if i != k and not (factor.is_constant and factor.value == 0):
                m[i], right[i] = m[i] - factor * m[k], right[i] - factor * right[k]
    return right


_ZERO_PIVOT = 2


def _pivot_rank(entry: Expr) -> int:
    if not entry.is_constant:
        return 1
    return 0 if entry.value else _ZERO_PIVOT


def norm(x: Any, ord: Any = None, axis: int | None = None, keepdims: bool = False) -> Any:
    """2-norm of a vector (Frobenius of a matrix), or ord 1 and infinity of a vector."""
    objects = nested(x)
    graph = graph_of([objects])
    assert graph is not None
    if keepdims or (axis is not None and not isinstance(axis, int)):
        raise ModegraphError("np.linalg.norm of traced values takes one axis, without keepdims")
    if axis is not None and objects.ndim > 1:
        moved = np.moveaxis(objects, axis, -1)
        result = np.empty(moved.shape[:-1], dtype=object)
        for index in np.ndindex(result.shape):
            result[index] = norm(moved[index], ord)
        return wrap(result)
    entries = [lift(graph, e) for e in objects.flat]
    if ord in (None, 2, "fro") and (objects.ndim == 1 or ord != 2):
        return functions.sqrt(sum((e * e for e in entries), graph.constant(0)))
    if objects.ndim == 1 and ord == 1:
        return sum((abs(e) for e in entries), graph.constant(0))
    if objects.ndim == 1 and ord == np.inf:
        largest = abs(entries[0])
        for entry in entries[1:]:
            largest = functions.maximum(largest, abs(entry))
        return largest
    raise ModegraphError(f"np.linalg.norm with ord={ord!r} of traced values is not supported; write the norm out")


def cross(a: Any, b: Any) -> Any:
    """Cross product of two vectors of three entries."""
    p, q = nested(a), nested(b)
    if p.shape != (3,) or q.shape != (3,):
        raise ModegraphError(f"np.cross of traced values needs two vectors of 3 entries, got {p.shape} and {q.shape}")
    result = np.empty(3, dtype=object)
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        result[k] = p[i] * q[j] - p[j] * q[i]
    return wrap(result)
