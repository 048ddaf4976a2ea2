from __future__ import annotations

import json

import pytest

from modegraph.certify.verdict import Status, Verdict
from modegraph.graph.modegraph import ModeGraph
from modegraph.model.sets import Box
from modegraph.model.target import Target
from modegraph.plan.as_json import json_text
from modegraph.report.tables import graph_data, print_checks, print_graph, print_run, run_data
from tests.graph.fakes import UNDECIDED, because, certified, graph, mode


@pytest.fixture
def g() -> ModeGraph:
    return graph(
        ["a", mode("b", 2), Target("dock", Box([-0.1], [0.1]))],
        {
            ("a", "b"): certified(1.5, earliest=0.25),
            ("a", "dock"): Verdict(Status.REFUTED, because("stays [/red] at [0.5, 1]")),
            ("b", "dock"): UNDECIDED,
        },
        {"b": Verdict(Status.UNDECIDED, because("no tail"))},
    )


def test_every_pair_and_every_check_has_its_row(g: ModeGraph, capsys: pytest.CaptureFixture[str]) -> None:
    print_graph(g)
    out = capsys.readouterr().out
    rows = [line.split() for line in out.splitlines()]
    assert ["a", "b", "certified", "0.25", "..", "1.5", "0.5"] in [r[:7] for r in rows]
    assert ["b", "b", "refuted"] in [r[:3] for r in rows]
    assert ["a", "a"] not in [r[:2] for r in rows]
    assert "stays [/red] at [0.5, 1]" in out
    assert ["b", "undecided", "undecided", "for", "2", "of", "2"] in [r[:7] for r in rows]
    assert "no tail" in out
    assert "1 certified, 3 refuted, 1 undecided of 5 pairs" in out


def test_checks_alone(g: ModeGraph, capsys: pytest.CaptureFixture[str]) -> None:
    print_checks({"b": g.check("b")})
    assert "no tail" in capsys.readouterr().out


def test_data_keys_are_attribute_names(g: ModeGraph) -> None:
    data = json.loads(json_text(graph_data(g)))
    assert data["modes"] == ["a", "b", "dock"]
    assert len(data["verdicts"]) == 5
    first = data["verdicts"][0]
    assert (first["source"], first["target"], first["status"]) == ("a", "b", "certified")
    assert set(Verdict.__dataclass_fields__) <= set(first)
    assert data["checks"]["b"]["status"] == "undecided"
    assert [(s["source"], s["target"]) for s in data["switches"]] == [("a", "b")]


def test_a_run_as_data_and_text(g: ModeGraph, capsys: pytest.CaptureFixture[str]) -> None:
    run = g.plan("a", "b").simulate([0.4], stay=0.5)
    data = json.loads(json_text(run_data(run)))
    assert data["ok"] is True
    assert len(data["x"]) == len(data["t"]) == len(data["mode"])
    print_run(run)
    out = capsys.readouterr().out
    assert "enters b" in out
    assert "the plan was executed" in out
