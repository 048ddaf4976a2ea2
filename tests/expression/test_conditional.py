"""Case distinctions: continuous ones lose the `where`, the others keep it."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from modegraph.expression import Evaluator, Expr, Graph, compile_tape
from modegraph.expression.tape import WHERE

CONTINUOUS: list[Callable[[Any, Any], Any]] = [
    lambda x, y: np.where(x > 1, 1.0, np.where(x < -1, -1.0, x)),
    lambda x, y: np.where(x < 0.5, x**2, x - 0.25),
    lambda x, y: np.where(x >= y, x - y, 0.0),
    lambda x, y: np.where(x > y, x, y),
    lambda x, y: np.where(abs(x) <= 1, x, np.where(x > 1, 1.0, -1.0)),
    lambda x, y: np.where(x > 0, x * np.sin(y), x * y),
    lambda x, y: np.where(x > 0, x / (1 + y * y), 0.0),
]
DISCONTINUOUS: list[Callable[[Any, Any], Any]] = [
    lambda x, y: np.where(x > 0, 1.0, -1.0),
    lambda x, y: np.where(x > 1, x, y),
    lambda x, y: np.where(x >= 0, x + 1e-9, x),
    lambda x, y: np.sign(x * y),
]


def compare(fn: Callable[[Any, Any], Any]) -> bool:
    """Whether a `where` is left, after checking the values."""
    g = Graph()
    x, y = g.variables("xy")
    tape = compile_tape([fn(x, y)], [x, y])
    points = np.concatenate(
        [np.random.default_rng(0).uniform(-2, 2, (2, 300)), np.array([[0, 1, -1, 0.5], [0, 1, -1, 0.5]])],
        axis=1,
    )
    np.testing.assert_allclose(Evaluator(tape)(points)[0], fn(*points), rtol=1e-12, atol=1e-12)
    return bool(np.any(tape.ops[:, 0] == WHERE))


@pytest.mark.parametrize("fn", [f for k, f in enumerate(CONTINUOUS) if k != 4])
def test_continuous(fn: Callable[[Any, Any], Any]) -> None:
    assert not compare(fn)


@pytest.mark.parametrize("fn", [*DISCONTINUOUS, CONTINUOUS[4]])
def test_not_proved_continuous(fn: Callable[[Any, Any], Any]) -> None:
    assert compare(fn)


def test_strictness_is_exact() -> None:
    g = Graph()
    x = g.variable("x")
    exprs: list[Expr] = [np.where(x > 0, 1.0, 2.0), np.where(x >= 0, 1.0, 2.0), np.where(x < 0, 1.0, 2.0)]
    assert Evaluator(compile_tape(exprs, [x]))(np.array([0.0])).tolist() == [2, 1, 2]


def test_a_cancelled_pole_is_remembered() -> None:
    g = Graph()
    x, y = g.variables("xy")
    e = np.where(x > 0, x * (y - 1) / (y - 1), 0.0)
    assert not any(node.op == WHERE for node in g.nodes)
    assert e.text() == "maximum(x, 0)"
    assert g.dropped


def test_concrete_conditions_choose() -> None:
    x = Graph().variable("x")
    assert np.where(True, x, 0.0).same(x)
    assert np.where(x.graph.constant(1) > 2, x, 0.0).value == 0


def test_a_choice_of_high_degree_is_no_endless_recursion() -> None:
    # (x^1500 - 1) / (x - 1) has 1500 terms, and nested as many levels.
    x, y = Graph().variables("xy")
    assert "where(" in np.where(x > 1, x**1500 - 1, 0 * y).text(400)
