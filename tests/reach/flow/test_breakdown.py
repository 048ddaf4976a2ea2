"""The reason a flowpipe ends: where, which mechanism, and what would help."""

from __future__ import annotations

import pytest

from modegraph.enclosure.step import JACOBIAN_UNDEFINED, NO_CONTRACTION, NO_GROWTH_BOUND, UNDEFINED
from modegraph.model.closed_loop import close_loop
from modegraph.reach.failure import Mechanism
from modegraph.reach.field import compile_field
from modegraph.reach.flow.breakdown import breakdown
from tests.soundness.families import pendulum


@pytest.mark.parametrize(
    ("status", "mechanism", "remedy"),
    [
        (UNDEFINED, Mechanism.OUTSIDE_DOMAIN, "away"),
        (JACOBIAN_UNDEFINED, Mechanism.NOT_CONTINUOUS, "away"),
        (NO_GROWTH_BOUND, Mechanism.NO_GROWTH_BOUND, "split the start set"),
        (NO_CONTRACTION, Mechanism.NO_CONTRACTION, "split the start set"),
    ],
)
def test_every_status_has_its_mechanism(status: int, mechanism: Mechanism, remedy: str) -> None:
    fld = compile_field(loop := close_loop(pendulum().mode), loop.segments[-1])
    failure = breakdown(1.25, status, 0, fld, "rate")
    assert failure.mechanism is mechanism
    assert failure.fields["time"] == 1.25
    if "state" in failure.fields:
        assert "state 'rate'" in str(failure)
    assert remedy in failure.remedy
    assert str(failure).startswith("at t = 1.25 s")
