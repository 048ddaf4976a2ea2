"""One pair of a graph, and what it becomes when its modes are changed."""

from __future__ import annotations

import pytest

from modegraph.explain.pair import Pair
from modegraph.model.mode import Mode
from modegraph.model.reference import setpoint
from modegraph.model.sets import Box
from modegraph.model.start import mode_start
from modegraph.model.target import Target
from tests.graph.fakes import PLANT, mode

DOCK = Target("dock", Box([-0.25], [0.75]))


def pair(target: Mode | Target = DOCK, horizon: float | None = 5.0) -> Pair:
    source = mode("a")
    return Pair.of((source, mode("b"), DOCK), source, target, None, None, horizon)


def test_starts_and_target_are_scaled_about_their_centres() -> None:
    smaller = pair().shrunk(0.5)
    assert mode_start(smaller.source, None) == Box([-0.25], [0.25])
    assert smaller.entered == DOCK.set
    larger = pair().grown(2.0)
    assert larger.entered == Box([-0.75], [1.25])
    assert mode_start(larger.source, None) == Box([-0.5], [0.5])


def test_the_modes_of_the_graph_change_along_and_the_others_do_not() -> None:
    whole = pair()
    changed = whole.grown(2.0)
    assert [m.name for m in changed.modes] == ["a", "b", "dock"]
    assert changed.modes[1] is whole.modes[1]
    assert changed.modes[2] is changed.target
    assert changed.modes[0] is changed.source
    assert whole.entered == DOCK.set


def test_the_horizon_is_that_of_the_mode_else_of_the_graph() -> None:
    assert pair().source.horizon == 5.0
    assert pair().lasting(9.0).source.horizon == 9.0
    own = Mode("a", PLANT, controller=lambda x, r: r - x, reference=setpoint([0.0]), start=Box([0], [0]), horizon=2.0)
    assert Pair.of((own, DOCK), own, DOCK, None, None, 5.0).source.horizon == 2.0


def test_a_mode_that_is_followed_by_itself_stays_one_mode() -> None:
    two = mode("a", 2)
    first, second = two.reference.parameters()
    changed = Pair.of((two,), two, two, first, second, 5.0).grown(2.0)
    assert changed.source is changed.target is changed.modes[0]
    assert changed.entered == Box([0.0], [2.0])
    assert mode_start(changed.source, first) == Box([-0.5], [0.5])


def test_constraints_are_left_out() -> None:
    kept = Mode(
        "a", PLANT, controller=lambda x, r: r - x, reference=setpoint([0.0]), start=Box([-1], [1]),
        constraints=lambda x: {"wall": x[0] <= 2.0},
    )  # fmt: skip
    free = Pair.of((kept, DOCK), kept, DOCK, None, None, 5.0).unconstrained()
    assert free.source.constraints is None
    assert kept.constraints is not None


@pytest.mark.parametrize(("lo", "inside"), [(-0.25, True), (-0.26, False)])
def test_whether_all_starts_are_inside_already_is_decided_exactly(lo: float, inside: bool) -> None:
    source = Mode("a", PLANT, controller=lambda x, r: r - x, reference=setpoint([0.0]), start=Box([lo], [0.5]))
    assert Pair.of((source, DOCK), source, DOCK, None, None, 5.0).starts_inside == inside
