from __future__ import annotations

import json
from fractions import Fraction

import matplotlib.pyplot as plt
import pytest

from modegraph.certify.verdict import Status, Verdict
from modegraph.errors import ModegraphError, NotBuiltYet
from modegraph.plan.plan import Plan, rounded_up
from tests.graph.fakes import because, certified, graph, mode


def chain(**checks: Verdict) -> Plan:
    g = graph(
        ["a", mode("b", 3), "c"],
        {
            ("a", ("b", 1)): certified(0.3, earliest=0.1, energy=0.1, margin=0.25),
            (("b", 1), "c"): certified(0.6, earliest=0.2, energy=0.2, margin=0.75, window=2.0),
        },
        checks,
    )
    return g.plan("a", "c")


def test_figures_of_the_chain_are_bounds() -> None:
    plan = chain()
    assert plan.modes == ["a", "b", "c"]
    assert [len(s.references) for s in plan.switches] == [1, 1]
    assert plan.references[1] == [1.0]
    assert Fraction(plan.time[0]) <= Fraction(0.1) + Fraction(0.2)
    assert Fraction(plan.time[1]) >= Fraction(0.3) + Fraction(0.6)
    assert plan.energy is not None
    assert Fraction(plan.energy) >= Fraction(0.1) + Fraction(0.2)
    assert plan.margin == 0.25
    assert plan.switches[1].window == 2.0


def test_rounding_up_is_the_next_double_at_most() -> None:
    third = Fraction(1, 3)
    assert Fraction(rounded_up(third)) >= third
    assert rounded_up(third) - 1 / 3 <= 1e-16
    assert rounded_up(Fraction(0.1)) == 0.1


def test_a_goal_not_certified_for_all_time_carries_a_warning() -> None:
    assert chain().warnings == ()
    undecided = chain(c=Verdict(Status.UNDECIDED, because("no tail was found"), until=4.0))
    assert undecided.goal_check.until == 4.0
    assert "proved until 4 s" in undecided.warnings[0]
    assert "no tail was found" in str(undecided)
    refuted = chain(c=Verdict(Status.REFUTED, because("speed is violated")))
    assert "do not hold" in refuted.warnings[0]


def test_json_has_the_attribute_names_and_no_nan() -> None:
    plan = chain(c=Verdict(Status.UNDECIDED, because("why"), margin=float("nan"), until=float("inf")))
    data = json.loads(plan.to_json(), parse_constant=pytest.fail)
    for key in ("modes", "switches", "energy", "margin", "warnings"):
        assert key in data
    assert data["references"] == [[0.0], [1.0], [0.0]]
    assert data["time"] == list(plan.time)
    assert data["goal_check"]["margin"] is None
    assert data["goal_check"]["until"] is None
    assert data["switches"][0]["source"] == "a"


def test_text_names_the_references_that_were_chosen() -> None:
    text = str(chain())
    assert text.startswith("a b c\n")
    assert "b [1]" in text


def test_later_layers_say_that_they_are_missing() -> None:
    with pytest.raises(NotBuiltYet):
        chain().supervisor()
    with pytest.raises(NotBuiltYet):
        chain().export_c("folder")


def test_simulate_needs_a_start() -> None:
    with pytest.raises(ModegraphError, match="x0"):
        chain().simulate()


def test_plot_returns_the_axes() -> None:
    figure, ax = plt.subplots()
    assert chain().plot(ax=ax) is ax
    plt.close(figure)
