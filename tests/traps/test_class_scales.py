"""Classes of references at extreme scales, thin in a direction, cancelling in floats; and ends that overlap."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg

Box = mg.Box
LINE = mg.System(lambda x, u: u, states="x", inputs="u")
PLANE = mg.System(lambda x, u: u, states="x y", inputs="u v")


@pytest.mark.parametrize("scale", [1e-150, 1e-165, 1e-200])
def test_a_round_target_so_small_that_squares_underflow(scale: float) -> None:
    """The centre rests at (scale, scale), ten radii outside the target ball around 0: its distance is squared to 0."""

    def mode(name: str, radius: float) -> mg.Mode:
        return mg.Mode(
            name, PLANE, controller=lambda x, r: r - x, reference=mg.setpoint(Box([0.0, 0.0], [scale, scale])),
            start=lambda r: mg.Ball(r, scale * radius),
        )  # fmt: skip

    refs = mg.build([mode("a", 0.01), mode("b", 0.1)], horizon=0.1).references("a", "b")
    assert not refs.contains([scale, scale], [0.0, 0.0])


def carry() -> mg.Mode:
    """Ends elsewhere than it starts, so it is no walk."""
    path = mg.trajectory(lambda t, p: p + t * 0.5 * (p + 0.2), 1.0, over=Box([0.0], [10.0]))
    return mg.Mode(
        "carry", LINE, controller=lambda x, r: 4 * (r - x) + r.dot, reference=path, start=lambda r: mg.Ball(r, 0.3)
    )


def test_the_bound_of_a_plan_whose_ends_may_be_one_reference() -> None:
    """Any reference in [4, 4.5] is start and goal at once: no switch is needed."""
    graph = mg.build([carry(), mg.Target("goal", Box([8.0], [8.5]))], horizon=3.0)
    plan = graph.plan("carry", "carry", r_start=Box([0.0], [4.5]), r_goal=Box([4.0], [6.0]))
    assert plan.bound == 0.0
    assert plan.modes == ["carry"]


def test_a_start_set_that_floats_move_is_not_certified() -> None:
    """(1e12 + r) - 1e12 in floats is off by up to 6e-5: the start set of r is not where the formula says."""

    def mode(name: str, reference: mg.Box | mg.Points, radius: float, shift: float) -> mg.Mode:
        return mg.Mode(
            name, LINE, controller=lambda x, r: r - x, reference=mg.setpoint(reference),
            start=lambda r: mg.Ball((shift + r) - shift, radius),
        )  # fmt: skip

    p = 0.8326441476533978
    verdicts = []
    for reference in (Box([0.0], [1.0]), mg.Points([[p], [0.5]])):
        graph = mg.build([mode("a", reference, 1e-6, 0.0), mode("b", reference, 2e-6, 1e12)], horizon=20.0)
        verdicts.append(graph.verdict("a", "b", [p], [p]).status)
    assert {*verdicts} != {mg.Status.CERTIFIED, mg.Status.REFUTED}


def test_the_volume_of_a_class_that_is_thin_in_one_parameter() -> None:
    def mode(name: str) -> mg.Mode:
        return mg.Mode(
            name, PLANE, controller=lambda x, r: r - x, reference=mg.setpoint(Box([-1.0, 0.0], [1.0, 0.0])),
            start=lambda r: mg.Ball(r, 0.3),
        )  # fmt: skip

    assert mg.build([mode("a"), mode("b")], horizon=3.0).references("a", "b").volume == (0.0, 0.0)


def test_a_kink_and_one_start_set_for_the_whole_class() -> None:
    trap = mg.Mode(
        "m", LINE, controller=lambda x, r: np.clip(3 * (r - x), -0.5, 0.5), reference=mg.setpoint(Box([-1.0], [1.0])),
        start=lambda r: mg.Ball([0.0], 0.1),
    )  # fmt: skip
    mg.flowpipe(trap, horizon=8.0)


def test_a_reference_without_an_axis() -> None:
    mode = mg.Mode(
        "m", LINE, controller=lambda x, r: r - x, reference=mg.setpoint(Box([-1.0], [1.0])),
        start=lambda r: mg.Ball(r, 0.1),
    )  # fmt: skip
    mode.find(np.array(0.1))


@pytest.mark.parametrize("scale", [1.0, 1e-150, 1e-165, 1e-200])
@pytest.mark.parametrize("outside", [False, True])
def test_sets_so_small_that_squares_underflow_are_inside_or_not_at_once(scale: float, outside: bool) -> None:
    """Nothing moves, so a start is in the target at once or never. A ball of one radius around the reference, in a
    ball of two: the centres are at most one radius apart, or a quarter of it more."""
    still = mg.System(lambda x, u: 0.0 * u, states="x y", inputs="u v")

    def mode(name: str, radius: float) -> mg.Mode:
        return mg.Mode(
            name, still, controller=lambda x, r: 0.0 * r, reference=mg.setpoint(Box([0.0] * 2, [4 * scale] * 2)),
            start=lambda r: mg.Ball(r, scale * radius),
        )  # fmt: skip

    refs = mg.build([mode("a", 1.0), mode("b", 2.0)], horizon=0.1).references("a", "b")
    distance = 1.25 * scale if outside else 0.75 * scale
    assert refs.contains([0.0, 0.0], [0.6 * distance, 0.8 * distance]) == (not outside)


@pytest.mark.parametrize("limit", [0.5, 0.25])
def test_a_set_inside_another_whose_constraint_is_broken_at_the_start(limit: float) -> None:
    """Every start of the one is in the other at t = 0, but some starts break |x| <= limit there already."""
    region = Box([-0.25], [0.25])

    def mode(name: str, radius: float, constraints: Any = None) -> mg.Mode:
        return mg.Mode(
            name, LINE, controller=lambda x, r: 0.0 * r, reference=mg.setpoint(region), constraints=constraints,
            start=lambda r: Box(r - radius, r + radius),
        )  # fmt: skip

    bounded = mode("bounded", 0.125, lambda x: {"limit": abs(x[0]) <= limit})
    graph = mg.build([bounded, mode("wide", 0.25)], horizon=1.0)
    wanted = mg.Status.CERTIFIED if limit == 0.5 else mg.Status.UNDECIDED
    assert graph.verdict("bounded", "wide").status is wanted
    refs = graph.references("bounded", "wide")
    assert refs.contains([0.0], [0.125]) == (limit == 0.5)
    assert bool(refs.cells) == (limit == 0.5)


@pytest.mark.parametrize("further", [False, True])
def test_start_sets_that_touch_what_they_never_come_nearer_to(further: bool) -> None:
    """x stays where it is: [r - 1/4, r + 1/4] is in [r' - 1/2, r' + 1/2] for |r - r'| <= 1/4, to the last unit."""
    still = mg.System(lambda x, u: 0.0 * u, states="x", inputs="u")

    def mode(name: str, radius: float) -> mg.Mode:
        return mg.Mode(
            name, still, controller=lambda x, r: 0.0 * r, reference=mg.setpoint(Box([-1.0], [1.0])),
            start=lambda r: Box(r - radius, r + radius),
        )  # fmt: skip

    refs = mg.build([mode("a", 0.25), mode("b", 0.5)], horizon=1.0).references("a", "b")
    distance = np.nextafter(0.25, 1.0) if further else 0.25
    assert refs.contains([0.0], [distance]) == (not further)
