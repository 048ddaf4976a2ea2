from __future__ import annotations

from typing import Any

import pytest

from modegraph.certify.verdict import Status, Verdict
from modegraph.errors import ModegraphError, Unreachable
from modegraph.graph.modegraph import ModeGraph
from modegraph.model.sets import Box
from modegraph.model.target import Target
from tests.graph.fakes import UNDECIDED, because, certified, graph, mode


@pytest.fixture
def diamond() -> ModeGraph:
    """a -> b -> d is quick and costly, a -> c -> d slow and cheap, a -> d direct and narrow."""
    return graph(
        "abcd",
        {
            ("a", "b"): certified(1.0, energy=9.0, margin=0.6),
            ("b", "d"): certified(1.0, energy=9.0, margin=0.4),
            ("a", "c"): certified(4.0, energy=1.0, margin=0.5),
            ("c", "d"): certified(4.0, energy=1.0, margin=0.5),
            ("a", "d"): certified(6.0, energy=10.0, margin=0.1),
        },
    )


@pytest.mark.parametrize(
    ("minimize", "modes", "cost"),
    [
        ("switches", "ad", 1),
        ("time", "abd", 2.0),
        ("energy", "acd", 2.0),
        ("margin", "acd", 0.5),
        ({"time": 1, "switches": 5}, "ad", 11.0),
        ({"time": 1, "switches": 3}, "abd", 8.0),
        ({"time": 0, "switches": 0}, "ad", 0.0),
    ],
)
def test_objectives(diamond: ModeGraph, minimize: Any, modes: str, cost: float) -> None:
    plan = diamond.plan("a", "d", minimize=minimize)
    assert plan.modes == list(modes)
    assert plan.cost == cost


def test_plans_lists_all_simple_alternatives_best_first(diamond: ModeGraph) -> None:
    assert ["".join(p.modes) for p in diamond.plans(9, "a", "d", minimize="time")] == ["abd", "ad", "acd"]


def test_modes_as_objects(diamond: ModeGraph) -> None:
    assert diamond.plan(diamond.modes["a"], diamond.modes["d"]).modes == ["a", "d"]


def test_ties_fewer_switches_then_latest_time_then_mode_order() -> None:
    g = graph(
        "abcde",
        {
            ("a", "c"): certified(1.0),
            ("c", "e"): certified(1.0),
            ("a", "b"): certified(1.0),
            ("b", "e"): certified(1.0),
            ("a", "d"): certified(0.5),
            ("d", "e"): certified(0.5),
        },
    )
    assert g.plan("a", "e").modes == ["a", "d", "e"]
    assert g.plan("a", "e", avoid=["d"]).modes == ["a", "b", "e"]
    assert g.plan("a", "e", minimize="margin").modes == ["a", "d", "e"]


def test_start_is_goal() -> None:
    g = graph([mode("a", 2), "b"], {("a", "a"): certified(2.0), ("a", "b"): certified(), ("b", "a"): certified()})
    stay = g.plan("a", "a", minimize="time")
    assert stay.modes == ["a"]
    assert stay.cost == 0
    assert stay.time == (0.0, 0.0)
    assert stay.margin is None
    assert g.plan("a", "a", r_start=1).references[0] == [1.0]
    moved = g.plan("a", "a", r_start=0, r_goal=1)
    assert moved.modes == ["a", "a"]
    assert [r[0] for r in moved.references if r is not None] == [0.0, 1.0]


def test_coupled_references_are_exact() -> None:
    """Projections meet in b, but what arrives at b(0) leaves only from b(1)."""
    pairs = {("a", ("b", 0)): certified(), (("b", 1), "c"): certified()}
    g = graph(["a", mode("b", 2), "c"], pairs)
    with pytest.raises(Unreachable):
        g.plan("a", "c")
    linked = graph(["a", mode("b", 2), "c"], {**pairs, (("b", 0), ("b", 1)): certified()})
    plan = linked.plan("a", "c")
    assert plan.modes == ["a", "b", "b", "c"]
    assert [None if r is None else r[0] for r in plan.references][1:3] == [0.0, 1.0]


def test_references_of_start_and_goal_bind() -> None:
    g = graph(
        [mode("a", 2), mode("b", 2)],
        {(("a", 0), ("b", 0)): certified(1.0), (("a", 1), ("b", 1)): certified(3.0)},
    )
    assert g.plan("a", "b", minimize="time").time[1] == 1.0
    assert g.plan("a", "b", r_goal=[1.0], minimize="time").time[1] == 3.0
    with pytest.raises(Unreachable):
        g.plan("a", "b", r_start=0, r_goal=1)
    with pytest.raises(ModegraphError):
        g.plan("a", "b", r_goal=7)


def test_via_in_order_and_zero_dwell_visits_do_not_count() -> None:
    table = {(i, j): certified() for i in "abc" for j in "abc" if i != j}
    assert graph("abc", table).plan("a", "c", via=["b"]).modes == ["a", "b", "c"]
    assert graph("abc", table).plan("a", "c", via="b").modes == ["a", "b", "c"]
    table["b", "c"] = certified(0.0)
    assert graph("abc", table).plan("a", "c", via=["b"]).modes == ["a", "b", "a", "c"]
    assert graph("abc", table).plan("a", "c", via=["a", "c"]).modes == ["a", "c"]
    assert graph("abc", table).plan("a", "a", via=["b", "a"]).modes == ["a", "b", "a"]


