"""What was passed on the way to a switch, and the clocks of those who passed it."""

from __future__ import annotations

import numpy as np
import pytest

from modegraph.certify.switching.base import Way, least_slack
from tests.certify.test_lasting import compiled, flow


def test_without_a_head_start_instants_are_exact() -> None:
    assert Way().sooner(0.3) == 0.3
    assert Way().slack == {}


@pytest.mark.parametrize("seconds, ahead", [(1.0, 0.25), (0.3, 0.1), (1.0, 1.0 / 3.0)])
def test_who_is_ahead_is_there_earlier_and_never_before_the_entry(seconds: float, ahead: float) -> None:
    found = Way(ahead=ahead).sooner(seconds)
    assert seconds - ahead - 1e-15 < found < seconds - ahead
    assert Way(ahead=ahead).sooner(0.5 * ahead) == 0.0


def test_the_slack_of_the_way_is_that_of_all_its_flows() -> None:
    flows = [flow(compiled(2.0)), flow(compiled(1.5))]
    assert Way(flows).slack["top"] == pytest.approx(0.5, abs=1e-3)
    assert Way(flows[::-1]).slack == Way(flows).slack


def test_least_slack() -> None:
    assert least_slack([{"a": 1.0, "b": 2.0}, {"a": 0.5}]) == {"a": 0.5, "b": 2.0}
    assert least_slack([]) == {}
    assert np.isinf(least_slack([{"a": np.inf}])["a"])
