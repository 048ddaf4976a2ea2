"""Forms over atoms: exact arithmetic, cancellation by known factors, limits."""

from __future__ import annotations

from fractions import Fraction

import pytest

from modegraph.expression import Expr, Graph
from modegraph.expression.ops import COS
from modegraph.expression.rational import Field, cost, square_root_argument
from modegraph.expression.work import TooBig, Work


@pytest.fixture
def field() -> Field:
    graph = Graph()
    graph.variables("ab")
    return Field(graph, [0, 1], reduce=True, work=Work(1e6))


def test_a_sum_over_one_factor_cancels_it(field: Field) -> None:
    """(a^2 - b^2) / (a + b) = a - b, once a + b is a known denominator."""
    a, b = field.atom(0), field.atom(1)
    below = field.reciprocal(field.add(a, b))
    above = field.add(field.mul(a, a), field.mul(b, b), -1)
    whole = field.mul(above, below)
    assert not whole.powers
    assert whole.numerator == field.add(a, b, -1).numerator
    assert field.mul(a, below).powers


def test_numbers_are_exact(field: Field) -> None:
    third = field.constant(Fraction(1, 3))
    assert field.add(third, field.add(third, third)).numerator == field.constant(Fraction(1)).numerator
    assert field.affine(field.add(field.scale(field.atom(0), Fraction(3)), third), field.atom(0)) == (3, Fraction(1, 3))
    assert field.affine(field.mul(field.atom(0), field.atom(0)), field.atom(0)) is None


def test_quotients(field: Field) -> None:
    a, b = field.atom(0), field.atom(1)
    product = field.mul(a, field.add(a, b))
    found = field.quotient(product, a)
    assert found is not None
    assert found.numerator == field.add(a, b).numerator
    assert field.quotient(field.add(product, b), a) is None


def test_work_is_limited() -> None:
    graph = Graph()
    graph.variables("ab")
    field = Field(graph, [0, 1], reduce=True, work=Work(5.0))
    a, b = field.atom(0), field.atom(1)
    with pytest.raises(TooBig):
        field.mul(field.add(a, b), field.add(a, b, -1))


def test_what_a_tape_costs() -> None:
    graph = Graph()
    a, b = graph.variables("ab")
    wave = Expr(graph, graph.cos(a.index))
    assert graph.nodes[wave.index].op == COS
    assert cost(graph, [wave.index], Work(1e6)) == 4.0
    # What two outputs share is counted once.
    assert cost(graph, [(wave * b).index, wave.index], Work(1e6)) == pytest.approx(5.0)
    assert cost(graph, [(a / b).index], Work(1e6)) == pytest.approx(4.0)


def test_square_roots_are_recognised() -> None:
    graph = Graph()
    (a,) = graph.variables("a")
    argument = a * a + 1
    assert square_root_argument(graph, argument.sqrt().index) == argument.index
    assert square_root_argument(graph, argument.exp().index) is None
