"""The benchmark cases: nothing is tuned for one of them, all of them build, none can stop the table."""

from __future__ import annotations

import dataclasses
import inspect
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import modegraph as mg
from benchmarks import measure, one, queries, table
from benchmarks.case import Case
from benchmarks.cases import CASES
from benchmarks.figures import FIGURES, Figures
from benchmarks.spread import sampled_spread
from modegraph.model.closed_loop import close_loop
from tests.certify.class_graphs import double_integrators

BY_NAME = {case.name: case for case in CASES}


def test_a_case_is_a_model_a_set_and_a_duration() -> None:
    assert [field.name for field in dataclasses.fields(Case)] == ["name", "model", "start", "until"]
    assert all(type(case) is Case for case in CASES)


def test_the_runner_passes_nothing_else(monkeypatch: pytest.MonkeyPatch) -> None:
    passed: list[tuple[str, set[str]]] = []

    class Stop(Exception):
        pass

    def spy(name: str) -> Any:
        signature = inspect.signature(getattr(mg, name))

        def call(*args: Any, **options: Any) -> Any:
            passed.append((name, set(signature.bind(*args, **options).arguments)))
            raise Stop

        return call

    for name in ("flowpipe", "build"):
        monkeypatch.setattr(one.mg, name, spy(name))
    for case in CASES:
        with pytest.raises(Stop):
            one.report(case.name)
    assert dict(passed) == {
        "flowpipe": {"mode", "horizon"},
        "build": {"modes", "horizon"},
    }
    assert all(arguments in ({"mode", "horizon"}, {"modes", "horizon"}) for _, arguments in passed)


def test_names_are_those_of_the_figures() -> None:
    assert len(BY_NAME) == len(CASES)
    assert set(BY_NAME) == set(FIGURES)


@pytest.mark.parametrize("name", BY_NAME)
def test_every_case_builds(name: str) -> None:
    case = BY_NAME[name]
    mode = case.mode()
    loop = close_loop(mode, None)
    assert len(loop.states) == case.start.dim
    assert set(FIGURES[name].states) <= set(mode.system.states)
    assert bool(FIGURES[name].states) == (mode.constraints is None)


@pytest.mark.parametrize("name", ["VDP", "LOVO25, no guard", "ARM-0"])
def test_a_row_of_a_cheap_case(name: str) -> None:
    seen = one.enclosed(BY_NAME[name], FIGURES[name])
    spread = sampled_spread(BY_NAME[name])
    states = BY_NAME[name].mode().system.states
    seen["spread"] = [float(spread[states.index(s)]) for s in FIGURES[name].states]
    assert seen["complete"]
    assert (np.array(seen["widths"]) >= np.array(seen["spread"]) - 1e-7).all()
    text = table.row(name, FIGURES[name], seen)
    assert text.startswith(name)
    assert "width" not in text


def test_a_disturbance_is_sampled_at_its_worst() -> None:
    """The double integrator with |w| <= 1 from rest at 0: after 1 s the position is within +-1/2."""

    def model(start: mg.Box) -> mg.Mode:
        plant = mg.System(
            lambda x, w: np.array([x[1], w[0]]), states="x v", inputs="none", disturbance=mg.Box([-1.0], [1.0])
        )
        return mg.Mode("push", plant, controller=lambda x: 0.0, reference=mg.setpoint([0.0]), start=start)

    spread = sampled_spread(Case("push", model, mg.Box([0.0, -0.1], [0.0, 0.1]), 1.0))
    np.testing.assert_allclose(spread, [1.2, 2.2], rtol=1e-6)


def test_what_cannot_be_done_is_a_row() -> None:
    unknown = measure.figures("no such case")
    assert "StopIteration" in unknown["reason"]
    late = measure.figures("VDP", limit=0.01)
    assert late["reason"] == "not done in 0.01 s"
    text = table.row("VDP", Figures(seconds=1.0), late)
    assert "over (incomplete, seconds); not done in 0.01 s" in text


def test_a_missed_goal_is_marked() -> None:
    seen = {"complete": True, "seconds": 0.2, "widths": [1.1], "spread": [1.0], "holds": False}
    assert table.missed(Figures(seconds=0.1, ratio=1.05), seen) == ["seconds", "width", "property"]
    assert table.missed(Figures(seconds=0.3, ratio=1.2), {**seen, "holds": True}) == []


def test_a_build_is_measured_in_a_process_of_its_own() -> None:
    run = measure.build("point_mass")
    assert set(run["statuses"]) <= {"certified", "refuted", "undecided"}
    assert run["total"] > run["seconds"] > 0.0
    assert run["megabytes"] > 10.0


def test_questions_are_measured_on_any_graph_of_classes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(queries, "load", lambda name: SimpleNamespace(modes=double_integrators(1), horizon=20.0))
    monkeypatch.setattr(queries, "QUESTIONS", 3)
    monkeypatch.setitem(queries.ASKED, "line", ("wide", "narrow"))
    seen = queries.measure("line")
    assert seen["contains"] > 0.0
    assert seen["time"]["worst"] >= seen["time"]["median"] > 0.0
    assert seen["switches"]["unreachable"] == 0
