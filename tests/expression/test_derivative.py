"""Derivatives against finite differences and against exact polynomials."""

import flint
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from modegraph.errors import ModegraphError
from modegraph.expression import Evaluator, Expr, Graph, compile_tape, derivative

SMOOTH = {
    "sin": lambda x, y: np.sin(x * y - 1),
    "cos": lambda x, y: np.cos(x - 2 * y),
    "tan": lambda x, y: np.tan(x / 3 * y),
    "exp": lambda x, y: np.exp(-x * y),
    "log": lambda x, y: np.log(x + y * y),
    "sqrt": lambda x, y: np.sqrt(x * y),
    "tanh": lambda x, y: np.tanh(x - y),
    "arctan": lambda x, y: np.arctan(x**3 - y),
    "arctan2": lambda x, y: np.arctan2(y - 1.5, x),
    "quotient": lambda x, y: (x - y) / (x * x + y),
    "power": lambda x, y: x**2.5 * y**-3 + x**y,
    "kinks": lambda x, y: abs(x - 0.7) * np.maximum(x, y) + np.minimum(x * y, 1.1) + np.clip(y, 0.6, 1.2),
    "where": lambda x, y: np.where(x > y, x * y, np.sin(x)),
    "hyperbolic": lambda x, y: np.sinh(x) * np.cosh(y) + np.hypot(x, y) + np.arcsin(x / 3),
}


@pytest.mark.parametrize("name", SMOOTH)
def test_against_central_differences(name: str) -> None:
    g = Graph()
    x, y = g.variables("xy")
    e = SMOOTH[name](x, y)
    points = np.random.default_rng(1).uniform(0.5, 1.4, (2, 40))
    got = Evaluator(compile_tape(derivative([e], [x, y])[0], [x, y]))(points)
    h = 1e-6
    for k, shift in enumerate(np.eye(2)[:, :, None] * h):
        difference = (SMOOTH[name](*(points + shift)) - SMOOTH[name](*(points - shift))) / (2 * h)
        np.testing.assert_allclose(got[k], difference, rtol=2e-7, atol=2e-7)


TERMS = st.lists(st.tuples(st.integers(0, 4), st.integers(0, 4), st.integers(-9, 9)), max_size=6)


@given(TERMS)
@settings(max_examples=50, deadline=None)
def test_polynomials_exactly(terms: list[tuple[int, int, int]]) -> None:
    g = Graph()
    x, y = g.variables("xy")
    ring = flint.fmpq_mpoly_ctx.get(["x", "y"])
    p, q = ring.gens()
    e: Expr = g.constant(0)
    exact = p - p
    for a, b, c in terms:
        e = e + c * x**a * y**b
        exact = exact + c * p**a * q**b
    for k, partial in enumerate(derivative([e], [x, y])[0]):
        tape = compile_tape([partial], [x, y])
        value = Evaluator(tape)(np.array([3.0, -2.0]))[0]
        assert value == float(int(exact.derivative(k)(3, -2).p))


def test_constants_and_unused_variables_fold() -> None:
    g = Graph()
    x, y = g.variables("xy")
    row = derivative([3 * x + 1], [x, y])[0]
    assert [e.value for e in row] == [3, 0]
    assert derivative([], [x]) == []


def test_kinks_use_steps() -> None:
    x = Graph().variable("x")
    assert derivative([np.maximum(x, 0)], [x])[0][0].text() == "step(x)"


def test_derivatives_add_no_obligations() -> None:
    g = Graph()
    x, y = g.variables("xy")
    derivative([1 / x + np.log(y)], [x, y])
    assert g.dropped == []


def test_only_variables() -> None:
    x = Graph().variable("x")
    with pytest.raises(ModegraphError, match="not a variable"):
        derivative([x], [x * 2])
