"""Every certified switch of the shipped examples, held against independent runs."""

from __future__ import annotations

from typing import Any

import pytest

from tests.soundness.examples import arm_sources, build, load, point_mass_sources, total


@pytest.fixture(scope="module")
def arm() -> list[Any]:
    module = load("two_link_arm")
    return arm_sources(build(module), module)


@pytest.fixture(scope="module")
def point_mass() -> list[Any]:
    module = load("point_mass")
    return point_mass_sources(build(module), module)


def test_arm_quick(arm: list[Any]) -> None:
    assert total(arm) >= 10
    for source in arm:
        assert not source.examine(runs=12)


def test_point_mass_quick(point_mass: list[Any]) -> None:
    assert total(point_mass) >= 10
    for source in point_mass:
        assert not source.examine(runs=12)


@pytest.mark.campaign
@pytest.mark.parametrize("part", range(8))
def test_arm_campaign(arm: list[Any], part: int, record_property: Any) -> None:
    """1,000 random starts of every certified switch of one mode."""
    source = arm[part]
    found = source.examine(runs=1000, seed=7)
    record_property(
        "campaign",
        f"two_link_arm {source.mode.name}: 1000 starts x {len(source.claims)} switches, {len(found)} violations",
    )
    assert not found


@pytest.mark.campaign
@pytest.mark.parametrize("part", range(8))
def test_point_mass_campaign(point_mass: list[Any], part: int, record_property: Any) -> None:
    source = point_mass[part]
    found = source.examine(runs=1000, seed=7)
    record_property(
        "campaign",
        f"point_mass {source.mode.name} at {source.p[0]}: 1000 starts x {len(source.claims)} switches, "
        f"{len(found)} violations",
    )
    assert not found
