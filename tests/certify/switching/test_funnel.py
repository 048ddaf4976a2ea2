"""Switches that a funnel proves after the flow."""

from typing import Any

import numpy as np

import modegraph as mg
from modegraph.certify.switching.common_time import Missed
from modegraph.certify.switching.funnel import Arrival, Sinking
from modegraph.certify.targets.region import Region
from modegraph.reach.tail.funnel import Funnel, FunnelBuilder
from tests.reach.tail.test_decay import settled


def scalar_sinking() -> Sinking:
    loop = settled(lambda x, w: np.array([-x[0] + w[0]]), 1, mg.Box([-0.1], [0.1]))
    points = np.linspace(-1.0, 1.0, 21)[:, None]
    funnel = FunnelBuilder(loop).build(points, np.ones(1), lambda s: False)
    assert isinstance(funnel, Funnel)
    return Sinking(funnel, 0, funnel.rungs[0].radius, 2.0)


def test_a_funnel_is_as_wide_as_its_mouth() -> None:
    """The constraints of all rungs count, the widest first; |x| <= 3 at the mouth of about 1."""
    limits = lambda x: {"top": x[0] <= 3.0}
    loop = settled(lambda x, w: np.array([-x[0] + w[0]]), 1, mg.Box([-0.1], [0.1]), constraints=limits)
    funnel = FunnelBuilder(loop).build(np.linspace(-1.0, 1.0, 21)[:, None], np.ones(1), lambda s: False)
    assert isinstance(funnel, Funnel)
    assert len(funnel.rungs) > 1
    assert funnel.rungs[0].lower < 0.9 * funnel.rungs[0].radius
    sinking = Sinking(funnel, 0, funnel.rungs[0].radius, 0.0)
    tail = sinking.tail()
    assert tail.face_upper[0] >= tail.hi[0] - 3.0 - 1e-9
    assert tail.hi[0] >= 0.99
    assert sinking.slack()["top"] <= 2.01


def test_arrival_is_no_earlier_than_the_worst_trajectory() -> None:
    sinking = scalar_sinking()
    start = sinking.funnel.rungs[0].radius * abs(float(sinking.funnel.rungs[0].norm.axes[0, 0]))
    for target in (0.8, 0.5, 0.3):
        arrival = sinking.arrival(Region(mg.Ball([0.0], target)), np.inf)
        assert isinstance(arrival, Arrival)
        # Under w = .1 x(t) = .1 + (x0 - .1) exp(-t).
        assert arrival.seconds >= np.log((start - 0.1) / (target - 0.1)) * (1.0 - 1e-9)
        assert arrival.seconds < 8.0


def test_what_the_disturbance_can_hold_outside_is_never_reached() -> None:
    assert isinstance(scalar_sinking().arrival(Region(mg.Ball([0.0], 0.099)), np.inf), Missed)


def test_a_deadline_is_kept() -> None:
    sinking = scalar_sinking()
    region = Region(mg.Ball([0.0], 0.3))
    arrival = sinking.arrival(region, np.inf)
    assert isinstance(arrival, Arrival)
    for part in (0.1, 0.5, 0.9, 0.97):
        assert isinstance(sinking.arrival(region, 2.0 + part * arrival.seconds), Missed)
    assert isinstance(sinking.arrival(region, 1.0), Missed)
    assert isinstance(sinking.arrival(region, 2.0 + 1.1 * arrival.seconds), Arrival)


def pendulum(target: float, w: float) -> Any:
    def dynamics(x: Any, u: Any, w: Any) -> Any:
        return np.array([x[1], -np.sin(x[0]) + u[0] + w[0]])

    plant = mg.System(dynamics, states="angle rate", inputs="torque", disturbance=mg.Box([-w], [w]))

    def mode(name: str, radius: float) -> mg.Mode:
        return mg.Mode(
            name,
            plant,
            controller=lambda x, r: -2.0 * x[:1] - 2.0 * x[1:],
            reference=mg.setpoint([0.0]),
            start=mg.Ball([0.0, 0.0], radius),
        )

    return mg.build([mode("wide", 0.5), mode("tight", target)], horizon=30.0).verdict("wide", "tight")


def test_a_target_just_wider_than_what_the_disturbance_fills() -> None:
    # Linearised, a constant w = .1 holds the angle at .1 / 3.
    assert pendulum(0.1, 0.1).status is mg.Status.CERTIFIED
    assert pendulum(0.03, 0.1).status is not mg.Status.CERTIFIED
