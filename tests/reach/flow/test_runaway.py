"""A remainder in its last growth is given up; one short step while it grows is not that."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

import modegraph as mg
from modegraph.reach.compiled import compile_mode
from modegraph.reach.flow.flow import RUNAWAY_STEPS, Flow, Order


def flow_with(lengths: list[float]) -> Flow:
    """A flow whose remainder grew by a quarter in each of these steps."""
    plant = mg.System(lambda x: -np.sin(x), states="x", inputs="none")
    mode = mg.Mode(
        "fall",
        plant,
        controller=lambda x: 0.0,
        reference=mg.setpoint([0.0]),
        start=mg.Box([0.1], [0.2]),
    )
    compiled = compile_mode(mode, None, observed=False)
    flow = Flow(
        compiled.fields,
        compiled.whole(),
        compiled.w_centre,
        compiled.w_radius,
        Order(3, 2),
        names=["x"],
    )
    ends = np.cumsum([0.0, *lengths])
    flow.steps = [SimpleNamespace(start=a, end=b) for a, b in pairwise(ends)]  # type: ignore[misc]
    flow._sizes = [0.01 * 1.25**k for k in range(len(lengths) - 1)]
    flow._longest = max(lengths)
    flow.feedback = 1.0
    return flow


@pytest.mark.parametrize("short, runs_away", [(1, False), (RUNAWAY_STEPS, True)])
def test_only_short_steps_throughout_are_a_runaway(short: int, runs_away: bool) -> None:
    lengths = [0.1] * 15 + [0.005] * short
    flow = flow_with(lengths)
    flow.remainder = np.array([0.01 * 1.25 ** len(lengths)])
    assert flow._runs_away() == runs_away
