"""Parts that a disturbance has filled: from one enclosure of all their ends, or alone where that shows nothing."""

from __future__ import annotations

import runpy
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify import course, decision
from modegraph.certify.exploration import Exploration
from modegraph.certify.findings import Findings
from modegraph.certify.question import Question, TargetSpec
from modegraph.certify.unit import UnitResult, certify_unit
from modegraph.deadline import NEVER, Deadline
from modegraph.reach.flow.flow import Flow

ARM = runpy.run_path(str(Path(__file__).parents[2] / "examples" / "two_link_arm.py"))
ANGLE, RATE = 0.2, 0.4


def decided() -> UnitResult:
    """The arm held at B from so wide a start set that parts of it wait for each other, towards q7."""
    at = np.array(ARM["B"])
    source = ARM["mode"]("q6", ARM["wide"], mg.setpoint(at), ANGLE, RATE)
    target = next(m for m in ARM["modes"] if m.name == "q7")
    return certify_unit(
        source, at, [TargetSpec("q7", at, target)], horizon=10.0, deadline=Deadline(120.0), progress=None
    )


def watched(monkeypatch: pytest.MonkeyPatch, together: bool) -> list[int]:
    """Numbers of flows that were enclosed at once; without ``together`` no two ever are."""
    real, seen = course.again, []

    def again(question: Question, last: Sequence[Flow], first: bool, common: bool) -> Flow | None:
        seen.append(len(last))
        return real(question, last, first, common) if together or len(last) == 1 else None

    monkeypatch.setattr(course, "again", again)
    monkeypatch.setattr(decision, "again", again)
    return seen


@pytest.mark.parametrize("together", [True, False])
def test_what_waits_is_decided_together_or_alone(monkeypatch: pytest.MonkeyPatch, together: bool) -> None:
    seen = watched(monkeypatch, together)
    found = decided()
    assert seen[0] > 1
    assert (len(seen) <= 3) == together
    (verdict,) = found.verdicts
    assert verdict.status is mg.Status.CERTIFIED
    assert found.check.status is mg.Status.CERTIFIED
    assert verdict.time is not None
    # Sampled, the last start enters after 1.6 s.
    assert 1.6 < verdict.time[1] < 5.0


def test_a_common_flow_begins_at_the_latest_of_the_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    real: Any = course.again
    instants: list[tuple[float, float, float]] = []

    def again(question: Question, last: Sequence[Flow], first: bool, common: bool) -> Flow | None:
        following: Flow | None = real(question, last, first, common)
        if len(last) > 1 and following is not None:
            times = [flow.time for flow in last]
            instants.append((min(times), max(times), float(following.times[0])))
            for flow in last:
                lo, hi = flow.last_set.ranges()
                below, above = following.reach_set(0).ranges()
                assert (below <= lo + 1e-9).all()
                assert (hi - 1e-9 <= above).all()
        return following

    monkeypatch.setattr(decision, "again", again)
    decided()
    assert instants
    for first, latest, begin in instants:
        assert first < latest == begin


def test_what_the_common_flow_proves_is_kept_when_the_parts_go_on_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[list[int], bool, bool]] = []
    proof, lasting, late = object(), object(), object()

    def explore(self: Exploration, piece: Any, wanted: Sequence[int], safety: bool) -> Findings:
        """Only the second run, each part alone, decides goal 1."""
        asked.append((list(wanted), safety, self.common))
        found: Any = Findings()
        if not self.common:
            found.proofs[1] = late
        return found

    def all_at_once(self: Any, found: Any) -> bool:
        found.proofs[0], found.safety = proof, lasting
        return False

    monkeypatch.setattr(Exploration, "explore", explore)
    monkeypatch.setattr(decision._Continuation, "all_at_once", all_at_once)

    class Asked:
        autonomous, deadline = True, NEVER

    question: Any = Asked()
    found: Any = decision.decide(question, None, [0, 1, 2])  # type: ignore[arg-type]
    assert asked == [([0, 1, 2], True, True), ([1, 2], False, False)]
    assert found.proofs == {0: proof, 1: late}
    assert found.safety is lasting
