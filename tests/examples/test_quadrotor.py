"""The quadrotor finds its own way in wind: classes of references, plans through places it chose, and flights."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from tests.soundness.examples import load
from tests.soundness.quadrotor import KINDS, storm

EDGES = {
    *(f"{i} {j}" for i in ("hover", "climb", "cruise") for j in ("hover", "climb", "cruise", "land")),
    "land hover",
    "land touchdown",
    "touchdown landed",
}
AT, PLACE = [-4.0, 2.0], [3.0]


@pytest.fixture(scope="module")
def plan(quadrotor: Any) -> Any:
    return quadrotor.plan("hover", "touchdown", r_start=AT, r_goal=PLACE, minimize="time")


def test_switches(quadrotor: Any) -> None:
    assert {f"{s.source} {s.target}" for s in quadrotor.switches} >= EDGES
    # Nothing but the descent ends near enough to the ground, slow and level.
    for name in ("hover", "climb", "cruise"):
        assert quadrotor.verdict(name, "touchdown").status is not mg.Status.CERTIFIED
        assert quadrotor.verdict(name, "landed").status is not mg.Status.CERTIFIED


@pytest.mark.parametrize("name", ["hover", "climb", "cruise", "touchdown"])
def test_limits_hold_for_all_time_whatever_the_reference(quadrotor: Any, name: str) -> None:
    assert quadrotor.check(name).status is mg.Status.CERTIFIED, quadrotor.check(name).reason


def test_a_cruise_ends_where_it_was_sent(quadrotor: Any) -> None:
    assert quadrotor.verdict("cruise", "land", [-4.0, 2.0, 7.0], [3.0, 2.0]).status is mg.Status.CERTIFIED
    assert quadrotor.verdict("cruise", "land", [-4.0, 2.0, 7.0], [2.5, 2.0]).status is not mg.Status.CERTIFIED
    assert quadrotor.verdict("cruise", "land", [-4.0, 2.0, 7.0], [3.0, 2.4]).status is not mg.Status.CERTIFIED


def test_the_plan_goes_through_places_it_chose(quadrotor: Any, plan: Any) -> None:
    assert plan.modes == ["hover", "cruise", "land", "touchdown"]
    _, cruise, land, _ = plan.references
    assert cruise[:2] == pytest.approx(AT, abs=0.1)
    assert cruise[0] + cruise[2] == pytest.approx(PLACE[0], abs=0.1)
    assert land == pytest.approx([PLACE[0], AT[1]], abs=0.1)
    assert plan.time[1] <= 15.0
    assert not plan.warnings
    for a, b, r_a, r_b in zip(plan.modes, plan.modes[1:], plan.references, plan.references[1:], strict=False):
        assert quadrotor.verdict(a, b, r_a, r_b).status is mg.Status.CERTIFIED


@pytest.mark.parametrize("minimize", ["switches", "time", "distance"])
def test_from_high_up_it_sinks_on_the_way(quadrotor: Any, minimize: str) -> None:
    found = quadrotor.plan("hover", "touchdown", r_start=[-4.0, 5.0], r_goal=PLACE, minimize=minimize)
    assert found.modes[0] == "hover"
    assert found.modes[-2:] == ["land", "touchdown"]
    if minimize == "time":
        assert found.modes == ["hover", "climb", "cruise", "land", "touchdown"]


def test_a_long_way_takes_two_cruises(quadrotor: Any) -> None:
    found = quadrotor.plan("hover", "hover", r_start=[-6.0, 5.0], r_goal=[5.5, 1.5], minimize="time")
    assert found.modes.count("cruise") == 2
    assert found.time[1] <= 25.0


def test_it_can_land_where_it_is(quadrotor: Any) -> None:
    found = quadrotor.plan("hover", "landed", r_start=AT, minimize="time")
    assert found.modes == ["hover", "land", "touchdown", "landed"]
    assert found.references[2] == pytest.approx([AT[0]], abs=0.1)


def test_flights_in_all_kinds_of_wind(plan: Any) -> None:
    winds = len(KINDS) + 4
    count, faults, used = storm(plan, winds, seed=3)
    assert not faults, faults[:3]
    assert count == winds * len(plan.switches)
    # The certified times are not far from what a wind can do.
    assert (used <= 1.0).all()
    assert used.max() >= 0.5


def test_the_library_flies_it_in_a_wind_of_the_users(plan: Any) -> None:
    module = load("quadrotor")
    gust = 0.25 * np.array([1.0, -1.0])
    run = plan.simulate(
        [-3.7, 2.1, 0.1, -0.3, 0.2, 0.4],
        plant=lambda t, x, u: module.dynamics(x, u, gust if np.sin(2.0 * t) > 0.0 else -gust),
        stay=1.0,
    )
    assert run.ok, run.message
    assert len(run.switch_times) == len(plan.switches)


def test_tasks_of_the_module(quadrotor: Any) -> None:
    for task in load("quadrotor").tasks.values():
        assert quadrotor.plan(**task).modes[-1] == task["goal"]


@pytest.mark.parametrize("target", ["climb", "cruise"])
def test_a_descent_that_starts_where_another_mode_does_may_go_over_to_it_at_once(quadrotor: Any, target: str) -> None:
    """The starts are equal: at t = 0 they fill the target, and touching is inside."""
    verdict = quadrotor.verdict("land", target)
    assert verdict.certified, verdict.reason
    (reason,) = verdict.why
    one = quadrotor.verdict("land", target, reason.fields["r_i"], reason.fields["r_j"])
    assert one.certified
    assert one.time == (0.0, 0.0)
    assert one.margin == pytest.approx(0.0, abs=1e-9)


def test_what_touches_its_own_start_is_said_to_touch_it(quadrotor: Any) -> None:
    """From one descent to another beside it: the starts are not inside, however near the other is."""
    verdict = quadrotor.verdict("land", "land")
    (reason,) = verdict.why
    assert reason.outcome is mg.Outcome.NO_COMMON_TIME
    assert reason.fields["time"] == 0.0
    assert 0.0 < reason.fields["gauge"] - 1.0 < 1e-5
    assert reason.fields["gauge"] == pytest.approx(1.0 - verdict.margin, abs=0.0)
    assert reason.fields["r_j"][0] == pytest.approx(reason.fields["r_i"][0])
    assert "(t = 0 s, " in verdict.reason
    assert "misses" in verdict.reason
    assert "reaches 1 times" not in verdict.reason
