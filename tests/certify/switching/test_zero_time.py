"""Switches in zero time: the sets themselves decide, exactly."""

from __future__ import annotations

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.switching.zero_time import InZeroTime
from modegraph.certify.targets.region import Region
from modegraph.reach.flow.flow import Order
from tests.certify.test_lasting import compiled


def evidence(target: mg.Box, limit: float | None = None) -> InZeroTime:
    c = compiled(limit)
    return InZeroTime(c.one_start, c.flow(c.whole(), Order(1, 0)), Region(target))


def test_touching_is_inside() -> None:
    found = evidence(mg.Box([0.5], [1.0]), limit=1.25)
    assert (found.earliest, found.latest, found.window, found.energy) == (0.0, 0.0, 0.0, 0.0)
    assert found.margin == pytest.approx(0.0, abs=1e-15)
    assert found.slack["top"] == pytest.approx(0.25)
    assert evidence(mg.Box([0.0], [1.5])).margin == pytest.approx(2.0 / 3.0)


@pytest.mark.parametrize("lo, hi", [(np.nextafter(0.5, 1.0), 1.0), (0.5, np.nextafter(1.0, 0.0))])
def test_one_unit_in_the_last_place_is_outside(lo: float, hi: float) -> None:
    with pytest.raises(ValueError):
        evidence(mg.Box([lo], [hi]))


def test_a_start_that_breaks_a_limit_switches_nowhere() -> None:
    with pytest.raises(ValueError):
        evidence(mg.Box([0.0], [2.0]), limit=float(np.nextafter(1.0, 0.0)))
