"""The search for repairs, apart from proofs."""

from __future__ import annotations

import math

import pytest

from modegraph.certify.verdict import Status, Verdict
from modegraph.errors import ModegraphError
from modegraph.explain.repairs import DIGITS, _Bracket, attempt, rounded
from tests.graph.fakes import because

UNDECIDED = Verdict(Status.UNDECIDED, because("lost"), margin=-0.5)
CERTIFIED = Verdict(Status.CERTIFIED, because("proved"), time=(0.0, 1.0), margin=0.25)


@pytest.mark.parametrize("value", [1.0, 0.1, 1.23456, 9.99996, 123456.0, 1.0001e-7, 2.5])
@pytest.mark.parametrize("up", [True, False])
def test_rounding_goes_to_the_side_that_is_asked(value: float, up: bool) -> None:
    near = rounded(value, up)
    assert near >= value if up else near <= value
    assert abs(near - value) <= 10.0 ** (math.floor(math.log10(value)) + 1 - DIGITS) * 1.001
    assert float(f"{near:.{DIGITS}g}") == near
    assert rounded(near, up) == near


def test_margins_say_where_a_search_ends() -> None:
    """The margin is .3 at 4 and -.1 at 2, a line: zero at 2.5, from the side of 4."""
    zero = _Bracket(good=4.0, bad=2.0, margin=0.3, missing=-0.1).zero()
    assert zero is not None
    assert 2.5 < zero < 2.51
    for margin, missing in ((None, -0.1), (0.3, None), (-0.1, -0.1), (0.3, 0.1), (math.inf, -0.1)):
        assert _Bracket(4.0, 2.0, margin, missing).zero() is None


def test_a_bracket_narrows_to_the_side_that_was_proved() -> None:
    start = _Bracket(good=4.0, bad=1.0)
    assert start.ratio == _Bracket(1.0, 4.0).ratio == 4.0
    better = start.after(2.0, CERTIFIED)
    assert (better.good, better.bad, better.margin, better.tried) == (2.0, 1.0, 0.25, False)
    worse = start.after(2.0, UNDECIDED)
    assert (worse.good, worse.bad, worse.missing, worse.tried) == (4.0, 2.0, -0.5, True)


def test_an_engine_that_stops_proves_nothing() -> None:
    def wrong() -> Verdict:
        raise ModegraphError("the start is empty")

    def broken() -> Verdict:
        raise ZeroDivisionError

    assert attempt(lambda: CERTIFIED) is CERTIFIED
    assert (attempt(wrong).status, attempt(wrong).reason) == (Status.UNDECIDED, "the start is empty")
    assert attempt(broken).status is Status.UNDECIDED
    assert "ZeroDivisionError" in attempt(broken).reason
