"""What starts reach as a function of the reference: for which references, and with which energy."""

from __future__ import annotations

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.moments import at_state, moments_of
from modegraph.certify.targets.family import target_class
from modegraph.reach.compiled import CompiledMode, compile_mode
from modegraph.reach.cover.restart import restarted
from modegraph.reach.flow.flow import Order

GOAL = target_class(mg.Target("goal", mg.Box([-1.0, -1.0], [1.0, 1.0])), None, 2)
CLASS = [(-1.0, 1.0)]


@pytest.fixture(scope="module")
def compiled() -> CompiledMode:
    plant = mg.System(
        lambda x, u, w: np.array([x[1], u[0] - 0.3 * np.sin(x[0]) + w[0]]), states=2, inputs=1,
        disturbance=mg.Box([-0.2], [0.2]),
    )  # fmt: skip
    mode = mg.Mode(
        "m", plant, controller=lambda x, r: -4.0 * (x[:1] - r) - 4.0 * x[1:],
        reference=mg.setpoint(mg.Box([-1.0], [1.0])), start=lambda r: mg.Ball([r[0], 0.0], 0.2),
    )  # fmt: skip
    return compile_mode(mode, None)


@pytest.mark.parametrize("restart", [False, True])
def test_a_flow_of_a_part_of_the_class_is_not_one_of_the_whole(compiled: CompiledMode, restart: bool) -> None:
    """After a restart the piece of a part scales its own range to [-1, 1], as a whole class does."""
    parameter = 2
    for piece, whole in [(compiled.whole(), True), *((half, False) for half in compiled.whole().split(parameter))]:
        flow = compiled.flow(piece, Order(3, 2))
        assert all(flow.advance(10.0) for _ in range(14))
        if restart:
            following = restarted([flow], compiled.fields)
            assert following is not None
            assert following.advance(10.0)
            flow = following
        found = moments_of(flow, GOAL, 10.0, CLASS)
        assert found is not None
        assert found.whole == whole
        assert bool(found.lo[0] <= -1.0 and found.hi[0] >= 1.0) == whole


def test_the_moments_follow_the_centre_and_the_spread_holds_the_rest(compiled: CompiledMode) -> None:
    flow = compiled.flow(compiled.whole(), Order(4, 3))
    assert all(flow.advance(10.0) for _ in range(20))
    found = moments_of(flow, GOAL, 10.0, CLASS)
    assert found is not None
    assert (np.diff(found.energy) >= -1e-9).all()
    below, above = found.over(np.array([[0.5]]), np.array([[0.5]]))
    # The rows are +-x: at the first instants the centre is the reference.
    assert below[0, 0, 0] == pytest.approx(0.5, abs=0.05)
    assert (above >= below).all()
    assert (found.spread[0, :1] >= 0.19).all()


def test_one_state_is_reached_at_once_and_costs_nothing() -> None:
    found = at_state(np.array([0.25, -0.5]), GOAL)
    assert found.times.tolist() == [0.0]
    assert found.energy.tolist() == [0.0]
    low, high = found.over(np.zeros((1, 0)), np.zeros((1, 0)))
    assert (low == high).all()
    assert sorted(low[0, 0].tolist()) == [-0.5, -0.25, 0.25, 0.5]
