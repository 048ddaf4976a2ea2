from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from modegraph.errors import ModegraphError
from modegraph.model.memory import Memory
from modegraph.model.mode import Mode
from modegraph.model.reference import setpoint
from modegraph.model.sets import Ball, Box
from modegraph.model.system import System
from modegraph.model.target import Target
from modegraph.model.trajectory import trajectory
from modegraph.run.simulate import simulate
from tests.graph.fakes import PLANT, certified, graph

LAG = System(lambda x, u: np.array([u[0] - x[0]]), states="x", inputs="u")


def lag(name: str, to: float, start: Any = None, **options: Any) -> Mode:
    """x' = to - x: from x0 it is at to + (x0 - to) exp(-t)."""
    start = Box([-9], [9]) if start is None else start
    return Mode(name, LAG, controller=lambda x: to, reference=setpoint([to]), start=start, **options)


def test_the_switch_happens_when_x_enters_the_next_start_set() -> None:
    run = simulate([lag("a", 0.0), lag("b", 1.0, Box([-0.5], [0.5]))], [None, None], [(0.0, 2.0)], [2.0], stay=3.0)
    assert run.ok
    assert run.switch_times == pytest.approx([math.log(4.0)], abs=1e-8)
    k = run.mode.index("b")
    assert run.t[k - 1] == run.t[k] == run.switch_times[0]
    assert run.x[k, 0] <= 0.5
    assert run.x[k, 0] == pytest.approx(0.5, abs=1e-9)
    assert run.u[k - 1, 0] == 0.0
    assert run.u[k, 0] == 1.0
    assert run.t[-1] == pytest.approx(run.switch_times[0] + 3.0)
    assert run.x[-1, 0] == pytest.approx(1.0 - 0.5 * math.exp(-3.0), abs=1e-7)
    assert np.all(np.diff(run.t) >= 0)
    assert list(run.visit) == [0] * k + [1] * (len(run.t) - k)
    assert run.states == ("x",)
    assert run.inputs == ("u",)


def test_a_start_set_that_holds_x_is_entered_at_once() -> None:
    modes = [lag("a", 5.0), lag("b", 6.0), lag("c", 7.0)]
    run = simulate(modes, [None] * 3, [(0.0, 0.0), (0.0, 0.0)], [0.0], stay=0.5)
    assert run.ok
    assert list(run.switch_times) == [0.0, 0.0]
    assert list(dict.fromkeys(run.mode)) == ["a", "b", "c"]
    assert run.x[:3].tolist() == [[0.0]] * 3


def test_a_brief_visit_to_the_next_start_set_is_not_missed() -> None:
    passing = System(lambda x: np.array([1.0, 0.0 * x[1]]), states="x y", inputs="u")
    a = Mode("a", passing, controller=lambda x: 0.0, reference=setpoint([0.0]), start=Box([0, 0], [0, 0]))
    b = Mode("b", passing, controller=lambda x: 0.0, reference=setpoint([0.0]), start=Box([5, -1], [5.05, 1]))
    run = simulate([a, b], [None, None], [(5.0, 5.05)], [0.0, 0.0], stay=0.1)
    assert run.ok
    assert run.switch_times == pytest.approx([5.0], abs=1e-9)


def test_a_target_ends_the_run() -> None:
    run = simulate([lag("a", 0.0), Target("dock", Ball([0.0], 0.1))], [None, None], [(0.0, 4.0)], [1.0])
    assert run.ok
    assert run.t[-1] == pytest.approx(math.log(10.0), abs=1e-8)
    assert run.mode[-1] == "dock"
    assert np.isnan(run.u[-1, 0])
    only = simulate([Target("dock", Ball([0.0], 0.1))], [None], [], [0.05])
    assert only.ok
    assert only.mode == ["dock"]


def test_the_goal_mode_runs_until_it_has_settled() -> None:
    run = simulate([lag("a", 1.0)], [None], [], [3.0])
    assert run.ok
    assert run.x[-1, 0] == pytest.approx(1.0, abs=1e-3)
    assert 5.0 < run.t[-1] < 12.0
    assert simulate([lag("a", 1.0)], [None], [], [1.0]).ok
    assert simulate([lag("a", 1.0)], [None], [], [3.0], stay=0.0).t[-1] == 0.0


def test_references_move_with_the_time_since_entry_and_jump_at_breakpoints() -> None:
    signal = lambda t: np.array([np.where(t < 1.0, t, 5.0)])
    follow = Mode(
        "follow",
        PLANT,
        controller=lambda x, r: r.dot,
        reference=trajectory(signal, 2.0, breakpoints=(1.0,)),
        start=Box([-9], [9]),
    )
    run = simulate([lag("a", 0.0), follow], [None, None], [(0.0, 0.0)], [0.5], stay=3.0)
    assert run.ok
    assert run.x[-1, 0] == pytest.approx(1.5, abs=1e-9)
    at_jump = [float(r) for t, r in zip(run.t, run.r[:, 0], strict=True) if t == 1.0]
    assert at_jump[0] == pytest.approx(1.0)
    assert at_jump[-1] == 5.0
    assert run.r[-1, 0] == 5.0


