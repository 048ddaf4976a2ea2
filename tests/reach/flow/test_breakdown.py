"""The reason a flowpipe ends: where, which mechanism, and what would help."""

from __future__ import annotations

import pytest

from modegraph.enclosure.step import JACOBIAN_UNDEFINED, NO_CONTRACTION, NO_GROWTH_BOUND, UNDEFINED
from modegraph.model.closed_loop import close_loop
from modegraph.reach.field import compile_field
from modegraph.reach.flow.breakdown import breakdown
from tests.soundness.families import pendulum


@pytest.mark.parametrize(
    ("status", "what", "remedy"),
    [
        (UNDEFINED, "leaves its domain", "away"),
        (JACOBIAN_UNDEFINED, "not defined, or not continuous", "away"),
        (NO_GROWTH_BOUND, "state 'rate' is the widest", "split the start set"),
        (NO_CONTRACTION, "does not contract (state 'rate'", "split the start set"),
    ],
)
def test_every_mechanism_has_its_words(status: int, what: str, remedy: str) -> None:
    fld = compile_field(loop := close_loop(pendulum().mode), loop.segments[-1])
    failure = breakdown(1.25, status, 0, fld, "rate")
    assert what in failure.mechanism
    assert remedy in failure.remedy
    assert str(failure).startswith("at t = 1.25 s")
