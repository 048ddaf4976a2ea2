"""Plans, verdicts and switches as data."""

from __future__ import annotations

import json
import math

import numpy as np

from modegraph.certify.verdict import Status, Verdict, Witness
from modegraph.plan.as_json import json_text, plain, plan_data, switch_data, verdict_data
from tests.graph.fakes import because, certified, graph, mode


def test_plain_data_has_no_arrays_and_no_number_that_json_lacks() -> None:
    given = {1: np.array([[1.0, math.nan]]), "b": (np.float64(2.0), np.int64(3), True), "c": -math.inf, "d": "text"}
    assert plain(given) == {"1": [[1.0, None]], "b": [2.0, 3, True], "c": None, "d": "text"}
    assert json.loads(json_text(given)) == plain(given)


def test_a_verdict_has_all_its_attributes_as_keys() -> None:
    witness = Witness(x0=np.array([1.0]), w=None, d={"m": 2.0}, r_i=None, r_j=np.array([3.0]), time=4.0, kind="trapped")
    data = plain(verdict_data(Verdict(Status.REFUTED, because("no"), witness=witness, horizon=5.0)))
    assert data["status"] == "refuted"
    assert data["horizon"] == 5.0
    assert data["witness"] == {
        "x0": [1.0], "w": None, "d": {"m": 2.0}, "r_i": None, "r_j": [3.0], "time": 4.0, "kind": "trapped",
    }  # fmt: skip
    assert verdict_data(certified(2.0))["witness"] is None


def test_a_plan_and_its_switches() -> None:
    made = graph(["a", mode("b", 2)], {(("a", 0), ("b", 1)): certified(2.0, earliest=1.0)})
    plan = made.plan("a", "b")
    data = json.loads(json_text(plan_data(plan)))
    assert data["modes"] == ["a", "b"]
    assert data["references"] == [[0.0], [1.0]]
    assert data["time"] == [1.0, 2.0]
    assert data["goal_check"]["status"] == "certified"
    (switch,) = data["switches"]
    assert switch == json.loads(json_text(switch_data(plan.switches[0])))
    assert switch["references"] == [[[0.0], [1.0]]]
    assert json.loads(plan.to_json()) == data