def test_memory_is_reset_on_every_entry() -> None:
    counter = Mode(
        "counter",
        LAG,
        controller=lambda x, z: -z,
        reference=setpoint([0.0]),
        start=Box([-9], [9]),
        memory=Memory("z", lambda z: np.array([1.0 + 0.0 * z[0]]), lambda x: x * 2.0),
    )
    run = simulate(
        [counter, lag("a", 0.0, Box([-1], [1])), counter],
        [None] * 3,
        [(0.0, 9.0), (0.0, 0.0)],
        [2.0],
        stay=1.0,
    )
    assert run.ok
    entries = [k for k in range(len(run.t)) if k == 0 or run.visit[k] != run.visit[k - 1]]
    assert run.z[entries[0], 0] == 4.0
    assert run.z[entries[2], 0] == 2.0 * run.x[entries[2], 0]
    assert run.z[-1, 0] == pytest.approx(run.z[entries[2], 0] + 1.0)
    assert np.isnan(run.z[entries[1], 0])


def test_violated_constraints_are_reported() -> None:
    limits = lambda x, u: {"height": x[0] <= 0.75, "both": np.array([x[0] >= -1.0, x[0] <= 5.0])}
    run = simulate([lag("a", 1.0, constraints=limits)], [None], [], [0.5])
    assert not run.ok
    (violation,) = run.violations
    assert (violation.mode, violation.constraint) == ("a", "height")
    assert violation.time == pytest.approx(math.log(2.0), abs=0.2)
    assert "height" in run.message
    assert simulate([lag("a", 0.7, constraints=limits)], [None], [], [0.5]).ok


def test_disturbance_and_unknowns_are_at_their_centres_and_plant_replaces_them() -> None:
    shaken = System(
        lambda x, u, w, d: np.array([u[0] - d["k"] * x[0] + w[0]]),
        states="x",
        inputs="u",
        disturbance=Box([0.0], [1.0]),
        unknowns={"k": (1.0, 3.0)},
    )
    a = Mode("a", shaken, controller=lambda x: 0.0, reference=setpoint([0.0]), start=Box([-9], [9]))
    assert simulate([a], [None], [], [1.0]).x[-1, 0] == pytest.approx(0.25, abs=1e-3)
    assert simulate([a], [None], [], [1.0], plant=LAG).x[-1, 0] == pytest.approx(0.0, abs=1e-3)
    pushed = simulate([a, a], [None, None], [(0.0, 0.0)], [1.0], plant=lambda t, u: u + np.cos(t), stay=2.0)
    assert pushed.x[-1, 0] == pytest.approx(1.0 + math.sin(2.0), abs=1e-8)


def test_time_of_a_plant_goes_on_through_a_switch() -> None:
    modes = [lag("a", 0.0), lag("b", 0.0, Box([0.5], [9]))]
    run = simulate(modes, [None, None], [(0.0, 1.0)], [0.0], plant=lambda t: np.array([1.0 + 0 * t]), stay=1.0)
    assert run.switch_times == pytest.approx([0.5])
    later = simulate(modes, [None, None], [(0.0, 1.0)], [0.0], plant=lambda t: np.array([2 * t]), stay=1.0)
    assert later.x[-1, 0] == pytest.approx((math.sqrt(0.5) + 1.0) ** 2)


def test_a_start_outside_needs_force() -> None:
    a = lag("a", 0.0, Box([-1], [1]))
    with pytest.raises(ModegraphError, match="force"):
        simulate([a], [None], [], [2.0])
    assert simulate([a], [None], [], [2.0], force=True).ok


def test_a_run_that_never_arrives_ends_and_says_so() -> None:
    run = simulate([lag("a", 0.0), lag("b", 0.0, Box([5], [6]))], [None, None], [(0.0, 1.0)], [1.0], force=True)
    assert not run.ok
    assert "did not reach" in run.message
    assert len(run.switch_times) == 0


def test_a_run_that_diverges_ends_and_says_so() -> None:
    blast = System(lambda x, u: np.array([x[0] ** 2 + u[0]]), states="x", inputs="u")
    a = Mode("a", blast, controller=lambda x: 0.0, reference=setpoint([0.0]), start=Box([0], [9]))
    run = simulate([a], [None], [], [1.0], stay=3.0)
    assert not run.ok
    assert "diverged" in run.message
    assert run.t[-1] < 1.001


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"plant": 3}, "plant"),
        ({"plant": System(lambda x: x, states=2, inputs=1)}, "2 states"),
        ({"plant": lambda t: np.zeros(3)}, "shape"),
        ({"plant": lambda t: 1 / 0}, "ZeroDivisionError"),
        ({"stay": -1}, "stay"),
        ({"stay": math.inf}, "stay"),
    ],
)
def test_wrong_options(options: dict[str, Any], match: str) -> None:
    with pytest.raises(ModegraphError, match=match):
        simulate([lag("a", 0.0)], [None], [], [1.0], **options)


@pytest.mark.parametrize("x0", [[1.0, 2.0], [math.nan], "x", None])
def test_wrong_starts(x0: Any) -> None:
    with pytest.raises(ModegraphError, match="a state must"):
        simulate([lag("a", 0.0)], [None], [], x0)


def test_a_controller_that_returns_nan_is_named() -> None:
    broken = Mode(
        "broken", LAG, controller=lambda x: np.log(x[0] - 1.0), reference=setpoint([0.0]), start=Box([0], [3])
    )
    with pytest.raises(ModegraphError, match=r"mode 'broken': the controller returned \[nan\]"):
        simulate([broken], [None], [], [0.5])


def test_a_plan_simulates_itself() -> None:
    g = graph([lag("a", 0.0), lag("b", 0.25, Box([-0.5], [0.5]))], {("a", "b"): certified(3.0)})
    plan = g.plan("a", "b", x0=[2.0])
    run = plan.simulate()
    assert run.ok
    assert plan.time[0] <= run.switch_times[0] <= plan.time[1]
    with pytest.raises(ModegraphError, match="outside the start set"):
        plan.simulate([20.0])
    assert plan.simulate([20.0], force=True).ok
