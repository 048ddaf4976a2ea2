"""One mode of a run, in plain floats."""

from __future__ import annotations

import numpy as np
import pytest

from modegraph.errors import ModegraphError
from modegraph.model.memory import Memory
from modegraph.model.mode import Mode
from modegraph.model.reference import setpoint
from modegraph.model.sets import Box
from modegraph.model.system import System
from modegraph.model.trajectory import trajectory
from modegraph.run.live import Live, numeric
from tests.graph.fakes import PLANT, mode


def test_a_function_takes_what_it_names() -> None:
    def law(x: float, *, t: float, gain: float = 3.0) -> float:
        return gain * x + t

    assert numeric(law, "mode 'a'", "controller")({"x": 2.0, "t": 1.0, "r": 9.0}) == 7.0
    with pytest.raises(ModegraphError, match="mode 'a': the controller failed with ZeroDivisionError"):
        numeric(lambda x: x / 0, "mode 'a'", "controller")({"x": 2})


def test_disturbance_and_unknowns_are_at_their_centres() -> None:
    plant = System(
        lambda x, u, w, d: u + w + d["m"], states="x", inputs="u", disturbance=Box([0.0], [1.0]), unknowns={"m": (1, 3)}
    )
    a = Mode("a", plant, controller=lambda x, r: r - x, reference=setpoint([1.0]), start=Box([0], [1]))
    assert Live(a, None, None, 0.0).slope(0.0, np.array([0.25]), np.inf).tolist() == [0.75 + 0.5 + 2.0]


def test_memory_is_reset_and_integrated() -> None:
    a = Mode(
        "a", PLANT, controller=lambda x, z: -z, reference=setpoint([0.0]), start=Box([-1], [1]),
        memory=Memory("z", lambda x, z: x - z, lambda x: 3.0 * x),
    )  # fmt: skip
    live = Live(a, None, None, 0.0)
    y = live.entry(np.array([0.5]))
    assert y.tolist() == [0.5, 1.5]
    assert live.slope(0.0, y, np.inf).tolist() == [-1.5, -1.0]


def test_at_the_end_of_a_piece_the_reference_is_the_one_before_the_jump() -> None:
    steps = trajectory(lambda t: np.array([np.where(t < 1.0, 0.0, 5.0)]), 2.0, breakpoints=(1.0,))
    a = Mode("a", PLANT, controller=lambda x, r: r - x, reference=steps, start=Box([-1], [1]))
    live = Live(a, None, None, 0.0)
    assert live.breaks == [1.0, 2.0]
    assert live.values(1.0, np.zeros(1), 1.0)["u"].tolist() == [0.0]
    assert live.values(1.0, np.zeros(1), 2.0)["u"].tolist() == [5.0]


def test_another_plant() -> None:
    clock = Live(mode("a"), None, lambda t, x: np.array([t]), entered=4.0)
    assert clock.slope(0.5, np.zeros(1), np.inf).tolist() == [4.5]
    with pytest.raises(ModegraphError, match="plant has 2 states and 1 inputs, mode 'a' expects 1 and 1"):
        Live(mode("a"), None, System(lambda x, u: 0.0 * x + u, states=2, inputs=1), 0.0)


def test_what_goes_wrong_is_named() -> None:
    undefined = Mode("a", PLANT, controller=lambda x: np.log(x), reference=setpoint([0.0]), start=Box([0.5], [1]))
    live = Live(undefined, None, None, 0.0)
    live.require_finite(np.array([1.0]))
    with np.errstate(all="ignore"), pytest.raises(ModegraphError, match=r"mode 'a': the controller returned"):
        live.require_finite(np.array([-1.0]))
    wide = Live(mode("a"), None, lambda x: np.zeros(3), 0.0)
    with pytest.raises(ModegraphError, match=r"the dynamics returned shape \(3,\), expected \(1,\)"):
        wide.slope(0.0, np.zeros(1), np.inf)


def test_violated_constraints_are_named() -> None:
    a = Mode(
        "a", PLANT, controller=lambda x, r: r - x, reference=setpoint([0.0]), start=Box([-1], [1]),
        constraints=lambda x, u: {"wall": x <= 1.0, "force": abs(u) <= 9.0},
    )  # fmt: skip
    live = Live(a, None, None, 0.0)
    assert live.violated(live.values(0.0, np.array([2.0]), np.inf)) == ["wall"]
    assert live.violated(live.values(0.0, np.array([1.0]), np.inf)) == []
    assert Live(mode("b"), None, None, 0.0).violated({}) == []
