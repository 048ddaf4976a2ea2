"""The references a search may use, and the certified switches between them."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

import modegraph as mg
from modegraph.plan.network import Network
from modegraph.plan.objectives import objective
from tests.certify.class_graphs import double_integrators
from tests.graph.fakes import UNDECIDED, certified, graph, mode


@pytest.fixture(scope="module")
def line() -> mg.ModeGraph:
    return mg.build(double_integrators(1), horizon=20.0)


def test_finite_classes_are_there_from_the_beginning() -> None:
    network = Network(
        graph(["a", mode("b", 2)], {(("a", 0), ("b", 1)): certified(3.0, energy=2.0), (("a", 0), ("b", 0)): UNDECIDED})
    )
    assert network.nodes() == [("a", 0), ("b", 0), ("b", 1)]
    assert network.certified(("a", 0), ("b", 1))
    assert not network.certified(("a", 0), ("b", 0))
    arcs = network.arcs(objective("time"))
    assert list(arcs) == [("a", 0)]
    (arc,) = arcs["a", 0]
    assert (arc.target, arc.latest, arc.margin) == (("b", 1), Fraction(3), 0.5)


def test_a_reference_is_proposed_once(line: mg.ModeGraph) -> None:
    network = Network(line)
    first = network.propose("wide", np.array([0.0]))
    assert network.propose("wide", np.array([-0.0])) == first == ("wide", 0)
    assert network.propose("wide", np.array([0.5])) == ("wide", 1)
    assert network.propose("narrow", np.array([0.5])) == ("narrow", 0)
    assert network.nodes() == [("wide", 0), ("wide", 1), ("narrow", 0)]


def test_proposed_references_are_joined_only_where_their_pair_is_certified(line: mg.ModeGraph) -> None:
    """A start of the narrow mode is a ball of .1 around its reference, where the wide one comes to rest."""
    network = Network(line)
    rest, near, far = (
        network.propose(name, np.array([p])) for name, p in (("wide", 0.0), ("narrow", 0.09), ("narrow", 0.11))
    )
    assert not network.certified(rest, near)
    network.connect([(rest, near), (rest, far), (rest, rest)])
    assert network.certified(rest, near)
    assert not network.certified(rest, far)
    assert not network.certified(rest, rest)
    (arc,) = network.arcs(objective("switches"))[rest]
    assert arc.target == near
    assert 0.0 <= arc.margin <= 0.1 + 1e-9
