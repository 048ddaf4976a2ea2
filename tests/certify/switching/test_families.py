"""Evidence for pairs of references: only for those that the relation certifies, with numbers that hold."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.class_unit import relate
from modegraph.certify.question import TargetSpec
from modegraph.certify.relation import Relation
from modegraph.certify.switching.families import OfEveryPair, OfPair
from modegraph.deadline import Deadline
from tests.certify.class_graphs import one_integrator

SQUARE = mg.Box([-1.0, -1.0], [1.0, 1.0])


@pytest.fixture(scope="module")
def relation() -> Relation:
    modes = [one_integrator(lambda r: r, lambda r, a=a: mg.Ball(r, a), SQUARE, f"m{a}") for a in (0.4, 0.2)]
    spec: Any = TargetSpec(modes[1].name, None, modes[1])
    found = relate(modes[0], None, [spec], horizon=6.0, deadline=Deadline(60.0), progress=lambda text: None)
    (made,) = found.relations
    assert isinstance(made, Relation)
    return made


def rows(*values: float) -> np.ndarray:
    return np.array([values])


def test_a_pair_that_is_certified(relation: Relation) -> None:
    found = OfPair(relation, rows(0.1, 0.0), rows(0.2, 0.0))
    crossing = relation.crossings(rows(0.1, 0.0), rows(0.2, 0.0))
    assert found.latest == crossing.latest[0]
    assert found.energy == crossing.energy[0]
    assert 0.0 < found.margin == 1.0 - crossing.gauge[0]


@pytest.mark.parametrize("target", [rows(0.1, 0.25), rows(5.0, 0.0)])
def test_a_pair_that_is_not_certified_is_no_evidence(relation: Relation, target: np.ndarray) -> None:
    for kind in (OfPair, OfEveryPair):
        with pytest.raises(ValueError):
            kind(relation, rows(0.1, 0.0), target)


def test_the_numbers_of_all_hold_for_each(relation: Relation) -> None:
    every = OfEveryPair(relation, rows(0.0, 0.0), rows(0.0, 0.1))
    for offset in np.linspace(0.0, 0.19, 12):
        one = OfPair(relation, rows(0.0, 0.0), rows(0.0, offset))
        assert every.earliest <= one.earliest
        assert every.latest >= one.latest
        assert every.energy >= one.energy
        assert every.margin <= one.margin
