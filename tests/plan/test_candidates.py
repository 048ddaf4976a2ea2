"""References that are proposed to the planner: guesses, but good ones."""

from __future__ import annotations

import numpy as np
import pytest

import modegraph as mg
from modegraph.plan.candidates import End, Proposals, lattice
from modegraph.plan.network import Network
from tests.certify.class_graphs import double_integrators


@pytest.mark.parametrize("dim", [1, 2, 3, 5])
def test_a_lattice_holds_the_corners_and_the_centre(dim: int) -> None:
    region = mg.Box(-np.arange(1.0, dim + 1.0), np.arange(2.0, dim + 2.0))
    points = lattice(region)
    assert all(region.contains(p) for p in points)
    for wanted in (region.lo, region.hi, region.center):
        assert (points == wanted).all(axis=1).any()
    assert len(points) <= 40


def test_routes_walk_from_the_start_to_the_goal_in_certified_steps() -> None:
    graph = mg.build(double_integrators(1), horizon=20.0)
    network = Network(graph)
    start, goal = (End((name, 0), np.array(p)) for name, p in (("wide", [-0.83]), ("narrow", [0.77])))
    Proposals(graph).along_routes(network, [start], [goal], frozenset(), ())
    narrow = np.sort([float(p[0]) for p in network.proposed["narrow"]])
    assert np.isclose(narrow, 0.77).any()
    # Starts of the narrow mode are balls of radius .1: steps of that length are certified.
    assert np.diff(narrow[narrow > -0.7]).max() <= 0.1
    steps = [((("narrow", a), ("narrow", b))) for a in range(len(narrow)) for b in range(len(narrow))]
    assert sum(network.certified(*step) for step in steps) >= 10


def test_questions_leave_nothing_behind_in_the_graph() -> None:
    graph = mg.build(double_integrators(1), horizon=20.0)
    before = len(graph.nodes()), len(graph.pair_verdicts())
    first = graph.plan("wide", "narrow", r_start=[-0.5], r_goal=[0.5])
    graph.plan("wide", "narrow", r_start=[-0.2], r_goal=[0.5])
    again = graph.plan("wide", "narrow", r_start=[-0.5], r_goal=[0.5])
    assert (len(graph.nodes()), len(graph.pair_verdicts())) == before
    assert np.array_equal(np.concatenate(first.references), np.concatenate(again.references))


def test_an_end_may_be_a_box_of_references() -> None:
    graph = mg.build(double_integrators(2), horizon=20.0)
    goal = mg.Box([0.4, -0.3], [0.6, -0.1])
    plan = graph.plan("wide", "narrow", r_start=[-0.5, 0.5], r_goal=goal, minimize="distance")
    assert goal.contains(plan.references[-1])
    with pytest.raises(mg.ModegraphError, match="no reference of 'narrow' is in that Box"):
        graph.plan("wide", "narrow", r_goal=mg.Box([2.0, 2.0], [3.0, 3.0]))
    with pytest.raises(mg.ModegraphError, match="2 parameters, not 1"):
        graph.plan("wide", "narrow", r_start=mg.Box([0.0], [0.5]))


def test_a_lattice_joins_what_is_certified() -> None:
    graph = mg.build(double_integrators(1), horizon=20.0)
    network = Network(graph)
    Proposals(graph).everywhere(network)
    assert len(network.proposed["wide"]) >= 27
    for a in network.of("narrow"):
        for b in network.of("wide"):
            p, q = network.parameter(a), network.parameter(b)
            assert p is not None
            assert q is not None
            assert network.certified(a, b) == graph.references("narrow", "wide").contains(p, q)


def test_a_way_too_long_for_one_run_of_a_trajectory_takes_two() -> None:
    """A move carries the state by at most 1; the goal is 1.8 away."""
    plant = mg.System(lambda x, u: u, states="x", inputs="u")
    stay = mg.Mode(
        "stay", plant, controller=lambda x, r: 2.0 * (r - x), reference=mg.setpoint(mg.Box([-1.0], [1.0])),
        start=lambda r: mg.Ball(r, 0.02),
    )  # fmt: skip
    move = mg.Mode(
        "move", plant, controller=lambda x, r: r.dot + 2.0 * (r - x), start=lambda r: mg.Ball(r, 0.02),
        reference=mg.trajectory(lambda t, p: p[:1] + p[1:] * t, 1.0, over=mg.Box([-1.0, -1.0], [1.0, 1.0])),
    )  # fmt: skip
    graph = mg.build([stay, move], horizon=3.0)
    plan = graph.plan("stay", "stay", r_start=[-0.9], r_goal=[0.9])
    assert plan.modes == ["stay", "move", "move", "stay"]
    first, second = plan.references[1:3]
    assert first is not None
    assert second is not None
    assert first[0] + first[1] == pytest.approx(second[0], abs=0.03)
