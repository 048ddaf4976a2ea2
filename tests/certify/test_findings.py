"""What parts prove is proved of the whole only if no part with starts is missing."""

from __future__ import annotations

import numpy as np
import pytest

from modegraph.certify.findings import Findings, merge
from modegraph.certify.reason import Outcome, Reason
from modegraph.certify.switching.common_time import Missed
from modegraph.certify.verdict import Unproved
from modegraph.reach.failure import Failure, Mechanism
from tests.certify.given import safety, switch

MISSED = Missed(2.0, 1.0, True, np.zeros(1))
ENDED = Reason(Outcome.FLOWPIPE_ENDED, failure=Failure(Mechanism.FILLED, time=0.0))
EMPTY = Findings(missed={0: MISSED}, failure=ENDED, unproved=Unproved("c", 0.0, 1.0), empty=True)


def undecided() -> Findings:
    return Findings(missed={0: MISSED})


def proved(latest: float) -> Findings:
    return Findings(
        proofs={0: switch(latest=latest, slack={"c": latest})}, safety=safety({"c": latest}, latest, np.zeros(0))
    )


def test_parts_without_starts_are_not_needed() -> None:
    found = merge(undecided(), [proved(1.0), EMPTY, proved(2.0)], [0], True)
    assert found.proofs[0].latest == 2.0
    assert found.safety is not None
    assert found.safety.slack == {"c": 1.0}
    assert not found.missed
    assert not found.empty


@pytest.mark.parametrize("others", [[], [EMPTY], [proved(1.0), EMPTY]])
def test_a_part_that_is_not_decided_decides_nothing(others: list[Findings]) -> None:
    found = merge(undecided(), [*others, undecided()], [0], True)
    assert not found.proofs
    assert found.safety is None
    assert not found.empty


@pytest.mark.parametrize("parts", [[], [EMPTY, EMPTY]])
def test_what_has_empty_parts_only_is_empty_and_proves_nothing(parts: list[Findings]) -> None:
    found = merge(undecided(), parts, [0], True)
    assert found.empty
    assert not found.proofs
    assert found.safety is None


def test_the_whole_tells_why_its_parts_have_no_tail() -> None:
    missing = (Failure(Mechanism.DOES_NOT_RETURN),)
    found = merge(undecided(), [proved(1.0), Findings(missed={0: MISSED}, no_tail=missing)], [0], True)
    assert found.no_tail == missing
    own = (Failure(Mechanism.REFERENCE_MOVES),)
    kept = Findings(missed={0: MISSED}, no_tail=own)
    assert merge(kept, [Findings(missed={0: MISSED}, no_tail=missing)], [0], True).no_tail == own


@pytest.mark.parametrize("why", [Unproved("c", 1.0, 0.5), Unproved("c", 1.0, 0.5).reason])
def test_a_part_that_cannot_go_on_alone_says_why(why: Unproved | Reason) -> None:
    found = Findings()
    found.unpark(why)
    assert found.failure is not None
    assert found.failure.fields["why"] == Unproved("c", 1.0, 0.5).reason
    assert "too large to go on alone: constraint 'c' cannot be proved" in str(found.failure)
