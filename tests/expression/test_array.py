"""Plain NumPy code on traced arrays equals the same code on floats."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from modegraph.errors import ModegraphError
from modegraph.expression import Evaluator, Expr, Graph, TracedArray, as_vector, call, compile_tape
from modegraph.expression.relation import Relation

Function = Callable[[Any], Any]


def evaluate(fn: Function, points: np.ndarray) -> np.ndarray:
    """Trace `fn` of a vector and evaluate it at the columns of `points`."""
    g = Graph()
    x = TracedArray(g.variables([f"x{k}" for k in range(len(points))]))
    result = call(fn, {"x": x}, role="function", owner="test")
    vector = as_vector(np.ravel(result), None, role="function", owner="test", graph=g)
    return Evaluator(compile_tape(vector, list(x)))(points)


def assert_same(fn: Function, n: int = 4, low: float = 0.5, high: float = 1.5) -> None:
    points = np.random.default_rng(0).uniform(low, high, (n, 5))
    expected = np.array([np.ravel(fn(column)) for column in points.T], dtype=float).T
    np.testing.assert_allclose(evaluate(fn, points), expected, rtol=1e-9, atol=1e-12)


def assigned(x: Any) -> Any:
    a = np.zeros(3)
    a[0] = x[1]
    a[1:] = x[:2] * 2
    a[2] = x[3:].sum()
    a += np.ones(3) * x[0]
    return a


def filled(x: Any) -> Any:
    m = np.zeros_like(x) + np.ones_like(x) + np.full(4, x[0]) + np.full_like(x, 2.0) + np.empty_like(x) * 0
    b = np.eye(2)
    b[0, 1] = x[0]
    c = np.array([0.0, 0.0])
    c[1] = x[2]
    return np.concatenate([m, b.ravel(), c, np.full((2,), 3.0), np.identity(2)[0] * x[:2]])


def joined(x: Any) -> Any:
    return np.concatenate(
        [
            np.stack([x[0], x[1]]),
            np.hstack([x[:2], 1.0]),
            np.vstack([x[:2], x[2:]]).ravel(),
            np.column_stack([x[:2], x[2:]]).T.ravel(),
            np.block([[np.diag(x[:2]), np.zeros((2, 1))], [x[1:3][None, :], np.ones((1, 1))]]).ravel(),
            np.atleast_1d(x[0]),
            np.append(x, 1.0),
            np.r_[x[0], -x[1], 2.0],
            np.roll(x, 1),
            np.repeat(x[0], 2),
            np.tile(x[:2], 2),
            np.diag(np.outer(x, x)),
            x.reshape(2, 2).T.ravel(),
        ]
    )


def reduced(x: Any) -> Any:
    m = x.reshape(2, 2)
    return np.hstack(
        [
            x.sum(),
            x.mean(),
            x.prod(),
            x.max(),
            x.min(),
            np.sum(m, axis=0),
            np.max(m, axis=1),
            np.cumsum(x),
            np.diff(x),
        ]
    )


def products(x: Any) -> Any:
    m = np.array([[x[0], 1.0], [2.0, x[1]]])
    return np.hstack(
        [
            m @ x[:2],
            x[:2] @ m,
            (m @ m).ravel(),
            np.dot(m, x[2:]),
            x.dot(x),
            np.inner(x, x),
            np.outer(x, x).ravel(),
            np.matmul(m, m).ravel(),
            np.cross(x[:3], x[1:]),
            np.kron(x[:2], x[2:]),
            np.einsum("ij,j", m, x[:2]),
            np.trace(m),
            np.vdot(x, x),
            np.linalg.matrix_power(m, 3).ravel(),
            np.array([[1.0, 2.0], [3.0, 4.0]]) @ x[:2],
        ]
    )


def linear_algebra(x: Any) -> Any:
    two = np.array([[x[0] + 2, x[1]], [x[1], x[2] + 1]])
    three = np.diag(x[:3]) + np.ones((3, 3))
    four = np.outer(x, x) + 2 * np.eye(4)
    return np.hstack(
        [
            np.linalg.solve(two, x[:2]),
            np.linalg.solve(two, np.eye(2)).ravel(),
            np.linalg.inv(two).ravel(),
            np.linalg.inv(three) @ x[1:],
            np.linalg.det(three),
            np.linalg.solve(four, x),
            np.linalg.det(four),
            np.linalg.solve([[x[0], 1.0], [0.0, 2.0]], [1.0, x[1]]),
            np.linalg.solve(np.array([[2.0, 1.0], [0.0, 2.0]]), x[:2]),
            np.linalg.norm(x),
            np.linalg.norm(x, 1),
            np.linalg.norm(x - 1, np.inf),
            np.linalg.norm(two),
            np.linalg.norm(two, axis=1),
        ]
    )


def larger_system(x: Any) -> Any:
    a = np.eye(6) * 3
    a[0, 1], a[3, 2], a[5, 0], a[2, 5] = x
    a[1, 1] = x[0] + x[1]
    return np.linalg.solve(a, np.arange(6.0) * x[0]) + np.linalg.inv(a)[1]


def kinks(x: Any) -> Any:
    return np.hstack(
        [
            abs(x - 1),
            np.abs(x - 1),
            np.fabs(x - 1),
            np.clip(x, 0.7, 1.1),
            np.clip(x, None, 1.1),
            np.clip(x, 0.7, np.inf),
            x.clip(0.6, 0.8),
            np.maximum(x, 1.0),
            np.minimum([x[0], 1.0], x[1]),
            np.sign(x - 1),
            np.where(x > 1, x, 2 - x),
            np.where([True, False], x[:2], 0.0),
            np.select([x < 0.8, x < 1.2], [x, x**2], 3.0),
            np.max([x[0], x[1]]),
        ]
    )


def elementary(x: Any) -> Any:
    return np.hstack(
        [
            np.sin(x), np.cos(x), np.tan(x), np.exp(x), np.log(x), np.sqrt(x), np.tanh(x), np.sinh(x),
            np.cosh(x), np.arctan(x), np.arcsin(x / 2), np.log1p(x), np.expm1(x), np.log2(x), np.log10(x),
            np.cbrt(x), np.square(x), np.reciprocal(x), np.deg2rad(x), np.rad2deg(x), np.hypot(x[0], x[1]),
            np.arctan2(x[:2], x[2:] - 1), np.arctan2(x[0], 2.0), np.arctan2(1.0, -x[0]), np.negative(x),
            x**3, x**-2, x**0.5, x**x, 2.0**x, np.power(x, 0), np.sin([x[0], 1.0]), np.pi * x, -x, +x,
            np.float_power(x, 1.5),
        ]
    )  # fmt: skip


@pytest.mark.parametrize(
    "fn",
    [assigned, filled, joined, reduced, products, linear_algebra, larger_system, kinks, elementary],
    ids=lambda fn: fn.__name__,
)
def test_traced_equals_numpy(fn: Function) -> None:
    assert_same(fn)


UNARY = (np.sin, np.cos, np.tanh, np.arctan, np.exp, np.abs, np.square, np.negative)
BINARY = (np.add, np.subtract, np.multiply, np.maximum, np.minimum, lambda a, b: np.arctan2(a, 0.1 + b * b))


@given(st.data())
@settings(max_examples=60, deadline=None)
def test_random_programs(data: st.DataObject) -> None:
    steps = data.draw(st.lists(st.tuples(st.integers(0, 15), st.integers(0, 99), st.integers(0, 99)), max_size=14))

    def program(x: Any) -> Any:
        values = [x[0], x[1], x[2], 0.5]
        for kind, i, j in steps:
            a, b = values[i % len(values)], values[j % len(values)]
            if kind < len(UNARY):
                values.append(UNARY[kind](np.clip(a, -3, 3)))
            elif kind < len(UNARY) + len(BINARY):
                values.append(BINARY[kind - len(UNARY)](a, b))
            else:
                values.append(a / (1 + b * b) if kind % 2 else np.where(a > b + 0.0137, a, b * b))
        return np.array(values[-3:])

    points = np.random.default_rng(len(steps)).uniform(0.3, 1.7, (3, 4))
    expected = np.array([program(column) for column in points.T]).T
    got = evaluate(program, points)
    defined = np.isfinite(got)
    np.testing.assert_allclose(got[defined], expected[defined], rtol=1e-6, atol=1e-6)


def test_comparisons_are_elementwise() -> None:
    x = TracedArray(Graph().variables("xy"))
    for relations in (x <= 1.0, x < np.array([1.0, 2.0]), x <= 1.0, abs(x) <= 2):
        assert isinstance(relations, np.ndarray)
        assert all(isinstance(r, Relation) for r in relations)


def test_numbers_stay_numbers() -> None:
    def fn(x: Any) -> Any:
        gains = np.eye(2) * 4
        assert isinstance(np.linalg.eigvals(gains)[0], float)
        assert np.allclose(gains, 4 * np.eye(2))
        order = np.zeros(2, dtype=int)
        return x[order] * gains[0, 0]

    assert_same(fn, n=2)


@pytest.mark.parametrize(
    ("fn", "remedy"),
    [
        (lambda x: np.floor(x), "discontinuous"),
        (lambda x: np.round(x), "discontinuous"),
        (lambda x: np.sort(x), "supported"),
        (lambda x: np.median(x), "supported"),
        (lambda x: np.all(x < 1), "separately"),
        (lambda x: np.logical_and(x[0] > 0, x[1] > 0), "separate constraints"),
        (lambda x: x @ np.ones(3), r"shapes \(2,\) and \(3,\)"),
        (lambda x: x + np.ones(3), "do not fit"),
        (lambda x: np.array([x[0], x]), r"shapes \(\), \(2,\)"),
        (lambda x: np.where(x[0], 1.0, 2.0), "> 0"),
        (lambda x: np.where(x > 0), "both branches"),
        (lambda x: np.linalg.solve(x, x), "square matrix"),
        (lambda x: np.linalg.inv(np.zeros((2, 2)) * x[0]), "0"),
        (lambda x: np.linalg.solve(np.outer(x, x), np.ones(3)), "right-hand side"),
        (lambda x: np.cross(x, x), "3 entries"),
        (lambda x: x.astype(float), "np.zeros"),
        (lambda x: 1.0 if x.any() else 2.0, "minimum"),
        (lambda x: 1.0 if x else 2.0, "np.where"),
        (lambda x: np.add(x, 1.0, out=np.zeros(2, dtype=np.float32)), "float array"),
        (lambda x: (x > 0) * 1.0, "used as a number"),
    ],
)
def test_misuse(fn: Function, remedy: str) -> None:
    x = TracedArray(Graph().variables("xy"))
    with pytest.raises(ModegraphError, match=remedy):
        call(fn, {"x": x}, role="controller", owner="mode 'm'")


def test_a_pole_of_a_matrix_is_named() -> None:
    x = TracedArray(Graph().variables("xy"))
    np.linalg.inv(np.array([[x[0], x[1]], [x[1], x[0]]], dtype=object).view(TracedArray))
    assert any("determinant of np.linalg.inv" in note for note in x[0].graph.notes.values())


def test_elements_are_expressions() -> None:
    x = TracedArray(Graph().variables("xy"))
    assert isinstance(x[0], Expr)
    assert isinstance(x[:1], TracedArray)
    assert [e.text() for e in x] == ["x", "y"]
    assert isinstance(x + 1, TracedArray)
    assert isinstance(x.sum(), Expr)
