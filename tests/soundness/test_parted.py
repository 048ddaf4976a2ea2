"""Loops in parts and at kinks: every claim and every number of the library against hundreds of adversarial runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

import modegraph as mg
from tests.soundness.answering import Answering, Answers
from tests.soundness.checker import refutation_holds
from tests.soundness.crowd import checked, contradicted, crowd
from tests.soundness.parted import FAMILIES, Instance

QUICK = [("slow_parts", 3), ("parts_together", 5), ("known_unknowns", 1), ("settled_kinks", 3)]
"""Each of these once had a false or a lost answer."""
SEEDS = {
    "slow_parts": 8,
    "parts_together": 10,
    "many_parts": 6,
    "bent_parts": 8,
    "known_unknowns": 12,
    "settled_kinks": 30,
}
STOPPED = "the proof engine stopped"


@dataclass
class Outcome:
    """What the library said of one instance, and what is wrong with that."""

    name: str
    answers: Counter[str] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)


def judge(instance: Instance, answers: Answers | None) -> Outcome:
    outcome = Outcome(instance.name)
    if answers is None:
        outcome.faults.append("no answer, many budgets after it was asked")
        return outcome
    runs = crowd(instance.mode, instance.horizon, np.random.default_rng(5))
    for goal in instance.targets:
        verdict = answers.verdicts[goal.name]
        outcome.answers[verdict.status.value] += 1
        wrong = _wrong(instance, goal, verdict)
        if verdict.status is mg.Status.CERTIFIED:
            assert isinstance(goal.set, mg.Box | mg.Ball)
            wrong += contradicted(runs, goal.set, verdict, answers.figures[goal.name], instance.rooms)
        outcome.faults += [f"{goal.name}: {text}" for text in wrong]
    never = mg.Target("never", mg.Ball(np.full(instance.mode.start.dim, 1e9), 1.0))
    wrong = _wrong(instance, never, answers.check) + checked(runs, answers.check, instance.rooms)
    outcome.faults += [f"check: {text}" for text in wrong]
    return outcome


def _wrong(instance: Instance, goal: mg.Target, verdict: mg.Verdict) -> list[str]:
    if verdict.status is mg.Status.REFUTED:
        wrong = refutation_holds(instance.mode, goal.set, verdict, instance.horizon)
        return [] if wrong is None else [f"refuted, but {wrong}"]
    return [verdict.reason] if STOPPED in verdict.reason else []


def test_every_family_is_asked() -> None:
    assert list(SEEDS) == list(FAMILIES)


@pytest.fixture(scope="module")
def answering() -> Iterator[Answering]:
    with Answering() as process:
        yield process


@pytest.mark.parametrize(("family", "seed"), QUICK)
def test_quick(answering: Answering, family: str, seed: int) -> None:
    outcome = judge(FAMILIES[family](seed), answering.ask(family, seed))
    assert not outcome.faults
    assert outcome.answers["certified"]


@pytest.mark.campaign
@pytest.mark.parametrize("family", SEEDS)
def test_campaign(answering: Answering, family: str, record_property: Any) -> None:
    outcomes = [judge(FAMILIES[family](seed), answering.ask(family, seed)) for seed in range(SEEDS[family])]
    total = sum((o.answers for o in outcomes), Counter())
    faults = [f"{o.name}: {text}" for o in outcomes for text in o.faults]
    record_property("campaign", f"{family}: {dict(total)}, {len(faults)} faults")
    assert not faults, "\n".join(faults)
    assert total["certified"], "nothing was claimed: the campaign says nothing"
