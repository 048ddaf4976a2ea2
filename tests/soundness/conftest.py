"""Prints what the campaign recorded, also when it ran in several processes."""

from __future__ import annotations

from typing import Any


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Show every ("campaign", text) property of the finished tests."""
    texts = [
        value
        for outcome in ("passed", "failed")
        for report in terminalreporter.stats.get(outcome, [])
        for name, value in getattr(report, "user_properties", [])
        if name == "campaign"
    ]
    if texts:
        terminalreporter.section("soundness")
        for text in sorted(texts, key=lambda t: t.count("\n")):
            terminalreporter.write_line(text)
