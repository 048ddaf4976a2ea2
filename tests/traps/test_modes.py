"""Memory that is reset, memories of different sizes, and references that matter."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from tests.traps.question import ask, assert_certified, assert_not_certified, goal


def integrator() -> mg.System:
    return mg.System(lambda x, u: u, states="x", inputs="u")


def charged(gain: float) -> mg.Mode:
    """u = -z with z' = -z and z(0) = gain x(0): x ends at (1 - gain) x(0)."""
    return mg.Mode(
        "charged",
        integrator(),
        controller=lambda x, z: -z[0],
        reference=mg.setpoint([0.0]),
        start=mg.Box([0.9], [1.1]),
        memory=mg.Memory(1, lambda z: -z, lambda x: gain * x),
    )


def test_memory_starts_where_its_reset_puts_it():
    # From z = 0 the state would rest near 1; reset to 5 x it runs down to [-4.4, -3.6].
    assert_not_certified(charged(5.0), goal([1.2], [1.5]), 12.0)
    assert_certified(charged(5.0), goal([-4.6], [-3.4]), 12.0)
    # The spread of z0 follows x0: with gain 1 every start ends at 0, with an independent z0 at +-.1.
    assert_certified(charged(1.0), goal([-0.05], [0.05]), 12.0)


def test_unstable_memory_violates_before_the_switch():
    # z' = z from z0 = x0 up to 1.1: at the switch (x = .5 at t = .79 for x0 = 1.1) z has passed 2.
    def mode(limit: float) -> mg.Mode:
        return mg.Mode(
            "windup",
            integrator(),
            controller=lambda x: -x[0],
            reference=mg.setpoint([0.0]),
            start=mg.Box([0.9], [1.1]),
            memory=mg.Memory(1, lambda z: z, lambda x: x),
            constraints=lambda z: {"z": z[0] <= limit},
        )

    # x0 = 1.1 enters at t = ln 2.2 with z = 1.1 * 2.2 = 2.42.
    assert_not_certified(mode(2.37), goal([-0.5], [0.5]), 4.0)
    assert_certified(mode(2.5), goal([-0.5], [0.5]), 4.0)


def holding(at: float, name: str = "hold", memory: mg.Memory | None = None, start: Any = None) -> mg.Mode:
    return mg.Mode(
        name,
        integrator(),
        controller=lambda x, r: 2.0 * (r - x),
        reference=mg.setpoint([at]),
        start=mg.Box([0.8], [1.0]) if start is None else start,
        memory=memory,
    )


def test_a_start_set_on_plant_and_memory_is_decided_on_the_plant_state():
    # "joint" may start where (x, reset(x)) = (x, 2 x) is in the box: |x| <= .1, not |x| <= .5.
    joint = holding(0.0, "joint", mg.Memory(1, lambda z: -z, lambda x: 2.0 * x), start=mg.Box([-0.5, -0.2], [0.5, 0.2]))
    assert_not_certified(holding(0.3), joint, 8.0)
    assert_certified(holding(0.05), joint, 8.0)


def test_memories_of_different_sizes_chain():
    none = holding(0.0, "none")
    one = holding(0.9, "one", mg.Memory(1, lambda z, x: x - z, lambda x: x), start=mg.Box([-0.2], [0.2]))
    two = holding(
        0.9,
        "two",
        mg.Memory(2, lambda z, x: np.array([z[1], x[0] - z[0] - z[1]]), lambda x: np.array([x[0], 0.0])),
        start=mg.Box([-0.2], [0.2]),
    )
    graph = mg.build([none, one, two], horizon=6.0)
    for i, j in (("none", "one"), ("none", "two"), ("one", "none"), ("two", "none")):
        assert graph.verdict(i, j).status is mg.Status.CERTIFIED, (i, j)
    # Zero time; and one -> two, whose start sets are the same, needs no time either.
    assert graph.verdict("one", "two").time == (0.0, 0.0)


POINTS = [[0.0], [1.0], [2.0]]


def stations() -> list[mg.Mode]:
    """ "hover" converges to its point; "cruise" may only be entered near the point it starts from."""
    plant = integrator()
    hover = mg.Mode(
        "hover",
        plant,
        controller=lambda x, r: 2.0 * (r - x),
        reference=mg.setpoint(mg.Points(POINTS)),
        start=lambda r: mg.Ball(r, 0.4),
    )
    cruise = mg.Mode(
        "cruise",
        plant,
        controller=lambda x, r: r.dot + 2.0 * (r - x),
        reference=mg.trajectory(lambda t, p: p + 0.5 * t, 4.0, over=mg.Points(POINTS)),
        start=lambda r: mg.Ball(r, 0.1),
    )
    return [hover, cruise]


@pytest.mark.parametrize("r_i", POINTS)
@pytest.mark.parametrize("r_j", POINTS)
def test_a_coupled_class_certifies_only_its_own_pairs(r_i: list[float], r_j: list[float]):
    graph = mg.build(stations(), horizon=8.0)
    status = graph.verdict("hover", "cruise", r_i, r_j).status
    assert (status is mg.Status.CERTIFIED) == (r_i == r_j)


def test_a_coupled_class_is_not_decoupled():
    graph = mg.build(stations(), horizon=8.0)
    (switch,) = (s for s in graph.switches if (s.source, s.target) == ("hover", "cruise"))
    assert ([0.0], [0.0]) in switch.references
    assert ([0.0], [1.0]) not in switch.references
    assert not switch.references.decoupled
    # cruise goes 2 further on: from 0 by way of 1 to 2, from 2 to where no hover point is.
    assert graph.verdict("cruise", "hover", [0.0], [2.0]).status is mg.Status.CERTIFIED
    assert graph.verdict("cruise", "hover", [2.0], [0.0]).status is not mg.Status.CERTIFIED


def test_a_class_that_reaches_a_common_goal_is_decoupled():
    wide = mg.Target("anywhere", mg.Box([-1.0], [3.0]))
    hover, _ = stations()
    graph = mg.build([hover, wide], horizon=8.0)
    (switch,) = (s for s in graph.switches if s.target == "anywhere")
    assert switch.references.decoupled
    narrow = mg.Target("anywhere", mg.Box([1.9], [3.0]))
    graph = mg.build([hover, narrow], horizon=8.0)
    assert graph.verdict("hover", "anywhere", [2.0]).status is mg.Status.CERTIFIED
    assert graph.verdict("hover", "anywhere", [0.0]).status is not mg.Status.CERTIFIED


def test_an_existential_answer_needs_one_pair_only():
    hover, cruise = stations()
    verdict = ask(hover, cruise, 8.0)
    assert verdict.status is mg.Status.CERTIFIED


def test_a_plan_may_not_join_references_that_do_not_meet():
    # hover at 0 leads to cruise from 0 only, which ends at 2; cruise from 2 passes no hover point at all.
    graph = mg.build(stations(), horizon=8.0)
    plan = graph.plan("hover", "hover", r_start=[0.0], r_goal=[2.0])
    assert plan.modes == ["hover", "cruise", "hover"]
    with pytest.raises(mg.Unreachable):
        graph.plan("hover", "hover", r_start=[2.0], r_goal=[1.0])


def test_the_same_reference_twice_is_no_switch():
    graph = mg.build(stations(), horizon=8.0)
    assert graph.verdict("hover", "hover").status is not mg.Status.CERTIFIED
    singleton = mg.build([holding(0.0)], horizon=4.0)
    with pytest.raises(mg.ModegraphError):
        singleton.verdict("hold", "hold")
