"""A plant without inputs: x' = f(x), from the model to the run."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg

DECAY = mg.System(lambda x: -x, states="a b", inputs=0)
START = mg.Box([0.9, 0.9], [1.0, 1.0])
TARGET = mg.Target("low", mg.Box([-0.2, -0.2], [0.2, 0.2]))


def fall(controller: Any, system: mg.System = DECAY) -> mg.Mode:
    limits = lambda x: {"a": x[0] <= 1.5}
    return mg.Mode(
        "fall", system, controller=controller, reference=mg.setpoint([0.0]), start=START, constraints=limits
    )  # fmt: skip


@pytest.mark.parametrize("controller", [None, lambda x: np.zeros(0), lambda r: []], ids=["none", "zeros", "list"])
def test_it_is_proved_planned_and_run(controller: Any) -> None:
    graph = mg.build([fall(controller), TARGET], horizon=5.0)
    assert graph.verdict("fall", "low").certified
    assert graph.check("fall").certified
    plan = graph.plan("fall", "low", minimize="energy")
    assert 0.0 <= plan.energy < 1e-300  # an upper bound, rounded up
    run = plan.simulate([1.0, 0.95])
    assert run.ok
    assert run.u.shape == (len(run.t), 0)
    run.plot()
    assert mg.flowpipe(fall(controller), horizon=1.0).at(1.0).contains(np.exp(-1.0) * np.array([0.95, 0.95]))


def test_the_relaxed_twin_is_refuted() -> None:
    graph = mg.build([fall(None), mg.Target("far", mg.Box([2.0, 2.0], [3.0, 3.0]))], horizon=5.0)
    assert graph.verdict("fall", "far").refuted


def test_only_a_plant_without_inputs_needs_no_controller() -> None:
    with pytest.raises(mg.ModegraphError, match=r"mode 'fall': controller must be a function; None is for .* has u"):
        fall(None, mg.System(lambda x, u: u[0] - x, states="a b", inputs="u"))
    with pytest.raises(mg.ModegraphError, match=r"controller returned 1 entry, expected 0"):
        mg.build([fall(lambda x: 1.0), TARGET])
