"""Classes of references at extreme scales, thin in a direction, cancelling in floats; and ends that overlap."""

from __future__ import annotations

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
