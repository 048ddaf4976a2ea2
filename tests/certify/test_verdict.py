"""What a verdict answers, and that nobody can mistake it for a yes."""

from __future__ import annotations

import pytest

import modegraph as mg


@pytest.mark.parametrize(
    ("status", "certified", "refuted"),
    [(mg.Status.CERTIFIED, True, False), (mg.Status.REFUTED, False, True), (mg.Status.UNDECIDED, False, False)],
)
def test_each_status_answers_both_questions(status: mg.Status, certified: bool, refuted: bool) -> None:
    verdict = mg.Verdict(status, "")
    assert verdict.certified is certified
    assert verdict.refuted is refuted


@pytest.mark.parametrize("status", list(mg.Status))
def test_neither_a_verdict_nor_its_status_has_a_truth_value(status: mg.Status) -> None:
    verdict = mg.Verdict(status, "")
    for asked in (verdict, status):
        with pytest.raises(mg.ModegraphError, match=rf"{status.value}.*\.certified or \.refuted"):
            bool(asked)
    with pytest.raises(mg.ModegraphError, match=r"\.certified"):
        _ = 1 if verdict else 2
