"""Modes with one thing changed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.model.start import mode_start
from modegraph.model.variant import narrowed, with_horizon, with_set, with_start, without_constraints

PLANT = mg.System(lambda x, u: u, states="x", inputs="u")


def mode(reference: Any, start: Any = None) -> mg.Mode:
    return mg.Mode(
        "m", PLANT, controller=lambda x, r: r - x, reference=reference,
        start=start or (lambda r: mg.Box(r - 1.0, r + 1.0)), constraints=lambda x: {"c": x[0] <= 9.0}, horizon=4.0,
    )  # fmt: skip


def test_the_original_stays() -> None:
    given = mode(mg.setpoint([0.0]))
    changed = with_horizon(without_constraints(given), None)
    assert (changed.horizon, changed.constraints) == (None, None)
    assert given.horizon == 4.0
    assert given.constraints is not None
    assert changed.name == given.name
    assert changed.controller is given.controller


def test_the_start_of_an_only_reference() -> None:
    start = mg.Box([0.0], [0.5])
    assert mode_start(with_start(mode(mg.setpoint([0.0])), None, start)) == start


@pytest.mark.parametrize("start", [None, mg.Box([-3.0], [3.0])])
def test_the_start_of_one_reference_of_several(start: Any) -> None:
    given = mode(mg.setpoint(mg.Points([[0.0], [5.0]])), start)
    one = mg.Box([4.9], [5.1])
    changed = with_start(given, np.array([5.0]), one)
    assert mode_start(changed, np.array([5.0])) == one
    assert mode_start(changed, np.array([0.0])) == mode_start(given, np.array([0.0]))


def test_what_is_entered() -> None:
    bigger = mg.Box([-1.0], [1.0])
    target = with_set(mg.Target("t", mg.Box([0.0], [0.1])), None, bigger)
    assert isinstance(target, mg.Target)
    assert (target.name, target.set) == ("t", bigger)
    assert mode_start(with_set(mode(mg.setpoint([0.0])), None, bigger)) == bigger  # type: ignore[arg-type]


def test_some_references_of_a_class() -> None:
    held = narrowed(mode(mg.setpoint(mg.Box([0.0], [5.0]))), [np.array([1.0]), np.array([2.5])])
    assert [p.tolist() for p in held.reference.parameters() if p is not None] == [[1.0], [2.5]]
    assert mode_start(held, np.array([2.5])) == mg.Box([1.5], [3.5])
    ramp = mg.trajectory(lambda t, p: [p[0] * t], 2.0, over=mg.Box([0.0], [1.0]), breakpoints=[1.0])
    moved = narrowed(mode(ramp), [np.array([0.25])])
    assert moved.reference.value(2.0, [0.25]) == pytest.approx([0.5])
    assert moved.reference.breakpoints == (1.0,)
    with pytest.raises(mg.ModegraphError, match="class is"):
        narrowed(mode(ramp), [np.array([3.0])])
