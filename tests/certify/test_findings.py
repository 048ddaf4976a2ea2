"""What parts prove is proved of the whole only if no part with starts is missing."""

from __future__ import annotations

import numpy as np
import pytest

from modegraph.certify.findings import Findings, merge
from modegraph.certify.switching.common_time import Missed
from modegraph.certify.verdict import Unproved
from tests.certify.given import safety, switch

MISSED = Missed(2.0, 1.0, True, np.zeros(1))
EMPTY = Findings(missed={0: MISSED}, failure="at t = 0 s", unproved=Unproved("c", 0.0, 1.0), empty=True)


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
