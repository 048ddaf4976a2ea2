"""Relations as constraints: which faces they have."""

import numpy as np
import pytest

from modegraph.errors import ModegraphError
from modegraph.expression import Evaluator, Expr, Graph, Relation, compile_tape


def texts(relation: Relation) -> list[str]:
    return [face.text() for face in relation.faces()]


def test_plain_relations_have_one_face() -> None:
    x, y = Graph().variables("xy")
    assert texts(x * y <= 2) == ["x*y - 2"]
    assert texts(x >= y) == ["y - x"]


def test_absolute_values_are_split() -> None:
    x, y = Graph().variables("xy")
    assert texts(abs(x) <= 2) == ["x - 2", "-x - 2"]
    assert texts(abs(x - y) <= 2) == ["x - y - 2", "y - x - 2"]
    assert texts(3 * abs(x) - 1 <= 2) == ["3*x - 3", "-3*x - 3"]
    assert texts(-abs(x) >= -2) == ["-2 + x", "-2 - x"] or len(texts(-abs(x) >= -2)) == 2


def test_extremes_are_split() -> None:
    x, y = Graph().variables("xy")
    assert texts(np.maximum(x, y) <= 2) == ["x - 2", "y - 2"]
    assert texts(np.minimum(x, y) >= 2) == ["-x + 2", "-y + 2"]
    assert len(texts(np.maximum(abs(x), abs(y)) <= 2)) == 4
    assert len(texts(np.minimum(x, y) <= 2)) == 1


def test_norms_are_squared() -> None:
    x, y = Graph().variables("xy")
    assert texts(np.hypot(x, y) <= 2) == ["x**2 + y**2 - 4"]
    assert len(texts(np.hypot(x, y) >= 2)) == 1
    assert "log" not in texts(np.hypot(x, y) >= 2)[0]
    assert "sqrt" in texts(np.sqrt(x) <= 2)[0], "sqrt of something that may be negative stays undefined there"
    assert "sqrt" in texts(np.hypot(x, y) <= y)[0]


@pytest.mark.parametrize(
    "relate",
    [
        lambda x, y: abs(x) <= y,
        lambda x, y: np.clip(x, -1, 1) >= y,
        lambda x, y: 1 - 2 * np.maximum(abs(x), y) >= -1,
        lambda x, y: np.hypot(x, y) >= 1,
        lambda x, y: np.hypot(x, y) < 1,
        lambda x, y: np.minimum(abs(x), y) <= 0.5,
    ],
)
def test_faces_mean_the_relation(relate: object) -> None:
    g = Graph()
    x, y = g.variables("xy")
    points = np.random.default_rng(3).uniform(-2, 2, (2, 400))
    relation = relate(x, y)  # type: ignore[operator]
    values = Evaluator(compile_tape(relation.faces(), [x, y]))(points)
    assert np.array_equal(np.all(values <= 0, axis=0), relate(*points))  # type: ignore[operator]


def test_constant_relations_have_a_truth_value() -> None:
    g = Graph()
    one: Expr = g.constant(1)
    assert bool(one <= 1)
    assert not bool(one < 1)
    assert (g.variable("x") <= 1).constant is None
    with pytest.raises(ModegraphError, match="chained"):
        bool(g.variable("x") <= 1)
