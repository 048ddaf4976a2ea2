"""Infix text of nodes."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from modegraph.expression import Graph, TracedArray
from modegraph.expression.text import number, render, shorten


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (Fraction(3), "3"), (Fraction(-1, 2), "-0.5"), (Fraction(1, 3), "0.333333"), (Fraction(10**12), "1e+12"),
        (Fraction(10**400), "huge"), (Fraction(-(10**400)), "-huge"),
    ],
)  # fmt: skip
def test_numbers(value: Fraction, text: str) -> None:
    assert number(value) == text


def test_the_middle_is_cut_out() -> None:
    assert shorten("abcdefghij", 10) == "abcdefghij"
    assert shorten("abcdefghijk", 10) == "abc...hijk"
    assert all(len(shorten("x" * 50, width)) == width for width in range(5, 20))


@pytest.mark.parametrize(
    ("fn", "text"),
    [
        (lambda a, b: (a + b) * a, "a*(a + b)"),
        (lambda a, b: a - (b - a), "a - (b - a)"),
        (lambda a, b: a / (b * a), "a/(a*b)"),
        (lambda a, b: -(a * b), "-a*b"),
        (lambda a, b: (a + 1) ** 2 - 3, "(a + 1)**2 - 3"),
        (lambda a, b: a + -2 * b, "a - 2*b"),
        (lambda a, b: np.maximum(a, np.sqrt(b * b)), "maximum(a, sqrt(b**2))"),
        (lambda a, b: np.where(a < b, np.sin(a), 1.0), "where(b - a > 0, sin(a), 1)"),
    ],
)
def test_brackets_stand_where_they_are_needed(fn: Callable[[Any, Any], Any], text: str) -> None:
    graph = Graph()
    result = fn(*TracedArray(graph.variables("ab")))
    assert render(graph, result.index, 80) == text
    assert len(render(graph, result.index, 6)) <= 6
