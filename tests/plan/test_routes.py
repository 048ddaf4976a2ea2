"""Sequences of modes, and references for all of them at once."""

from __future__ import annotations

import numpy as np
import pytest

import modegraph as mg
from modegraph.plan.routes import Route, Routes
from tests.certify.class_graphs import double_integrators
from tests.graph.fakes import certified, graph

NOTHING: frozenset[str] = frozenset()
WIDE, NARROW = ("wide", 0), ("narrow", 0)


@pytest.fixture(scope="module")
def line() -> mg.ModeGraph:
    return mg.build(double_integrators(1), horizon=20.0)


def stops(routes: list[Route]) -> list[str]:
    return ["".join(name for name, _ in route.stops) for route in routes]


def test_routes_of_a_finite_graph_are_its_paths_the_shortest_first() -> None:
    arrows = ("ab", "bd", "ac", "cd", "ad", "db")
    routes = Routes(graph("abcd", {(i, j): certified() for i, j in arrows}))
    assert stops(routes.between(("a", 0), ("d", 0), NOTHING, ())) == ["ad", "abd", "acd"]
    assert stops(routes.between(("a", 0), ("d", 0), frozenset("b"), ())) == ["ad", "acd"]
    assert stops(routes.between(("a", 0), ("d", 0), NOTHING, ("b",))) == ["abd"]
    assert stops(routes.between(("d", 0), ("a", 0), NOTHING, ())) == []


def test_a_class_of_set_points_may_be_walked(line: mg.ModeGraph) -> None:
    found = Routes(line).between(WIDE, NARROW, NOTHING, ())
    walks = {route.stops: [route.walks(k) for k in range(len(route.stops) - 1)] for route in found}
    assert walks[WIDE, NARROW] == [False]
    assert walks[WIDE, NARROW, NARROW] == [False, True]
    assert not any(a.count(NARROW) > 2 for a in walks)


def test_free_references_go_to_where_the_fixed_ones_are(line: mg.ModeGraph) -> None:
    """The wide loop ends at its reference, so that is where the narrow one is entered best."""
    route = Route(line, (WIDE, NARROW))
    _, near = route.references({0: np.array([0.4])}, {})
    assert near == pytest.approx([0.4], abs=1e-3)
    first, _ = route.references({1: np.array([-0.7])}, {})
    assert first == pytest.approx([-0.7], abs=1e-3)
    _, narrowed = route.references({0: np.array([0.4])}, {1: (np.array([-0.2]), np.array([0.1]))})
    assert narrowed.tolist() == [0.1]
    both = route.references({0: np.array([0.4]), 1: np.array([-0.4])}, {})
    assert [p.tolist() for p in both] == [[0.4], [-0.4]]
