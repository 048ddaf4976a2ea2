from __future__ import annotations

import pytest

from modegraph.errors import ModegraphError
from modegraph.graph.progress import reporting, silent


def test_none_is_silent_and_a_callable_is_used_as_it_is() -> None:
    with reporting(None) as report:
        assert report is silent
    with reporting(print) as report:
        assert report is print


def test_true_is_silent_where_stderr_is_no_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    with reporting(True) as report:
        report(1, 2, "half")
    captured = capsys.readouterr()
    assert captured.out == captured.err == ""


def test_the_bar_takes_any_text(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    with reporting(True) as report:
        report(1, 2, "mode [/] q1")
    assert "[/] q1" in capsys.readouterr().err


def test_anything_else_is_an_error() -> None:
    with pytest.raises(ModegraphError, match="progress"), reporting("yes"):
        pass
