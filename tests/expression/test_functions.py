"""Functions of traced scalars against NumPy, and where they stop."""

from __future__ import annotations

import math

import numpy as np
import pytest

from modegraph.errors import ModegraphError
from modegraph.expression import Evaluator, Expr, Graph, compile_tape, functions

POINTS = np.array([-0.75, -0.3, 0.2, 0.9])
UNARY = {
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "exp": np.exp, "expm1": np.expm1, "tanh": np.tanh, "sinh": np.sinh,
    "cosh": np.cosh, "arctan": np.arctan, "arcsin": np.arcsin, "absolute": np.abs,
    "relu": lambda a: np.maximum(a, 0.0), "sign": np.sign,
}  # fmt: skip
POSITIVE = {"log": np.log, "log10": np.log10, "log2": np.log2, "sqrt": np.sqrt, "cbrt": np.cbrt, "log1p": np.log1p}


def values(result: Expr, variables: list[Expr], *points: np.ndarray) -> np.ndarray:
    return Evaluator(compile_tape([result], variables))(np.array(points))[0]


@pytest.mark.parametrize("name", UNARY)
def test_against_numpy(name: str) -> None:
    (a,) = Graph().variables(["a"])
    assert values(getattr(functions, name)(a), [a], POINTS) == pytest.approx(UNARY[name](POINTS), rel=1e-13)


@pytest.mark.parametrize("name", POSITIVE)
def test_against_numpy_where_positive(name: str) -> None:
    (a,) = Graph().variables(["a"])
    points = POINTS + 1.0
    assert values(getattr(functions, name)(a), [a], points) == pytest.approx(POSITIVE[name](points), rel=1e-13)


def test_of_two_numbers() -> None:
    a, b = variables = Graph().variables(["a", "b"])
    other = POINTS[::-1].copy()
    for name in ("maximum", "minimum", "hypot"):
        traced, wanted = getattr(functions, name)(a, b), getattr(np, name)(POINTS, other)
        assert values(traced, variables, POINTS, other) == pytest.approx(wanted, rel=1e-13)
    right = other + 1.0
    assert values(functions.arctan2(a, b), variables, POINTS, right) == pytest.approx(np.arctan2(POINTS, right))


def test_powers() -> None:
    graph = Graph()
    (a,) = graph.variables(["a"])
    for p in (0, 1, 3, -2):
        assert values(functions.power(a, graph.constant(p)), [a], POINTS) == pytest.approx(POINTS**p, rel=1e-13)
    positive = POINTS + 1.0
    assert values(functions.power(a, graph.constant(1.5)), [a], positive) == pytest.approx(positive**1.5, rel=1e-13)


def test_a_pole_is_named() -> None:
    graph = Graph()
    (a,) = graph.variables(["a"])
    functions.tan(a)
    assert "tan(a) reaches a pole" in graph.notes.values()


def test_an_arc_cosine_is_refused_with_the_remedy() -> None:
    (a,) = Graph().variables(["a"])
    with pytest.raises(ModegraphError, match=r"use np.arctan2\(np.sqrt\(1 - a\*\*2\), a\)"):
        functions.arccos(a)


def test_constants_fold_or_are_refused() -> None:
    graph = Graph()
    assert functions.sqrt(graph.constant(4)).value == 2
    assert functions.absolute(graph.constant(-3)).value == 3
    with pytest.raises(ModegraphError):
        functions.log(graph.constant(-1))
    assert float(
        values(
            functions.exp(graph.constant(1)),
            [],
        )[()]
    ) == pytest.approx(math.e)
