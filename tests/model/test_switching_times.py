"""Instants at which expressions switch in time."""

import numpy as np

from modegraph.expression.scalar import Graph
from modegraph.model.switching_times import jumps, switching_times


def traced(function):
    graph = Graph()
    x, t = graph.variables("xt")
    return [function(x, t)], t


def test_affine_conditions_are_found():
    exprs, t = traced(lambda x, t: np.where(t < 0.5, x, -x) + np.where(2 * t - 3 > 0, 1.0, 0.0) + np.maximum(t, 4.0))
    assert switching_times(exprs, t, 0.0, np.inf) == [0.5, 1.5, 4.0]
    assert switching_times(exprs, t, 0.5, 4.0) == [1.5]
    assert len(jumps(exprs, t)) == 2


def test_instants_that_are_no_doubles_are_left_out():
    exprs, t = traced(lambda x, t: np.where(3 * t < 1.0, x, -x))
    assert switching_times(exprs, t, 0.0, np.inf) == []
    assert len(jumps(exprs, t)) == 1


def test_conditions_on_the_state_do_not_count():
    exprs, t = traced(lambda x, t: np.where(x < t, 1.0, 0.0) + np.maximum(x, 0.0))
    assert switching_times(exprs, t, 0.0, np.inf) == []
    assert jumps(exprs, t) == []
