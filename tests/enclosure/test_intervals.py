"""Ranges of tapes over boxes: never too small, also on unbounded boxes and at singular points."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from modegraph.enclosure.intervals import IntervalEvaluator
from modegraph.expression.evaluate import Evaluator
from modegraph.expression.scalar import Graph
from modegraph.expression.tape import Tape, compile_tape

FUNCTIONS: dict[str, Callable[[Any, Any], Any]] = {
    "polynomial": lambda x, y: x * x * y - 3 * x + y**3 / 7 - Fraction(1, 3),
    "rational": lambda x, y: (x + y) / (1 + x * x) - 1 / (3 + np.sin(y)),
    "waves": lambda x, y: np.sin(3 * x) * np.cos(x - 2 * y),
    "growth": lambda x, y: np.exp(x - y) + np.log(4 + x) + np.arctan(5 * y),
    "kinks": lambda x, y: np.maximum(x, y) - np.minimum(2 * x, y) + abs(x - y),
    "shifted kinks": lambda x, y: np.maximum(x + 1, y * y - 2) * np.minimum(x * x - 3, y + 1) + abs(x - y + 1),
    "choice": lambda x, y: np.where(x > y, x * y, y - x),
}


def tape_of(fn: Callable[[Any, Any], Any]) -> Tape:
    graph = Graph()
    x, y = graph.variables(["x", "y"])
    return compile_tape([fn(x, y)], [x, y])


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("size", [0.0, 1e-12, 0.1, 2.0])
def test_every_point_of_a_box_has_its_value_in_the_range(name: str, size: float) -> None:
    tape = tape_of(FUNCTIONS[name])
    rng = np.random.default_rng(5)
    middle = rng.uniform(-1.5, 1.5, (2, 60))
    half = size * rng.uniform(0.0, 1.0, (2, 60))
    lo, hi = middle - half, middle + half
    low, high, defined = IntervalEvaluator(tape)(lo, hi)
    assert defined.all() or name == "growth"
    for _ in range(50):
        points = np.clip(lo + rng.random((2, 60)) * (hi - lo), lo, hi)
        values = Evaluator(tape)(points)
        slack = 1e-13 * (1 + np.abs(values))
        fine = ~np.isnan(values)
        assert (low - slack <= values)[fine].all()
        assert (values <= high + slack)[fine].all()
    if size == 0.0:
        assert (high - low < 1e-11).all()


def test_rational_arithmetic_is_rounded_outward() -> None:
    graph = Graph()
    (x,) = graph.variables(["x"])
    tape = compile_tape([x * x * x / 3 - x / 7 + Fraction(1, 3), 1 / x], [x])
    points = np.random.default_rng(1).uniform(0.1, 2.0, 500)
    low, high, _ = IntervalEvaluator(tape)(points[None], points[None])
    for k, value in enumerate(points):
        v = Fraction(float(value))
        for i, true in enumerate((v**3 / 3 - v / 7 + Fraction(1, 3), 1 / v)):
            assert Fraction(float(low[i, k])) <= true <= Fraction(float(high[i, k]))


@pytest.mark.parametrize(
    "fn, least",
    [
        (lambda x, y: x * x + y * y, 100.0),
        (lambda x, y: abs(x) + abs(y), 10.0),
        (lambda x, y: np.maximum(x, y), 10.0),
        (lambda x, y: abs(x) * (1 + np.maximum(y, 0)), 10.0),
        (lambda x, y: x * x - np.sin(y), 99.0),
        (lambda x, y: -np.minimum(-x, y), 10.0),
        (lambda x, y: np.maximum(x * x - 100, np.sin(y) + 3) - 1, 1.0),
        (lambda x, y: -np.minimum(-x - 2, y * y + 1) + 3, 15.0),
    ],
)
def test_unbounded_boxes(fn: Callable[[Any, Any], Any], least: float) -> None:
    low, high, _ = IntervalEvaluator(tape_of(fn))(np.array([[10.0], [-np.inf]]), np.array([[np.inf], [np.inf]]))
    assert least * (1 - 1e-12) <= low[0, 0] <= least
    assert high[0, 0] == np.inf


def test_extremes_of_waves_inside_the_box_count() -> None:
    tape = tape_of(lambda x, y: np.sin(x) + 0 * y)
    lo = np.array([[1.0, 4.0, 1e7, 0.0, 0.2], [0.0] * 5])
    hi = np.array([[2.0, 5.0, 1e7 + 1e-3, 7.0, 0.3], [0.0] * 5])
    low, high, _ = IntervalEvaluator(tape)(lo, hi)
    assert high[0, 0] == 1.0
    assert low[0, 1] == -1.0
    assert (low[0, 2], high[0, 2]) == (-1.0, 1.0)
    assert (low[0, 3], high[0, 3]) == (-1.0, 1.0)
    assert low[0, 4] == pytest.approx(np.sin(0.2), abs=1e-12)


def test_poles_are_not_defined_and_unbounded() -> None:
    graph = Graph()
    (x,) = graph.variables(["x"])
    evaluate = IntervalEvaluator(compile_tape([1 / x, np.log(x)], [x]))
    low, high, defined = evaluate(np.array([[-1.0, 0.0, 0.5, -2.0]]), np.array([[1.0, 1.0, 1.0, -1.0]]))
    assert defined.tolist() == [False, False, True, False]
    assert low[0, 0] == -np.inf
    assert high[0, 0] == np.inf
    assert low[0, 1] <= 1.0 <= 1e300 <= high[0, 1]
    assert low[1, 1] == -np.inf
