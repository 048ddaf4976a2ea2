"""Injection by name, and errors that name owner, role, line and remedy."""

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from modegraph.errors import ModegraphError
from modegraph.expression import Expr, Graph, TracedArray, arguments, as_vector, call, required_arguments


def traced(fn: Callable[..., Any], **available: Any) -> Any:
    return call(fn, available, role="controller", owner="mode 'gentle'")


class Controller:
    def __init__(self, gain: float) -> None:
        self.gain = gain

    def act(self, x: Any) -> Any:
        return -self.gain * x

    def __call__(self, r: Any, x: Any) -> Any:
        return self.gain * (r - x)


def test_arguments_come_by_name() -> None:
    assert traced(lambda r, x: x - r, x=3, r=1, t=0) == 2
    assert traced(Controller(2).act, x=3) == -6
    assert traced(Controller(2), x=3, r=4) == 2
    assert traced(functools.partial(lambda x, k: k * x, k=5), x=3) == 15
    assert traced(functools.partial(lambda k, x: k * x, 5), x=3) == 15
    assert traced(lambda x, K=7: K * x, x=3) == 21
    assert traced(lambda x, r=0: x - r, x=3, r=1) == 2
    assert traced(functools.partial(lambda x, r: x - r, r=0), x=3, r=1) == 3
    assert traced(lambda x, /: x, x=3) == 3
    assert traced(lambda *, x: x, x=3) == 3


def test_required_arguments() -> None:
    assert required_arguments(lambda x, t, k=1: x) == ["x", "t"]
    assert arguments(lambda t, x: t, {"x": 1, "t": 2, "r": 3}, role="f", owner="") == ([], {"t": 2, "x": 1})


@pytest.mark.parametrize(
    ("fn", "words"),
    [
        (lambda x, q: 0, ["unknown argument 'q'", "may read x, r", "q=q"]),
        (lambda *args: 0, ["takes *args", "name the arguments"]),
        (lambda x, **more: 0, ["takes **more"]),
        (3, ["expected a function"]),
        (lambda x: math.sin(x[0]), ["np.sin", "test_trace.py line"]),
        (lambda x: 1.0 if x[0] > 0 else 2.0, ["np.where"]),
        (lambda x: np.where(0 < x[0] < 1, 1.0, 2.0), ["chained comparison"]),
        (lambda x: x[9], ["IndexError", "exceeds the number"]),
        (lambda x: x[0][0], ["single number was indexed"]),
        (lambda x: {}["gain"], ["KeyError"]),
    ],
)
def test_misuse_is_explained(fn: Any, words: list[str]) -> None:
    x = TracedArray(Graph().variables("ab"))
    with pytest.raises(ModegraphError) as caught:
        traced(fn, x=x, r=0)
    text = str(caught.value)
    assert text.startswith("mode 'gentle', controller")
    for word in words:
        assert word in text


def test_foreign_arrays_are_explained() -> None:
    buffer = np.zeros(2)

    def into(x: Any) -> Any:
        buffer[0] = x[0]
        return buffer

    with pytest.raises(ModegraphError, match=r"np\.zeros"):
        traced(into, x=TracedArray(Graph().variables("ab")))


def vector(value: Any, length: int | None = 2, graph: Graph | None = None) -> list[Expr]:
    return as_vector(value, length, role="controller", owner="mode 'm'", graph=graph or Graph())


def test_vectors() -> None:
    g = Graph()
    x, y = g.variables("xy")
    for value in ([x, y], (x, y), np.array([x, y]), TracedArray([x, y])):
        assert [e.text() for e in vector(value, graph=g)] == ["x", "y"]
    assert [e.text() for e in vector(x, 1, g)] == ["x"]
    assert [e.value for e in vector(np.array([1.5, 2]))] == [1.5, 2]
    assert [e.value for e in vector(3, 1)] == [3]
    assert vector(np.array(3.0), None)[0].value == 3


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (None, "return"),
        ([1.0], "returned 1 entry, expected 2"),
        (1.0, "returned 1 entry, expected 2"),
        ([1.0, 2.0, 3.0], "returned 3 entries"),
        (np.zeros((2, 1)), r"shape \(2, 1\)"),
        ([1.0, float("nan")], "entry 1 is nan"),
        ([np.inf, 0.0], "entry 0 is inf"),
        (["a", 1], "not a number"),
        ([1j, 0], "not a number"),
        ([[1.0], 2.0], "different shapes|shapes"),
        ([Graph().variable("x") <= 1, 0.0], "relation"),
        ([Graph().variable("x"), 0.0], "another call"),
    ],
)
def test_bad_vectors(value: Any, words: str) -> None:
    with pytest.raises(ModegraphError, match=words) as caught:
        vector(value)
    assert str(caught.value).startswith("mode 'm', controller")


def test_tracing_makes_few_nodes() -> None:
    def arm(x: Any) -> Any:
        q, w = x[:2], x[2:]
        c, s = np.cos(q[1]), np.sin(q[1])
        m = np.array([[5 / 3 + c, 1 / 3 + 0.5 * c], [1 / 3 + 0.5 * c, 1 / 3]])
        k = np.array([[-0.5 * s * w[1], -0.5 * s * (w[0] + w[1])], [0.5 * s * w[0], 0]])
        v = -16 * q - 8 * w
        return np.concatenate([w, np.linalg.solve(m, m @ v + k @ w - k @ w)])

    graph = Graph()
    traced(arm, x=TracedArray(graph.variables("abcd")))
    assert len(graph.nodes) < 80
