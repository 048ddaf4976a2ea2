"""Errors of the engine: caught where they are met, logged, and told."""

from __future__ import annotations

import logging

import numpy as np
import pytest

from modegraph.errors import ModegraphError
from modegraph.guarded import guarded


def test_the_result_is_passed_on() -> None:
    assert guarded("work", lambda: 3, lambda error: 4) == 3


def test_an_error_is_logged_with_its_traceback_and_costs_one_answer(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.ERROR, "modegraph"):
        found = guarded("the search for a tail", lambda: str(np.linalg.inv(np.zeros((2, 2)))), str)
    assert found == "Singular matrix"
    assert "the search for a tail" in caplog.text
    assert "Traceback" in caplog.text


def test_a_limit_that_the_engine_names_is_told_as_it_is(caplog: pytest.LogCaptureFixture) -> None:
    def limit() -> str:
        raise ModegraphError("mode 'a': too many states; leave some out")

    with caplog.at_level(logging.ERROR, "modegraph"):
        assert guarded("work", limit, str) == "mode 'a': too many states; leave some out"
    assert not caplog.records


def test_an_interrupt_is_no_error_of_the_engine() -> None:
    def interrupted() -> int:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        guarded("work", interrupted, lambda error: 0)
