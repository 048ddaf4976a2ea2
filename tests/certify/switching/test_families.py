"""Evidence for pairs of references: only for those that the relation certifies, with numbers that hold."""

from __future__ import annotations

import numpy as np
import pytest

from modegraph.certify.relation import Relation
from modegraph.certify.switching.families import OfEveryPair, OfPair
from tests.certify.class_graphs import discs


@pytest.fixture(scope="module")
def relation() -> Relation:
    return discs()


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
