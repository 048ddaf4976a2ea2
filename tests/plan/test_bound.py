"""No plan beats the bound; where the best one is known, the bound is near it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import modegraph as mg
from tests.certify.class_graphs import double_integrators, one_integrator


@pytest.fixture(scope="module", params=[1, 2])
def graph(request: Any) -> mg.ModeGraph:
    return mg.build(double_integrators(request.param), horizon=20.0)


OBJECTIVES = ["switches", "time", "energy", "distance", "margin", {"time": 1.0, "switches": 0.5}]


@pytest.mark.parametrize("minimize", OBJECTIVES, ids=str)
def test_no_plan_found_is_better(graph: mg.ModeGraph, minimize: Any) -> None:
    rng = np.random.default_rng(3)
    k = graph.regions["wide"].dim
    for _ in range(6):
        a, b = rng.uniform(-1.0, 1.0, (2, k))
        for start, goal in (("wide", "narrow"), ("narrow", "wide"), ("narrow", "narrow")):
            # What was chosen without looking at the bound, and plans for another objective.
            plan = graph.plan(start, goal, r_start=a, r_goal=b, minimize=minimize)
            assert plan.bounded() <= plan.cost * (1.0 + 1e-6)
            assert plan.bound <= plan.cost
            assert plan.gap == plan.cost - plan.bound >= 0.0


def test_the_fewest_steps_within_one_class_are_known(graph: mg.ModeGraph) -> None:
    """Starts of the narrow mode are balls of radius .1 and every start has nearly settled at the horizon."""
    k = graph.regions["narrow"].dim
    for far in (0.35, 0.55, 1.15):
        a, b = np.full(k, -0.6), np.full(k, -0.6)
        b[0] += far
        plan = graph.plan("narrow", "narrow", r_start=a, r_goal=b, avoid=["wide"])
        assert plan.cost == math.ceil(far / 0.1)
        assert plan.bound >= math.ceil(far / 0.1) - (1 if k > 1 else 0)


def test_no_walk_is_shorter_than_the_straight_line(graph: mg.ModeGraph) -> None:
    k = graph.regions["narrow"].dim
    a, b = np.full(k, -0.5), np.full(k, 0.3)
    plan = graph.plan("wide", "narrow", r_start=a, r_goal=b, minimize="distance")
    assert plan.bound == pytest.approx(0.8 * math.sqrt(k), rel=1e-6)
    assert plan.gap < 1e-6


def test_open_ends_and_states_are_bounded_too(graph: mg.ModeGraph) -> None:
    k = graph.regions["narrow"].dim
    goal = mg.Box(np.full(k, 0.4), np.full(k, 0.6))
    for question in (
        {"start": "wide", "r_start": np.full(k, -0.5), "r_goal": goal},
        {"start": "wide", "r_start": np.full(k, -0.5), "r_goal": None},
        {"start": "wide", "r_start": None, "r_goal": np.full(k, 0.5)},
        {"x0": np.concatenate([np.full(k, -0.5), np.zeros(k)]), "r_goal": goal},
    ):
        plan = graph.plan(goal="narrow", minimize="time", **question)  # type: ignore[arg-type]
        assert plan.bounded() <= plan.cost
    near = graph.plan(
        x0=np.concatenate([np.full(k, 0.5), np.zeros(k)]), goal="narrow", r_goal=goal, minimize="switches"
    )
    assert (near.cost, near.bound) == (0, 0.0)


def test_a_finite_graph_has_no_gap() -> None:
    plant = mg.System(lambda x, u: u, states="x", inputs="u")
    modes = [
        mg.Mode(name, plant, controller=lambda x, r: r - x, reference=mg.setpoint([place]),
                start=lambda r: mg.Ball(r, 0.3))
        for name, place in (("a", 0.0), ("b", 0.2), ("c", 0.4))
    ]  # fmt: skip
    plan = mg.build(modes, horizon=5.0).plan("a", "c", minimize="time")
    assert plan.bound == plan.cost
    assert plan.gap == 0.0


def test_references_that_turn_are_bounded() -> None:
    """The middle of the starts, and the target's centre, are not affine in the reference."""
    square = mg.Box([-1.0, -1.0], [1.0, 1.0])
    bend = lambda r: np.stack([r[0] + 0.3 * np.sin(2.0 * r[1]), r[1]])
    mode = one_integrator(bend, lambda r: mg.Ball(bend(r), 0.4), square, "bend")
    graph = mg.build([mode], horizon=12.0)
    rng = np.random.default_rng(5)
    for minimize in ("switches", "time"):
        for _ in range(4):
            a, b = rng.uniform(-1.0, 1.0, (2, 2))
            plan = graph.plan("bend", "bend", r_start=a, r_goal=b, minimize=minimize)
            assert plan.bounded() <= plan.cost * (1.0 + 1e-6)
            assert plan.simulate(np.array(bend(a))).ok
