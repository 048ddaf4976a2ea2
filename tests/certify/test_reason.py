"""Every outcome has a text and a remedy, and no text is absurd at the edges of its numbers."""

from __future__ import annotations

import copy
import json
import math
import pickle
from typing import Any

import pytest

from modegraph.certify.reason import Outcome, Reason, size_text
from modegraph.certify.verdict import Status, Unproved, Verdict
from modegraph.plan.as_json import json_text, verdict_data
from modegraph.reach.failure import Failure, Mechanism

MISSED = Reason(Outcome.NO_COMMON_TIME, gauge=1.2, time=0.5)
FILLED = Failure(Mechanism.FILLED, time=0.5)
START: dict[str, Any] = {"x0": (1.0, 2.0), "w": None}
PAIR: dict[str, Any] = {"r_i": (1.0,), "r_j": None, "why": (MISSED,)}

EXAMPLES: dict[Outcome, dict[str, Any]] = {
    Outcome.ZERO_TIME: {},
    Outcome.COMMON_TIME: {"latest": 1.0, "parts": 3},
    Outcome.FUNNEL: {"latest": 1.0, "parts": 3},
    Outcome.SOME_PAIRS_CERTIFIED: {"certified": 1, "count": 2, **PAIR},
    Outcome.SOME_REGION_CERTIFIED: {"r_i": (1.0,), "r_j": None},
    Outcome.FOR_ALL_TIME: {"start": 2.0, "constraints": True},
    Outcome.ALL_REFERENCES_CERTIFIED: {"count": 2},
    Outcome.ONLY_ENTERED: {"target": "dock"},
    Outcome.VIOLATES: {**START, "time": 1.0, "before_entry": True},
    Outcome.TRAPPED_AT_EQUILIBRIUM: {**START, "mode": "hold"},
    Outcome.TRAPPED: {**START, "time": 1.0},
    Outcome.HORIZON: {"x0": (1.0,), "w": (0.5,), "horizon": 3.0},
    Outcome.RESTS_OUTSIDE: {"x0": (1.0,)},
    Outcome.ALL_PAIRS_REFUTED: {"count": 2, **PAIR},
    Outcome.SOME_REFERENCES_REFUTED: {"failing": 1, "count": 2, "r": (1.0,), "why": (MISSED,)},
    Outcome.WHOLE_REGION_REFUTED: PAIR,
    Outcome.NO_COMMON_TIME: {"gauge": 1.2, "time": 0.5},
    Outcome.CONSTRAINT_NOT_PROVED: {"constraint": "speed", "time": 0.5, "by": 0.1},
    Outcome.START_NOT_PROVED: {},
    Outcome.FLOWPIPE_ENDED: {"failure": FILLED},
    Outcome.TOO_LARGE: {"why": MISSED},
    Outcome.NO_USABLE_INSTANT: {},
    Outcome.NOT_FOR_EVER: {"until": 1.0, "why": FILLED},
    Outcome.BUDGET_ENDED: {},
    Outcome.NOT_BEGUN: {"budget": 10.0},
    Outcome.INTERRUPTED: {},
    Outcome.ENGINE_STOPPED: {"error": "ZeroDivisionError", "text": "no luck"},
    Outcome.ENGINE_LIMIT: {"text": "too many states; use fewer"},
    Outcome.UNUSABLE_TARGET: {"text": "the set is curved; use a Ball"},
    Outcome.NO_REFERENCE_LEFT: {},
    Outcome.NOTHING_FOUND: {},
    Outcome.SOME_PAIRS_UNDECIDED: {"undecided": 1, "count": 2, **PAIR},
    Outcome.SOME_REFERENCES_UNDECIDED: {"undecided": 1, "count": 2, "r": (1.0,), "why": (MISSED,)},
}


@pytest.mark.parametrize("outcome", Outcome)
def test_every_outcome_has_a_text_and_a_remedy_and_is_data(outcome: Outcome) -> None:
    reason = Reason(outcome, **EXAMPLES[outcome])
    assert reason.outcome is outcome
    assert len(str(reason)) > 10
    assert len(reason.remedy) > 10
    assert "{" not in str(reason) + reason.remedy
    data = json.loads(json_text(reason.data()))
    assert data.pop("outcome") == outcome.name.lower()
    assert set(data) == set(EXAMPLES[outcome])


@pytest.mark.parametrize("fields", [{}, {"gauge": 1.0}, {"gauge": 1.0, "time": 0.0, "colour": "red"}])
def test_fields_are_those_of_the_outcome(fields: dict[str, Any]) -> None:
    with pytest.raises(TypeError):
        Reason(Outcome.NO_COMMON_TIME, **fields)
    with pytest.raises(TypeError):
        Reason(Outcome.ZERO_TIME, time=1.0)


