"""Which modes may be entered from a state."""

from __future__ import annotations

import numpy as np
import pytest

from modegraph.errors import ModegraphError
from modegraph.graph.entry import Entry, may_enter, memory_on_entry, plain_state
from modegraph.model.memory import Memory
from modegraph.model.mode import Mode
from modegraph.model.reference import setpoint
from modegraph.model.sets import Box, Polytope
from modegraph.model.target import Target
from tests.graph.fakes import PLANT, mode


def test_a_state_is_plain_numbers() -> None:
    assert plain_state(2, 1).tolist() == [2.0]
    for wrong, message in (([1, 2], r"shape \(1,\), not \(2,\)"), ([np.inf], "finite"), ("left", "must be 1 numbers")):
        with pytest.raises(ModegraphError, match=message):
            plain_state(wrong, 1)


def test_the_start_set_of_each_reference_is_asked() -> None:
    two = mode("a", 2)
    first, second = two.reference.parameters()
    assert may_enter(two, first, np.array([0.5]))
    assert not may_enter(two, first, np.array([np.nextafter(0.5, 1.0)]))
    assert may_enter(two, second, np.array([0.5]))


def test_a_target_and_a_set_without_bounds() -> None:
    half = Target("half", Polytope([[1.0]], [0.25]))
    assert may_enter(half, None, np.array([-1e300]))
    assert not may_enter(half, None, np.array([0.26]))


def test_a_start_on_states_and_memory_is_asked_about_the_memory_of_the_reset() -> None:
    integral = Mode(
        "integral", PLANT, controller=lambda x, z: -x - z, reference=setpoint([0.25]), start=Box([-1, -1], [1, 1]),
        memory=Memory("z", lambda x: x, lambda x, r: 2.0 * x + r),
    )  # fmt: skip
    assert memory_on_entry(integral, None, np.array([0.25])).tolist() == [0.75]
    entry = Entry(integral, None)
    assert entry.set.dim == 2
    assert entry.contains(np.array([0.375]))
    assert not entry.contains(np.array([0.376]))
    assert memory_on_entry(mode("plain"), None, np.zeros(1)).shape == (0,)
