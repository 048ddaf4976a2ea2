"""Targets."""

import pytest

import modegraph as mg
from modegraph.errors import ModegraphError


def test_keeps_what_it_was_given():
    region = mg.Box([0], [1])
    target = mg.Target("dock", region)
    assert target.name == "dock"
    assert target.set is region


def test_bad_targets():
    with pytest.raises(ModegraphError, match="target 'dock': set must be"):
        mg.Target("dock", [0, 1])
    with pytest.raises(ModegraphError, match="target 'dock': the set is empty"):
        mg.Target("dock", mg.Polytope([[1], [-1]], [0, -1]))
    with pytest.raises(ModegraphError, match="name"):
        mg.Target("", mg.Box([0], [1]))
