"""References that are proposed to the planner: guesses, but good ones."""

from __future__ import annotations

import numpy as np
import pytest

import modegraph as mg
from modegraph.plan.candidates import lattice, propose
from tests.certify.class_graphs import double_integrators


@pytest.mark.parametrize("dim", [1, 2, 3, 5])
def test_a_lattice_holds_the_corners_and_the_centre(dim: int) -> None:
    region = mg.Box(-np.arange(1.0, dim + 1.0), np.arange(2.0, dim + 2.0))
    points = lattice(region)
    assert all(region.contains(p) for p in points)
    for wanted in (region.lo, region.hi, region.center):
        assert (points == wanted).all(axis=1).any()
    assert len(points) <= 40


def test_proposals_lead_from_the_start_to_the_goal_in_certified_steps() -> None:
    graph = mg.build(double_integrators(1), horizon=20.0)
    propose(graph, "wide", "narrow", [-0.83], [0.77], None)
    known = np.sort([float(graph.parameter(("narrow", k))[0]) for k in graph.indices("narrow")])  # type: ignore[index]
    for wanted in (-0.83, 0.77):
        assert np.isclose(known, wanted).any()
    between = known[(known >= -0.83) & (known <= 0.77)]
    # Starts of the narrow mode are balls of radius .1: steps of that length are certified.
    assert np.diff(between).max() <= 0.1
    before = len(graph.indices("narrow"))
    propose(graph, "wide", "narrow", [-0.83], [0.77], None)
    assert len(graph.indices("narrow")) == before
