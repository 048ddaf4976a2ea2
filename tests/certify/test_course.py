"""How far chains of flows are followed, and what is said where the time axis is not closed."""

from __future__ import annotations

import numpy as np
import pytest

import modegraph as mg
from modegraph.reach.failure import Mechanism


@pytest.mark.parametrize("rate, both", [(1e-7, True), (0.0, False)])
def test_why_there_is_no_funnel_is_said_once(rate: float, both: bool) -> None:
    # A rate of 1e-7 is enough to look for an invariant set, not for a funnel; a rate of 0 for neither.
    plant = mg.System(lambda x: np.array([-rate * x[0] - x[0] ** 3]), states=1, inputs="none")
    slow = mg.Mode(
        "slow", plant, controller=lambda x: 0.0, reference=mg.setpoint([0.0]), start=mg.Box([-0.05], [0.05])
    )  # fmt: skip
    check = mg.build([slow], budget=20.0).check("slow")
    (reason,) = check.why
    assert reason.outcome is mg.Outcome.NOT_FOR_EVER
    mechanisms = [reason.fields[name].mechanism for name in ("why", "funnel") if reason.fields[name] is not None]
    assert mechanisms.count(Mechanism.DOES_NOT_SETTLE) == 1
    assert (len(mechanisms) == 2) == both
    assert check.reason.count("the loop does not settle") == 1
