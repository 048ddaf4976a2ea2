"""The text of an explanation."""

from __future__ import annotations

import math

import numpy as np

from modegraph.certify.verdict import Status, Verdict, Widths, Witness
from modegraph.explain.explanation import Blocking, Explanation, explanation_text
from tests.graph.fakes import because, certified


def test_what_blocks_is_named_with_its_number() -> None:
    told = Explanation(
        "a", "b", Verdict(Status.UNDECIDED, because("lost")), block=Blocking("face", "x <= 1", 0.25, "m", 2.0)
    )
    assert (told.blocking, told.missing) == ("x <= 1", 0.25)
    text = explanation_text(told, several=False)
    assert text.splitlines() == ["a -> b: undecided", "  lost", "  blocked by: x <= 1, 0.25 (m) missing at t = 2 s"]
    nothing = Explanation("a", "b", told.verdict)
    assert (nothing.blocking, nothing.missing) == ("", None)


def test_a_present_switch_tells_what_is_left() -> None:
    verdict = certified(2.0, earliest=1.0, margin=0.5, window=math.inf, slack={"wall": 0.125})
    told = Explanation("a", "b", verdict, block=Blocking("face", "x <= 1", -0.25, "m"))
    lines = explanation_text(told, several=False).splitlines()
    assert "  time: enters between 1 and 2 s" in lines
    assert "  stays inside: for ever" in lines
    assert "  slack of wall: 0.125" in lines
    assert "  nearest face: x <= 1, 0.25 (m) of room" in lines
    assert not any("blocked" in line for line in lines)


def test_a_counterexample_is_told_in_full() -> None:
    witness = Witness(
        x0=np.array([0.5]), w=np.array([0.25]), d={"m": 2.0}, r_i=np.array([1.0]), r_j=None, time=3.0, kind="trapped"
    )
    text = explanation_text(
        Explanation("a", "b", Verdict(Status.REFUTED, because("no"), witness=witness)), several=False
    )
    for part in ("x0 = [0.5] never arrives (trapped from 3 s on)", "w = [0.25]", "with m = 2", "r_i = [1]"):
        assert part in text
    assert "r_j" not in text


def test_references_are_told_where_there_are_several() -> None:
    told = Explanation("a", "b", certified(), r_i=np.array([1.0]), r_j=np.array([2.0]))
    assert "told of the references [1] to [2]" in explanation_text(told, several=True)
    assert "told of the references" not in explanation_text(told, several=False)


def test_widths_are_a_table() -> None:
    widths = Widths(states=("x", "a long name"), times=np.array([0.0, 1.0]), values=np.array([[1.0, 2.0], [3.0, 4.0]]))
    verdict = Verdict(Status.UNDECIDED, because("lost"), widths=widths)
    rows = explanation_text(Explanation("a", "b", verdict), several=False).splitlines()[-3:]
    assert [row.split() for row in rows] == [
        ["t,", "s", "x", "a", "long", "name"], ["0", "1", "2"], ["1", "3", "4"],
    ]  # fmt: skip
    assert len({len(row) for row in rows}) == 1
