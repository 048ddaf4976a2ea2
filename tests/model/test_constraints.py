"""Forms of constraints that are accepted, and those that are refused with a remedy."""

import numpy as np
import pytest

from modegraph.errors import ModegraphError
from modegraph.expression.array import TracedArray
from modegraph.expression.scalar import Graph
from modegraph.expression.trace import call
from modegraph.model.constraints import faces_of


def faces(function):
    graph = Graph()
    x = TracedArray(graph.variables(["a", "b"]))
    returned = call(function, {"x": x}, role="constraints", owner="mode 'm'")
    return [(face.name, face.expr.text()) for face in faces_of(returned, "mode 'm', constraints")]


def test_forms():
    assert faces(lambda x: {"one": x[0] <= 1.0}) == [("one", "a - 1")]
    assert faces(lambda x: {"one": x[0] >= 1.0}) == [("one", "-a + 1")]
    assert faces(lambda x: {"one": x[0] < 1.0}) == [("one", "a - 1")]
    assert faces(lambda x: {"both": abs(x[1]) <= 2}) == [("both", "b - 2"), ("both", "-b - 2")]
    assert faces(lambda x: {"both": 2 >= abs(x[1])}) == [("both", "b - 2"), ("both", "-b - 2")]  # noqa: SIM300


def test_arrays_are_named_by_index():
    assert faces(lambda x: {"each": x <= [1, 2]}) == [("each[0]", "a - 1"), ("each[1]", "b - 2")]
    assert faces(lambda x: {"each": [x[0] <= 1, x <= 3]}) == [
        ("each[0]", "a - 1"),
        ("each[1][0]", "a - 3"),
        ("each[1][1]", "b - 3"),
    ]
    assert faces(lambda x: {"each": np.array([x]) <= 1}) == [("each[0][0]", "a - 1"), ("each[0][1]", "b - 1")]


def test_no_constraints():
    assert faces(lambda x: {}) == []


@pytest.mark.parametrize(
    "function, words",
    [
        (lambda x: x[0] <= 1, "expected a dict of relations"),
        (lambda x: [x[0] <= 1], "expected a dict of relations"),
        (lambda x: None, "expected a dict of relations"),
        (lambda x: {"a": x[0]}, "'a' is the number a, not a relation"),
        (lambda x: {"a": True}, "'a' is the plain truth value True"),
        (lambda x: {"a": np.array([1.0]) <= 2}, "'a[0]' is the plain truth value True"),
        (lambda x: {"a": None}, "'a' is None"),
        (lambda x: {"a": "x <= 1"}, "'a' is a str"),
        (lambda x: {"a": x}, "'a[0]' is the number a, not a relation"),
        (lambda x: {3: x[0] <= 1}, "the name 3"),
        (lambda x: {"a": x[0] == 1}, "=="),
        (lambda x: {"a": 0 <= x[0] <= 1}, "chained comparison"),
        (lambda x: {"a": (x[0] <= 1) and (x[1] <= 1)}, "and"),
        (lambda x: {"a": (x[0] <= 1) & (x[1] <= 1)}, "and"),
    ],
)
def test_refused_forms(function, words):
    with pytest.raises(ModegraphError, match="mode 'm', constraints") as error:
        faces(function)
    assert words in str(error.value)
