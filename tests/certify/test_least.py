"""Lower bounds for planning: below every certified pair, also where a bound of the energy is missing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from modegraph.certify.least import least
from modegraph.certify.relation import Part, Relation
from tests.certify.class_graphs import discs


@pytest.fixture(scope="module")
def relation() -> Relation:
    return discs()


def test_no_certified_pair_is_below(relation: Relation) -> None:
    rng = np.random.default_rng(3)
    lo = rng.uniform(-1.0, 0.5, (40, 2))
    hi = lo + rng.uniform(0.0, 0.5, (40, 2))
    source = rng.uniform(lo, hi)
    target = np.clip(source + rng.uniform(-0.25, 0.25, (40, 2)), -1.0, 1.0)
    bounds = least(relation, (lo, hi), (target - 0.01, target + 0.01))
    found = relation.crossings(source, target)
    yes = found.certified
    assert yes.sum() > 5
    rows = np.flatnonzero(yes)
    assert (np.diag(bounds.latest)[rows] <= found.latest[rows] + 1e-9).all()
    assert (np.diag(bounds.energy)[rows] <= found.energy[rows] + 1e-9).all()
    assert (np.diag(bounds.gauge) <= found.gauge + 1e-9).all()


def test_an_energy_without_a_bound_is_no_lower_bound(relation: Relation) -> None:
    parts = tuple(
        Part(tuple(replace(m, energy=np.full_like(m.energy, np.inf)) for m in part.flows)) for part in relation.parts
    )
    box = np.zeros((1, 2)), np.zeros((1, 2))
    assert least(replace(relation, parts=parts), box, box).energy[0, 0] == 0.0
    assert np.isfinite(least(relation, box, box).energy[0, 0])
