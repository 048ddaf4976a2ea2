"""Exact folding, and what folding must not forget."""

from fractions import Fraction

import numpy as np
import pytest

from modegraph.errors import ModegraphError
from modegraph.expression import Graph, compile_tape
from modegraph.expression.graph import NONNEGATIVE, POSITIVE


def test_equal_operations_are_one_node() -> None:
    g = Graph()
    x, y = g.variables("xy")
    assert (x * y + 1).same(1 + y * x)
    assert (2 * (3 * x)).same(6 * x)
    assert (x - y).same(-(y - x))
    assert (x + x).same(2 * x)
    assert ((x + y) - y).same(x)
    assert (x / 4).same(0.25 * x)
    assert g.variable("x").same(x)


def test_constants_are_exact() -> None:
    g = Graph()
    x = g.variable("x")
    assert (x + 0.1 + 0.2 - x).value == Fraction(0.1) + Fraction(0.2)
    assert (g.constant(1) / 3 * 3).value == 1
    assert (g.constant(2) ** 0.5 * 1).is_constant is False
    assert (g.constant(4) ** 0.5).value == 2
    assert (g.constant(Fraction(9, 4)) ** 1.5).value == Fraction(27, 8)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf"), 1j, "1", None])
def test_constants_must_be_finite_numbers(value: object) -> None:
    with pytest.raises(ModegraphError):
        Graph().constant(value)  # type: ignore[arg-type]


def test_dropped_operands_are_remembered() -> None:
    g = Graph()
    x, y = g.variables("xy")
    pole = 1 / x
    for fold in (
        lambda: 0 * pole,
        lambda: pole - pole,
        lambda: (pole + y) - pole,
        lambda: pole**0,
        lambda: pole - (pole - y),
        lambda: np.where(pole > 0, y, y),
    ):
        folded = fold()
        assert g.dropped, folded.text()
        g.dropped.clear()
    assert (0 * (x + y)).value == 0
    assert (0 * (1 / (x * x + 1))).value == 0
    assert not g.dropped
    assert np.arctan2(0 * y, x).value == 0
    assert g.dropped, "x > 0 stays an obligation"


def test_signs_from_structure() -> None:
    g = Graph()
    x, y = g.variables("xy")
    assert g.signs[(x * x + y**4).index] == NONNEGATIVE
    assert g.signs[(x * x + y**4 + 0.5).index] == POSITIVE
    assert g.signs[(2**x).index] == POSITIVE
    assert g.signs[(x * y).index] < NONNEGATIVE


def test_division_by_zero_is_refused() -> None:
    x = Graph().variable("x")
    with pytest.raises(ModegraphError, match="denominator"):
        x / 0
    with pytest.raises(ModegraphError, match="denominator"):
        1 / (x - x)


def test_powers_share_squares() -> None:
    g = Graph()
    x = g.variable("x")
    tape = compile_tape([x**8, x**4, x**5], [x])
    assert tape.size == 5


def test_texts_are_readable_and_short() -> None:
    g = Graph()
    x, y = g.variables(["th1", "w"])
    assert (-x * (y - 1) / (x + 2) ** 2).text() == "-th1*(w - 1)/((th1 + 2)**2)"
    assert abs(x).text() == "abs(th1)"
    long = x
    for k in range(60):
        long = long * y + k
    assert len(long.text()) <= 80
    assert long.text().count("...") == 1
