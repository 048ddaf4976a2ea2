"""What a traced scalar does, and what it refuses with a remedy."""

import math
import operator
from collections.abc import Callable

import numpy as np
import pytest

from modegraph.errors import ModegraphError
from modegraph.expression import Expr, Graph, Relation


@pytest.mark.parametrize(
    ("use", "remedy"),
    [
        (math.sin, "np.sin"),
        (float, "np.sin"),
        (int, "integer"),
        (complex, "complex"),
        (bool, "np.where"),
        (lambda x: x == 1, "two inequalities"),
        (lambda x: x != 1, "use < or >"),
        (lambda x: 0 <= x <= 1, "chained comparison"),
        (lambda x: x > 0 and x < 1, "separate constraints"),
        (lambda x: (x > 0) & (x < 1), "separate constraints"),
        (lambda x: max(x, 0.0), "np.where"),
        (lambda x: [1, 2][x], "np.where"),
        (lambda x: x // 2, "discontinuous"),
        (lambda x: x % 2, "discontinuous"),
        (round, "discontinuous"),
        (math.floor, "discontinuous"),
        (lambda x: x + float("nan"), "not finite"),
        (lambda x: x <= float("inf"), "unbounded"),
        (lambda x: (-2) ** x, "positive"),
        (lambda x: np.arccos(x), "arctan2"),
        (lambda x: x + Graph().variable("x"), "another call"),
    ],
)
def test_misuse_names_the_remedy(use: Callable[[Expr], object], remedy: str) -> None:
    with pytest.raises(ModegraphError, match=remedy):
        use(Graph().variable("x"))


@pytest.mark.parametrize(
    ("compare", "lhs", "rhs", "strict"),
    [
        (operator.le, "x", "2", False),
        (operator.lt, "x", "2", True),
        (operator.ge, "2", "x", False),
        (operator.gt, "2", "x", True),
    ],
)
def test_comparisons_are_relations(
    compare: Callable[[Expr, float], Relation], lhs: str, rhs: str, strict: bool
) -> None:
    relation = compare(Graph().variable("x"), 2.0)
    assert (relation.lhs.text(), relation.rhs.text(), relation.strict) == (lhs, rhs, strict)


def test_numpy_scalars_mix() -> None:
    g = Graph()
    x = g.variable("x")
    for value in (np.float64(2), np.int32(2), np.array(2.0), np.float32(2)):
        assert (value * x).same(2 * x)
        assert (x * value).same(2 * x)
        assert (value - x).same(2 - x)
    assert isinstance(np.float64(2) >= x, Relation)


def test_depends_on() -> None:
    g = Graph()
    x, y, z = g.variables("xyz")
    e = np.sin(x) + y
    assert e.depends_on([x])
    assert e.depends_on([z, y])
    assert not e.depends_on([z])
    assert not g.constant(1).depends_on([x, y, z])
