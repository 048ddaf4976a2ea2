"""Sets with traced numbers are kept as they were given; all other sets are made as ever."""

import copy
import pickle

import numpy as np
import pytest

import modegraph as mg
from modegraph.errors import ModegraphError
from modegraph.expression.array import TracedArray
from modegraph.expression.scalar import Graph
from modegraph.model.sets.parametrised import ParametrisedSet


def variables(count):
    graph = Graph()
    return graph, TracedArray(graph.variables([f"p[{k}]" for k in range(count)]))


def test_only_traced_numbers_make_one():
    _, p = variables(2)
    assert isinstance(mg.Ball([p[0], 0.0], 0.5), ParametrisedSet)
    assert isinstance(mg.Ball(c=[1.0, 0.0], radius=p[0]), ParametrisedSet)
    assert type(mg.Ball([1.0, 0.0], 0.5)) is mg.Ball
    assert type(mg.Box(TracedArray([0.0, 1.0]), [1.0, 2.0])) is mg.Box


@pytest.mark.parametrize("instance", [mg.Ball([1.0], 0.5), mg.Box([0.0], [1.0]), mg.Zonotope([0.0], [[1.0]])])
def test_sets_are_copied_and_pickled(instance):
    assert copy.deepcopy(instance) == copy.copy(instance) == instance
    assert pickle.loads(pickle.dumps(instance)) == instance


def test_conditions():
    graph, p = variables(2)
    box = mg.Box([0.0, p[0]], [p[1], 1.0]).traced(graph, "mode 'm', start")
    assert [c.expr.text() for c in box.conditions] == ["p[1]", "-p[0] + 1"]
    ball = mg.Ball(p, p[0]).traced(graph, "mode 'm', start")
    assert [c.expr.text() for c in ball.conditions] == ["p[0]"]
    assert not mg.Ellipsoid(p, np.eye(2)).traced(graph, "mode 'm', start").conditions


def test_a_wrong_call_is_an_error_of_python():
    _, p = variables(1)
    with pytest.raises(TypeError):
        mg.Ball(p)
    with pytest.raises(ModegraphError, match="a Polytope cannot depend on the parameters"):
        mg.Polytope([[p[0]]], [1.0])


def test_values_of_another_trace_are_refused():
    _, p = variables(1)
    graph, _ = variables(1)
    with pytest.raises(ModegraphError, match="another call"):
        mg.Ball(p, 1.0).traced(graph, "mode 'm', start")
