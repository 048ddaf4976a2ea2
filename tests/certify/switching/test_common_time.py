"""When a flow is inside a target."""

from __future__ import annotations

import math

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.legal import proved_instants
from modegraph.certify.switching.common_time import Missed, Reach, find_crossings
from modegraph.certify.targets.region import Region
from modegraph.reach.compiled import compile_mode
from modegraph.reach.flow.flow import Flow, Order

PLANT = mg.System(lambda x, u: np.array([u[0]]), states=1, inputs=1)


def decaying(limit: float = 5.0, start: tuple[float, float] = (1.0, 2.0)) -> Flow:
    mode = mg.Mode(
        "m",
        PLANT,
        controller=lambda x: -x[0],
        reference=mg.setpoint([0.0]),
        start=mg.Box([start[0]], [start[1]]),
        constraints=lambda x: {"top": x[0] <= limit},
    )
    c = compile_mode(mode, None)
    flow = Flow(c.fields, c.whole(), c.w_centre, c.w_radius, Order(1, 0), names=c.loop.names, longest_step=0.05)
    assert flow.run(3.0)
    return flow


def test_the_first_instant_inside_and_the_stay() -> None:
    reach = Reach(decaying(), None)
    region = Region(mg.Box([0.25], [0.75]))
    found = find_crossings(reach, region)
    assert not isinstance(found, Missed)
    first, last = math.log(2.0 / 0.75), math.log(1.0 / 0.25)
    assert all(first <= c.time <= first + 0.06 for c in found)
    assert all(c.time + c.window <= last and c.window > last - first - 0.15 for c in found)
    # int x^2 = (x(0)^2 - x(t)^2) / 2
    assert all(c.energy >= 2.0 * (1 - math.exp(-2 * c.time)) for c in found)
    assert 0.0 <= (reach.earliest(region, 1) or 0.0) <= math.log(1.0 / 0.75)


def test_parts_with_times_of_their_own() -> None:
    # Wider than the target at all times: no common instant, but every start passes through it.
    found = find_crossings(Reach(decaying(start=(1.0, 3.0)), None), Region(mg.Box([0.45], [0.9])))
    assert not isinstance(found, Missed)
    assert len(found) > 1
    assert max(c.time for c in found) >= math.log(3.0 / 0.9)


def test_the_horizon_counts() -> None:
    region, flow = Region(mg.Box([-1.0], [0.75])), decaying()
    assert isinstance(find_crossings(Reach(flow, 0.9), region), Missed)
    assert not isinstance(find_crossings(Reach(flow, 1.1), region), Missed)


def test_nothing_is_inside_before_the_constraints_are_proved() -> None:
    flow = decaying(limit=1.5)
    assert proved_instants(flow) == -1
    assert isinstance(find_crossings(Reach(flow, None), Region(mg.Box([-9.0], [9.0]))), Missed)
    assert proved_instants(decaying(limit=2.05)) > 10


@pytest.mark.parametrize("name", ["first", "second"])
def test_a_constraint_that_is_broken_on_the_way(name: str) -> None:
    """x = x0 + t: one of two constraints ends at x = 1, the target begins at 1.5."""
    mode = mg.Mode(
        "m",
        PLANT,
        controller=lambda x: 1.0 + 0.0 * x[0],
        reference=mg.setpoint([0.0]),
        start=mg.Box([0.0], [0.1]),
        constraints=lambda x: {key: x[0] <= (1.0 if key == name else 9.0) for key in ("first", "second")},
    )
    c = compile_mode(mode, None)
    flow = Flow(c.fields, c.whole(), c.w_centre, c.w_radius, Order(1, 0), names=c.loop.names, longest_step=0.05)
    assert flow.run(2.5)
    assert 0.8 < flow.times[proved_instants(flow)] <= 0.9
    assert isinstance(find_crossings(Reach(flow, None), Region(mg.Box([1.5], [2.5]))), Missed)
    assert not isinstance(find_crossings(Reach(flow, None), Region(mg.Box([0.4], [0.8]))), Missed)


def test_the_stay_in_a_target_on_its_own_memory() -> None:
    source = mg.Mode(
        "a",
        PLANT,
        controller=lambda x: -x[0],
        reference=mg.setpoint([0.0]),
        start=mg.Box([1.0], [1.0001]),
        memory=mg.Memory(1, lambda z: -z, lambda x: [0.0 * x[0]]),
    )
    # Between two instants of the grid, near t = 0.6266 s, the reset jumps to 1 and leaves the target.
    bump = math.exp(-0.6266399997693952)
    target = mg.Mode(
        "b",
        PLANT,
        controller=lambda x: -x[0],
        reference=mg.setpoint([0.0]),
        start=mg.Box([0.2, -0.1], [1.2, 0.1]),
        memory=mg.Memory(1, lambda z: -z, lambda x: [np.exp(-(((x[0] - bump) / 0.001) ** 2))]),
    )
    verdict = mg.build([source, target], budget=20.0).verdict("a", "b")
    assert verdict.status is not mg.Status.CERTIFIED or verdict.window <= 0.6266
