"""Instants whose differences are exact."""

from __future__ import annotations

from fractions import Fraction

from hypothesis import given, settings
from hypothesis import strategies as st

from modegraph.reach.flow.grid import is_exact, next_instant

TIMES = st.one_of(st.sampled_from([0.0, 0.1, 1 / 3, 1.0, 1e6]), st.floats(0.0, 1e4))


@settings(max_examples=300, deadline=None)
@given(TIMES, st.floats(1e-9, 10.0), st.floats(1e-8, 100.0))
def test_steps_are_exact_and_never_pass_the_limit(t: float, h: float, span: float) -> None:
    limit = t + span
    if not limit > t:
        return
    end = next_instant(t, h, limit)
    assert t < end <= limit
    assert Fraction(end) - Fraction(t) == Fraction(end - t)
    assert end - t <= max(1.01 * h, 2e-12 * max(t, 1.0)) or end == limit


def test_the_limit_is_met() -> None:
    t, steps = 0.0, 0
    while t < 1 / 3:
        t, steps = next_instant(t, 0.013, 1 / 3), steps + 1
        assert steps < 100
    assert t == 1 / 3
    assert is_exact(0.0, 0.1)
    assert not is_exact(0.1, 1e6)
