"""What a flow shows of itself."""

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.legal import unproved
from modegraph.certify.switching.common_time import proved_instants
from modegraph.reach.compiled import compile_mode
from modegraph.reach.failure import Failure, Mechanism
from modegraph.reach.flow.flow import Flow, Order


def two_modes(start: float) -> mg.ModeGraph:
    plant = mg.System(lambda x, u: np.array([u[0]]), states="level", inputs="flow")

    def mode(name: str, gain: float, radius: float) -> mg.Mode:
        return mg.Mode(
            name,
            plant,
            controller=lambda x, r: -gain * (x - r),
            reference=mg.setpoint([0.0]),
            start=mg.Ball([0.0], radius),
        )

    return mg.build([mode("slow", 1.0, start), mode("fast", 5.0, 0.25)], horizon=5.0)


def test_widths_are_those_of_the_reach_set() -> None:
    widths = two_modes(1.0).verdict("slow", "fast").widths
    assert widths is not None
    assert widths.states == ("level",)
    assert widths.times[0] == 0.0
    exact = 2.0 * np.exp(-widths.times)
    assert (widths.values[:, 0] >= exact * (1.0 - 1e-12)).all()
    assert (widths.values[:, 0] <= exact * (1.0 + 1e-6)).all()


def test_explain_shows_them() -> None:
    text = str(two_modes(1.0).explain("slow", "fast"))
    assert "width of the reach set over time" in text
    assert "level" in text.split("over time:")[1]


def falling(limit: float) -> mg.Mode:
    """The input jumps from 0 to r' = 2 at t = 1, where the constraint u <= limit is asked of both sides."""
    plant = mg.System(lambda x, u: np.array([-x[0] + u[0]]), states="level", inputs="flow")
    reference = mg.trajectory(lambda t: np.where(t < 1.0, 0.0, 2.0 * (t - 1.0)) * np.ones(1), 2.0, breakpoints=[1.0])
    return mg.Mode(
        "ramp", plant, controller=lambda r: r.dot, reference=reference, start=mg.Box([-0.1], [0.1]),
        constraints=lambda u: {"flow": u[0] <= limit},
    )  # fmt: skip


def followed(mode: mg.Mode, end: float) -> Flow:
    compiled = compile_mode(mode, None)
    flow = compiled.flow(compiled.whole(), Order(1, 0))
    flow.run(end)
    return flow


def test_a_constraint_that_fails_behind_a_breakpoint_only_is_told_with_its_own_number() -> None:
    flow = followed(falling(1.5), 1.0)
    proved = proved_instants(flow)
    assert 0 <= proved < len(flow.steps)
    found = unproved(flow, proved)
    assert found is not None
    assert found.constraint == "flow"
    assert found.time == 1.0
    assert found.by == pytest.approx(0.5)


def test_where_the_flow_cannot_begin_no_constraint_is_blamed_that_holds() -> None:
    flow = followed(falling(3.0), 0.0)
    flow.failure = Failure(Mechanism.CLASS_TOO_LARGE)
    assert proved_instants(flow) == -1
    assert unproved(flow, -1) is None


def test_a_constraint_that_fails_at_the_start_is_told() -> None:
    flow = followed(falling(-0.25), 0.0)
    found = unproved(flow, proved_instants(flow))
    assert found is not None
    assert (found.constraint, found.time) == ("flow", 0.0)
    assert found.by == pytest.approx(0.25)
