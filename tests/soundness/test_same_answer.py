"""The same model gives the same graph, number for number: on one core and on two, alone and beside a busy process."""

from __future__ import annotations

import os

import pytest

from tests.soundness.numbers import elsewhere

pytestmark = pytest.mark.skipif(
    not hasattr(os, "sched_setaffinity") or len(os.sched_getaffinity(0)) < 2, reason="there is one core only"
)
POPULATION = [f"population-{seed}" for seed in range(0, 60, 4)]


@pytest.mark.parametrize("name", ["point_mass", "population-15"])
def test_quick(name: str) -> None:
    one = elsewhere(name, 1)
    assert one
    assert one == elsewhere(name, 2, busy=True)


@pytest.mark.campaign
@pytest.mark.parametrize("name", ["two_link_arm", "quadrotor", "arm_points", *POPULATION])
def test_campaign(name: str) -> None:
    one = elsewhere(name, 1)
    assert one == elsewhere(name, 2)
    assert one == elsewhere(name, 2, busy=True)
