"""Where a plan may begin and end."""

from __future__ import annotations

import numpy as np

from modegraph.model.sets import Box
from modegraph.plan.question import End


def test_an_end_allows_its_reference_or_its_box() -> None:
    here, there = np.array([0.25]), np.array([0.75])
    free = End(("a", 0))
    fixed = End(("a", 0), here)
    within = End(("a", 0), within=Box([0.0], [0.5]))
    assert [end.allows(here) for end in (free, fixed, within)] == [True, True, True]
    assert [end.allows(there) for end in (free, fixed, within)] == [True, False, False]
    assert not End(("a", 0), there, Box([0.0], [0.5])).allows(there)
