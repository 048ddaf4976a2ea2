"""Every mechanism has a text and a remedy."""

from __future__ import annotations

from string import Formatter

import pytest

from modegraph.reach.failure import Failure, Mechanism

VALUES = {
    "time": 0.5,
    "label": "sqrt(x)",
    "state": "level",
    "rate": 0.25,
    "constraint": "speed",
    "error": "IndexError",
    "text": "5",
}


def example(mechanism: Mechanism) -> Failure:
    if mechanism is Mechanism.CANDIDATE_STOPS:
        return Failure(mechanism, failure=Failure(Mechanism.FILLED, time=0.5))
    assert isinstance(mechanism.text, str)
    return Failure(mechanism, **{name: VALUES[name] for _, name, _, _ in Formatter().parse(mechanism.text) if name})


@pytest.mark.parametrize("mechanism", Mechanism)
def test_every_mechanism_has_a_text_with_its_fields_and_a_remedy(mechanism: Mechanism) -> None:
    failure = example(mechanism)
    assert failure.mechanism is mechanism
    for value in failure.fields.values():
        assert str(value) in str(failure)
    assert len(failure.remedy) > 10
    assert failure.in_full == f"{failure}; {failure.remedy}"
    assert failure.data()["mechanism"] == mechanism.name.lower()
