"""Deadlines: whether work has to end, and whether anybody was told so."""

from __future__ import annotations

import math

import pytest

from modegraph import deadline as module
from modegraph.deadline import NEVER, Deadline


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now = [100.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    return now


def test_it_is_over_when_its_seconds_are(clock: list[float]) -> None:
    limit = Deadline(5.0)
    assert not limit.is_over
    assert limit.left == 5.0
    clock[0] += 5.0
    assert not limit.met
    assert limit.is_over
    assert limit.met


def test_what_nobody_asked_for_was_not_met(clock: list[float]) -> None:
    limit = Deadline(1.0)
    clock[0] += 2.0
    assert limit.left < 0.0
    assert not limit.met


@pytest.mark.parametrize("outer, met", [(10.0, False), (2.0, True)])
def test_one_within_another_ends_with_it(clock: list[float], outer: float, met: bool) -> None:
    whole = Deadline(outer)
    share = Deadline(3.0, whole)
    clock[0] += 2.0
    assert share.is_over == met
    clock[0] += 1.0
    assert share.is_over
    assert share.met
    assert whole.met == met


def test_never_is_never_over() -> None:
    assert not NEVER.is_over
    assert NEVER.left == math.inf
    assert not Deadline(1e6, NEVER).is_over
