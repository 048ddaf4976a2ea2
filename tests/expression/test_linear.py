"""Matrices of traced entries against NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from modegraph.errors import ModegraphError
from modegraph.expression import Evaluator, Graph, TracedArray, compile_tape
from modegraph.expression.linear import DIVISION_FREE, cross, det, inv, norm, solve
from modegraph.expression.ops import RECIP

SIZES = [1, 2, 3, DIVISION_FREE, DIVISION_FREE + 1]


def traced(n: int) -> tuple[Graph, TracedArray, np.ndarray]:
    """A matrix of variables, and well-conditioned numbers for them."""
    graph = Graph()
    matrix = TracedArray(graph.variables([f"a{k}" for k in range(n * n)])).reshape(n, n)
    return graph, matrix, np.random.default_rng(n).uniform(-1.0, 1.0, (n, n)) + 2.0 * np.eye(n)


def evaluated(result: Any, matrix: TracedArray, values: np.ndarray) -> np.ndarray:
    """Values (k,) of what was made of a traced matrix."""
    outputs = np.atleast_1d(np.asarray(result, dtype=object)).reshape(-1)
    return Evaluator(compile_tape(list(outputs), list(matrix.reshape(-1))))(values.reshape(-1, 1))[:, 0]


@pytest.mark.parametrize("n", SIZES)
def test_against_numpy(n: int) -> None:
    _, matrix, values = traced(n)
    right = np.arange(1.0, 2 * n + 1.0).reshape(n, 2)
    assert evaluated(inv(matrix), matrix, values) == pytest.approx(np.linalg.inv(values).reshape(-1))
    assert evaluated(solve(matrix, right), matrix, values) == pytest.approx(np.linalg.solve(values, right).reshape(-1))
    assert evaluated(det(matrix), matrix, values) == pytest.approx([np.linalg.det(values)])


@pytest.mark.parametrize("n", [2, DIVISION_FREE])
def test_the_determinant_is_the_only_denominator(n: int) -> None:
    graph, matrix, _ = traced(n)
    solve(matrix, np.ones(n))
    denominators = [node.a for node in graph.nodes if node.op == RECIP]
    assert denominators == [det(matrix).index]


def test_structural_zeros_and_constant_pivots_cost_nothing() -> None:
    """A triangle with a constant diagonal has no denominator at all."""
    n = DIVISION_FREE + 2
    graph, matrix, _ = traced(n)
    triangle = np.where(np.triu(np.ones((n, n)), 1) > 0, np.asarray(matrix, dtype=object), 2.0 * np.eye(n))
    inv(TracedArray(triangle))
    assert not any(node.op == RECIP for node in graph.nodes)
    singular = triangle.copy()
    singular[n - 1, n - 1] = 0.0
    with pytest.raises(ModegraphError, match=f"singular \\(column {n - 1}\\)"):
        inv(TracedArray(singular))


def test_norms_and_cross_products() -> None:
    _, matrix, values = traced(3)
    row, other = matrix[0], matrix[1]
    for order, wanted in ((None, 2), (2, 2), (1, 1), (np.inf, np.inf)):
        assert evaluated(norm(row, order), matrix, values) == pytest.approx([np.linalg.norm(values[0], wanted)])
    assert evaluated(norm(matrix, axis=0), matrix, values) == pytest.approx(np.linalg.norm(values, axis=0))
    assert evaluated(cross(row, other), matrix, values) == pytest.approx(np.cross(values[0], values[1]))


def test_wrong_shapes_are_named() -> None:
    _, matrix, _ = traced(3)
    with pytest.raises(ModegraphError, match=r"np.linalg.det needs a square matrix, got shape \(2, 3\)"):
        det(matrix[:2])
    with pytest.raises(ModegraphError, match=r"right-hand side has shape \(2,\), the matrix \(3, 3\)"):
        solve(matrix, np.ones(2))
    with pytest.raises(ModegraphError, match="two vectors of 3 entries"):
        cross(matrix[0], matrix[0, :2])
    with pytest.raises(ModegraphError, match="ord=2"):
        norm(matrix, 2)
