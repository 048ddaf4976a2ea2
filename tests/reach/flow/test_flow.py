"""What a flow says of constraints and energy along its steps, against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.reach.compiled import compile_mode
from modegraph.reach.flow.flow import Flow, Order


def flow_of(dynamics: Any, start: Any, until: float, **more: Any) -> Flow:
    plant = mg.System(dynamics, states=start.dim, inputs=1)
    more = {"controller": lambda x: 0.0 * x[0], "reference": mg.setpoint([0.0])} | more
    c = compile_mode(mg.Mode("m", plant, start=start, **more), None)
    flow = Flow(c.fields, c.whole(), c.w_centre, c.w_radius, Order(3, 2), names=c.loop.names)
    assert flow.run(until)
    return flow


@pytest.mark.parametrize("sharp", [1.0, 10.0, 40.0])
def test_a_constraint_is_bounded_between_the_ends_of_a_step(sharp: float) -> None:
    """x = x0 + t passes a hill: its top lies inside some step."""
    hill = lambda x: 0.5 - sharp * (x - 0.31) ** 2
    flow = flow_of(
        lambda x, u: np.array([1.0 + 0.0 * x[0]]), mg.Box([-0.01], [0.01]), 1.0,
        constraints=lambda x: {"hill": hill(x[0]) <= 0.0},
    )  # fmt: skip
    for step in flow.steps:
        t = np.linspace(step.start, step.end, 33)
        for x0 in (-0.01, 0.0, 0.01):
            assert hill(x0 + t).max() <= step.face_upper[0] + 1e-15


def test_the_energy_of_a_coarse_polynomial() -> None:
    """u = x^3 at rest: u^2 = x^6 is far above the degree that the energy is followed in."""
    flow = flow_of(
        lambda x, u: np.array([0.0 * x[0] + 0.0 * u[0]]), mg.Box([-1.0], [1.0]), 2.0, controller=lambda x: x[0] ** 3
    )
    for step in flow.steps:
        bound = float(flow.seen_bounds.upper(step.energy)) + step.energy_radius
        assert bound >= step.end
    decaying = flow_of(lambda x, u: np.array([u[0]]), mg.Box([1.0], [2.0]), 2.0, controller=lambda x: -x[0])
    for step in decaying.steps:
        bound = float(decaying.seen_bounds.upper(step.energy)) + step.energy_radius
        true = 2.0 * -np.expm1(-2.0 * step.end)
        assert true <= bound <= 1.05 * true
