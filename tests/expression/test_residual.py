"""Fractions written as quotient and rest: the same numbers, and a small rest."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from modegraph.expression.ops import RECIP
from modegraph.expression.residual import residual
from modegraph.expression.scalar import Expr, Graph
from modegraph.expression.trace import call
from modegraph.model.sets.level_function import exact_value

WORK = 1e6


def traced(function: Callable[..., Any], count: int) -> tuple[Graph, list[Expr], list[Expr]]:
    graph = Graph()
    x = graph.variables([f"x[{k}]" for k in range(count)])
    value = call(function, {"x": np.array(x, dtype=object)}, role="test", owner="")
    return graph, x, list(value) if isinstance(value, np.ndarray) else [value]


def typical(count: int, lo: float = -1.0, hi: float = 1.0) -> np.ndarray:
    return np.random.default_rng(0).uniform(lo, hi, (count, 8))


def same(graph: Graph, a: Expr, b: Expr, count: int) -> bool:
    rng = np.random.default_rng(1)
    for row in rng.integers(-40, 41, (20, count)):
        point = [Fraction(int(v), 16) for v in row]
        left, right = exact_value(graph, a.index, point), exact_value(graph, b.index, point)
        if left is not None and left != right:
            return False
    return True


def near_model(x: Any) -> Any:
    """(d + e) v / d with d = 2 + x1^2, v = 3 x0 - x2, e = .1 x1."""
    return ((2.0 + x[1] ** 2) * (3.0 * x[0] - x[2]) + 0.1 * x[1]) / (2.0 + x[1] ** 2)


def test_what_a_controller_inverts_comes_out() -> None:
    graph, x, (e,) = traced(near_model, 3)
    (found,) = residual([e], x, typical(3), [], work=WORK)
    assert not found.same(e)
    assert same(graph, e, found, 3)
    # What is multiplied with the reciprocal is the rest alone.
    reached = graph.reachable([found.index])
    products = [k for k in reached if any(graph.nodes[j].op == RECIP for j in graph.nodes[k][1:3] if j >= 0)]
    assert products
    point = [Fraction(1), Fraction(1, 2), Fraction(1)]
    assert exact_value(graph, e.index, point) > 2
    assert max(abs(exact_value(graph, k, point) or 0) for k in products) <= Fraction(1, 4)


def test_an_unknown_constant_is_taken_at_its_middle() -> None:
    """(m0 + c^2) v / (m + c^2), m near m0: the quotient is v although nothing divides."""
    function = lambda x: (1.0 + x[1] ** 2) * x[0] / (x[2] + x[1] ** 2)
    graph, x, (e,) = traced(function, 3)
    values = typical(3)
    values[2] = np.linspace(0.9, 1.1, 8)
    (plain,) = residual([e], x, values, [], work=WORK)
    (found,) = residual([e], x, values, [x[2]], work=WORK)
    assert plain.same(e)
    assert not found.same(e)
    assert same(graph, e, found, 3)


@pytest.mark.parametrize(
    "function",
    [
        lambda x: x[0] / (2.0 + x[1] ** 2),
        lambda x: (x[0] + 5.0 * x[2]) / (2.0 + x[1]),
        lambda x: x[0] * x[1] + np.sin(x[2]),
        lambda x: np.maximum(x[0], 0.0) / (3.0 + x[2]),
    ],
)
def test_a_fraction_without_a_small_rest_stays(function: Callable[..., Any]) -> None:
    _, x, (e,) = traced(function, 3)
    (found,) = residual([e], x, typical(3), [], work=WORK)
    assert found.same(e)


def test_sizes_that_are_not_finite_prove_nothing_and_change_nothing() -> None:
    _, x, (e,) = traced(near_model, 3)
    (found,) = residual([e], x, np.full((3, 4), np.nan), [], work=WORK)
    assert found.same(e)


def test_without_work_everything_stays() -> None:
    _, x, (e,) = traced(near_model, 3)
    assert residual([e], x, typical(3), [], work=0.0)[0].same(e)
    assert residual([], x, typical(3), [], work=WORK) == []


def test_random_fractions_keep_their_values() -> None:
    rng = np.random.default_rng(5)
    changed = 0
    for _ in range(25):
        a, b, c = rng.integers(-3, 4, 3).tolist()

        def function(x: Any, a: int = a, b: int = b, c: int = c) -> Any:
            d = 2.0 + x[0] ** 2 + (a * x[1]) ** 2
            return np.array([(d * (x[2] + b * x[3]) + 0.2 * c * x[3]) / d, (d**2 + x[2]) / (d * (3.0 + x[3] ** 2))])

        graph, x, exprs = traced(function, 4)
        found = residual(exprs, x, typical(4), [x[1]], work=WORK)
        for e, new in zip(exprs, found, strict=True):
            changed += not e.same(new)
            assert same(graph, e, new, 4)
    assert changed > 10