def test_avoid_is_never_entered_but_may_be_the_start() -> None:
    g = graph("abc", {("a", "b"): certified(), ("b", "c"): certified(), ("a", "c"): certified(9.0)})
    assert g.plan("a", "c", minimize="time", avoid=["a", "b"]).modes == ["a", "c"]
    with pytest.raises(Unreachable, match="avoiding c"):
        g.plan("a", "c", avoid=["c"])


def test_max_switches() -> None:
    g = graph("abc", {("a", "b"): certified(), ("b", "c"): certified(), ("a", "c"): certified(9.0)})
    assert g.plan("a", "c", minimize="time").modes == ["a", "b", "c"]
    assert g.plan("a", "c", minimize="time", max_switches=1).modes == ["a", "c"]
    with pytest.raises(Unreachable, match="at most 0 switches"):
        g.plan("a", "c", max_switches=0)


def test_from_a_state() -> None:
    g = graph(
        [mode("wide", radius=2.0), mode("narrow", 3, radius=0.25), "goal"],
        {
            ("wide", "narrow"): certified(),
            (("narrow", 2), "goal"): certified(),
            (("narrow", 0), "goal"): certified(),
        },
    )
    assert g.plan(x0=[2.1], goal="goal").modes == ["narrow", "goal"]
    assert g.plan(x0=[1.6], goal="goal").modes == ["wide", "narrow", "goal"]
    assert g.plan("wide", "goal", x0=[0.1]).modes == ["wide", "narrow", "goal"]
    assert g.plan(x0=[0.1], goal="narrow").modes == ["narrow"]
    with pytest.raises(Unreachable, match="no start set"):
        g.plan(x0=[9.0], goal="goal")
    with pytest.raises(Unreachable, match="no start set of mode 'goal'"):
        g.plan("goal", "goal", x0=[9.0])
    for wrong in ([0.0, 0.0], "here", [float("nan")]):
        with pytest.raises(ModegraphError, match="a state must"):
            g.plan(x0=wrong, goal="goal")


def test_targets_are_entered_and_never_left() -> None:
    g = graph(["a", "b", Target("dock", Box([-0.1], [0.1]))], {("a", "b"): certified(), ("b", "dock"): certified()})
    plan = g.plan("a", "dock")
    assert plan.modes == ["a", "b", "dock"]
    assert plan.warnings == ()
    assert "only entered" in plan.goal_check.reason
    assert g.plan(x0=[0.05], goal="dock").modes == ["dock"]
    with pytest.raises(ModegraphError, match="target"):
        g.plan("dock", "a")


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"start": "a"}, "goal"),
        ({"goal": "d"}, "start"),
        ({"start": "a", "goal": "dd"}, "did you mean 'd'"),
        ({"start": "a", "goal": "d", "via": ["x"]}, "no mode 'x'"),
        ({"start": "a", "goal": "d", "avoid": [3]}, "named by"),
        ({"start": "a", "goal": "d", "max_switches": -1}, "max_switches"),
        ({"start": "a", "goal": "d", "max_switches": 1.5}, "max_switches"),
        ({"start": "a", "goal": "d", "minimize": "money"}, "minimize"),
        ({"x0": [0.0], "goal": "d", "r_start": 0}, "r_start"),
    ],
)
def test_questions_that_make_no_sense(diamond: ModeGraph, options: dict[str, Any], match: str) -> None:
    with pytest.raises(ModegraphError, match=match) as caught:
        diamond.plan(**options)
    assert not isinstance(caught.value, Unreachable)


@pytest.mark.parametrize("k", [0, -1, 1.0, True])
def test_plans_needs_a_positive_count(diamond: ModeGraph, k: Any) -> None:
    with pytest.raises(ModegraphError, match="k must"):
        diamond.plans(k, "a", "d")


def test_energy_bounds_that_are_missing_come_last_and_are_told() -> None:
    g = graph(
        "abc",
        {
            ("a", "c"): certified(1.0, energy=None),
            ("a", "b"): certified(),
            ("b", "c"): certified(energy=50.0),
        },
    )
    assert g.plan("a", "c", minimize="energy").modes == ["a", "b", "c"]
    forced = g.plan("a", "c", minimize="energy", avoid=["b"])
    assert forced.cost == float("inf")
    assert forced.energy is None
    assert "no certified bound" in forced.warnings[0]


def test_only_certified_pairs_are_used() -> None:
    g = graph(
        "abc", {("a", "b"): UNDECIDED, ("b", "c"): certified(), ("a", "c"): Verdict(Status.REFUTED, because("no"))}
    )
    with pytest.raises(Unreachable) as caught:
        g.plan("a", "c")
    assert caught.value.reachable == ("a",)
    assert caught.value.helpful == (("a", "b"),)