@pytest.mark.parametrize(
    "gauge, said",
    [
        (1.2, "reaches 1.2 times the size of the target (1 is needed)"),
        (1.006, "reaches 1.01 times"),
        (1.0 + 3.2e-7, "misses the target by 3.2e-07 of its size"),
        (1.0 + 6.4e-11, "touches the target, and misses it by 6.4e-11 of its size"),
        (math.nextafter(1.0, 2.0), "touches the target, and misses it by 2.2e-16 of its size"),
        (1.0, "within the size of the target"),
        (1e294, "more than 1000 times the size"),
        (math.inf, "more than 1000 times the size"),
    ],
)
def test_what_is_missed_is_never_once_the_size_of_the_target(gauge: float, said: str) -> None:
    reason = Reason(Outcome.NO_COMMON_TIME, gauge=gauge, time=0.0)
    assert said in str(reason)
    assert "reaches 1 times" not in str(reason)
    assert "e+" not in str(reason)
    assert "(t = 0 s)" in str(reason)


def test_a_class_says_which_part_and_which_references() -> None:
    one = {"gauge": 2.0, "time": 0.5, "r_i": (1.0,), "r_j": (), "horizon": 3.0}
    part = str(Reason(Outcome.NO_COMMON_TIME, **one, part=2, parts=4, offset=(0.5, -1.0)))
    assert "within 3 s: at best (t = 0.5 s, r_i = [1], r_j = the only one)" in part
    assert "part 2 of 4 of the starts (around the centre + (0.5, -1))" in part
    assert "the set of all starts reaches 2 times" in str(Reason(Outcome.NO_COMMON_TIME, **one, part=1, parts=1))


@pytest.mark.parametrize(
    "by, said",
    [
        (0.05, "exceeded by up to 0.05"),
        (0.0, "met exactly"),
        (-0.05, "met exactly"),
        (math.inf, "not defined on the whole set"),
        (math.nan, "not defined on the whole set"),
    ],
)
def test_a_constraint_is_never_exceeded_by_less_than_nothing(by: float, said: str) -> None:
    text = str(Unproved("speed", 0.5, by))
    assert said in text
    assert "-0.05" not in text
    assert "at t = 0 " in str(Unproved("speed", 0.0, by))


def test_an_undecided_verdict_says_what_would_help_each_once() -> None:
    why = (MISSED, Unproved("speed", 0.5, 0.1).reason, Reason(Outcome.FLOWPIPE_ENDED, failure=FILLED), MISSED)
    reason = Verdict(Status.UNDECIDED, why).reason
    assert reason.count(MISSED.remedy) == 1
    assert reason.index("speed") < reason.index(FILLED.remedy)
    assert MISSED.remedy not in Verdict(Status.REFUTED, why).reason


def test_a_message_that_names_its_remedy_is_told_once() -> None:
    (limit,) = why = (Reason(Outcome.ENGINE_LIMIT, **EXAMPLES[Outcome.ENGINE_LIMIT]),)
    assert Verdict(Status.UNDECIDED, why).reason == str(limit)
    around = Reason(Outcome.SOME_PAIRS_UNDECIDED, undecided=1, count=2, r_i=None, r_j=None, why=why)
    assert Verdict(Status.UNDECIDED, (around,)).reason == str(around)


def test_braces_in_what_a_user_wrote_are_text() -> None:
    assert str(Reason(Outcome.ENGINE_LIMIT, text="state {x} and {")) == "state {x} and {"


def test_reasons_are_equal_by_value_and_travel() -> None:
    for outcome, fields in EXAMPLES.items():
        reason = Reason(outcome, **fields)
        assert reason == pickle.loads(pickle.dumps(reason)) == copy.deepcopy(reason)
        assert hash(reason) == hash(copy.deepcopy(reason))
    assert Reason(Outcome.NO_COMMON_TIME, gauge=1.3, time=0.5) != MISSED
    assert MISSED != "no common time"


def test_a_verdict_as_data_has_its_reasons_for_programs() -> None:
    why = (Reason(Outcome.NOT_FOR_EVER, until=1.0, why=FILLED), Unproved("c", 0.0, math.nan).reason)
    data = json.loads(json_text(verdict_data(Verdict(Status.UNDECIDED, why))))
    assert data["reason"] == Verdict(Status.UNDECIDED, why).reason
    assert data["why"] == [
        {"outcome": "not_for_ever", "until": 1.0, "why": {"mechanism": "filled", "time": 0.5}},
        {"outcome": "constraint_not_proved", "constraint": "c", "time": 0.0, "by": None},
    ]


@pytest.mark.parametrize(
    "gauge, said",
    [
        (1e294, "more than 1000 times the size"),
        (2.5, "2.5 times the size"),
        (1.0, "1 times the size"),
        (1.0 + 3.2e-7, "the size of the target, and 3.2e-07 of it more"),
        (1.0 - 1e-9, "the size of the target, and 1e-09 of it less"),
    ],
)
def test_sizes_are_told_truly(gauge: float, said: str) -> None:
    assert size_text(gauge).startswith(said)
