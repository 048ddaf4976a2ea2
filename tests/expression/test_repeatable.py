"""Traces held against a second one, and against the function itself."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from typing import Any

import numpy as np
import pytest

from modegraph.errors import ModegraphError
from modegraph.expression.array import TracedArray
from modegraph.expression.repeatable import Comparison, twice
from modegraph.expression.scalar import Expr, Graph


def traced(fn: Callable[..., Any]) -> tuple[Graph, list[Expr], list[Expr]]:
    graph = Graph()
    x = graph.variables(["x", "y"])
    return graph, x, twice(lambda: [fn(TracedArray(x))], list, graph, "here")


def test_a_function_of_its_arguments_is_traced_once() -> None:
    graph, x, (expr,) = traced(lambda x: np.where(x[0] > 0, np.clip(x[1], -1, 1), abs(x[0])) / x[1])
    assert expr.depends_on(x)
    assert len(graph.dropped) == len(set(graph.dropped))


def test_the_second_trace_leaves_no_obligation_of_its_own() -> None:
    graph, _, _ = traced(lambda x: 0 * (1 / x[0]) + x[1])
    assert len(graph.dropped) == 1


def test_what_folding_learns_on_the_way_is_no_difference() -> None:
    # The square of 2 max(x, 0) - x is x^2 as soon as somebody has called the same thing abs(x).
    def fn(x: Any) -> Any:
        by_hand = (2 * np.maximum(x[0], 0) - x[0]) ** 2
        return by_hand + abs(x[0])

    assert len(traced(fn)[2]) == 1


@pytest.mark.parametrize("how", ["noise", "counter", "memory", "growing"])
def test_what_changes_between_calls_is_refused(how: str) -> None:
    calls, kept = count(), []
    rng = np.random.default_rng(1)

    def refuse() -> None:
        raise ModegraphError("not again")

    def fn(x: Any) -> Any:
        kept.append(x[0])
        return {
            "noise": lambda: x[0] + 1e-13 * rng.standard_normal(),
            "counter": lambda: x[0] * next(calls),
            "memory": lambda: sum(kept),
            "growing": lambda: x[0] if len(kept) == 1 else refuse(),
        }[how]()

    with pytest.raises(ModegraphError, match=r"^here does not depend on its arguments alone: called .*random"):
        traced(fn)


def test_values_are_compared_within_rounding() -> None:
    graph = Graph()
    x = graph.variables(["x", "y"])
    compare = Comparison([x[0] * 3, x[1] + x[0]], x)
    point = np.array([0.1, 0.2])
    assert compare.first_wrong(point, np.array([0.1 * 3, 0.1 + 0.2])) is None
    assert compare.first_wrong(point, np.array([0.3, 0.3 + 1e-5])) == 1
    assert compare.first_wrong(point, np.array([0.3 + 1e-5]), slice(0, 1)) == 0
    assert compare.first_wrong(point, np.array([0.3]), slice(0, 1)) is None
    assert compare.first_wrong(point, np.array([np.nan, 0.3])) is None


def test_on_a_jump_both_sides_are_right_but_nothing_else() -> None:
    graph = Graph()
    x = graph.variables(["x"])
    compare = Comparison([np.sign(x[0])], x)
    at = np.array([0.0])
    assert all(compare.first_wrong(at, np.array([value])) is None for value in (-1.0, 0.0, 1.0))
    assert compare.first_wrong(np.array([0.1]), np.array([-1.0])) == 0


def test_a_point_where_the_trace_is_undefined_says_nothing() -> None:
    graph = Graph()
    x = graph.variables(["x"])
    assert Comparison([np.log(x[0])], x).first_wrong(np.array([-1.0]), np.array([5.0])) is None
