"""Certificates of random systems against adversarial runs; how many questions get an answer."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import pytest

import modegraph as mg
from tests.soundness.checker import claims, examine, refutation_holds
from tests.soundness.population import HORIZON, Case, case

QUICK = (0, 1, 3, 4, 9, 15)
SYSTEMS = 60
BUDGET = 15.0  # seconds of work for one system; what is not decided then counts as undecided


@dataclass
class Outcome:
    """What the library said about one system and what the runs said about that."""

    case: Case
    answers: Counter[str] = field(default_factory=Counter)
    violations: list[str] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)


def judge(seed: int, runs: int) -> Outcome:
    made = case(seed)
    outcome = Outcome(made)
    graph = mg.build([made.mode, *made.targets], horizon=HORIZON, budget=BUDGET)
    verdicts = {goal.name: (goal.set, graph.verdict(made.mode.name, goal.name)) for goal in made.targets}
    outcome.violations += [str(v) for v in examine(made.mode, claims(verdicts), runs=runs, seed=seed)]
    for goal in made.questions:
        _, verdict = verdicts[goal.name]
        outcome.answers[verdict.status.value] += 1
        if verdict.status is mg.Status.UNDECIDED:
            outcome.reasons.append(f"{goal.name}: {verdict.reason}")
    for name, (region, verdict) in verdicts.items():
        if verdict.status is mg.Status.REFUTED:
            wrong = refutation_holds(made.mode, region, verdict, HORIZON)
            if wrong is not None:
                outcome.violations.append(f"{made.mode.name} -> {name} refuted, but {wrong}")
    return outcome


@pytest.mark.parametrize("seed", QUICK)
def test_quick(seed: int) -> None:
    assert not judge(seed, runs=21).violations


def test_population_has_the_promised_mix() -> None:
    cases = [case(seed) for seed in range(SYSTEMS)]
    assert len(cases) >= 50
    assert sum(c.nonlinear for c in cases) >= len(cases) // 2
    assert sum(c.disturbed for c in cases) >= len(cases) // 3
    assert sum(c.matrix for c in cases) >= 5
    assert {c.mode.start.dim for c in cases} == {1, 2, 3, 4}


def summary(outcomes: list[Outcome]) -> str:
    """A table of answers by kind of system, then the reasons of what stayed undecided."""
    kinds: dict[str, Callable[[Case], bool]] = {
        "linear": lambda c: not c.nonlinear,
        "nonlinear": lambda c: c.nonlinear,
        "disturbed": lambda c: c.disturbed,
        "through a matrix": lambda c: c.matrix,
        "all": lambda c: True,
    }
    lines = ["kind                   systems  certified  refuted  undecided  violations"]
    for kind, belongs in kinds.items():
        chosen = [o for o in outcomes if belongs(o.case)]
        count = sum((o.answers for o in chosen), Counter())
        lines.append(
            f"{kind:22s} {len(chosen):7d} {count['certified']:10d} {count['refuted']:8d} "
            f"{count['undecided']:10d} {sum(len(o.violations) for o in chosen):11d}"
        )
    for outcome in outcomes:
        lines += [f"  undecided: {outcome.case.mode.name} -> {reason}" for reason in outcome.reasons]
    return "\n".join(lines)


@pytest.mark.campaign
def test_campaign(record_property: Any) -> None:
    outcomes = [judge(seed, runs=210) for seed in range(SYSTEMS)]
    record_property("campaign", summary(outcomes))
    violations = [text for o in outcomes for text in o.violations]
    assert not violations, "\n".join(violations)
    total = sum((o.answers for o in outcomes), Counter())
    decided = total["certified"] + total["refuted"]
    assert decided >= 0.6 * sum(total.values()), total
