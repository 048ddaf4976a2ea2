"""Trajectories in floats only choose which ones are validated: where they cannot tell, all are."""

from __future__ import annotations

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.counterexamples.trajectory import followed_in_floats, scene_of
from modegraph.certify.targets.region import Region
from modegraph.reach.compiled import compile_mode

SECONDS = 3.0


def decay(rate: float = 1.0, bound: float = 10.0) -> mg.Mode:
    """x' = -rate x, |x| <= bound."""
    return mg.Mode(
        "decay",
        mg.System(lambda x, u: np.array([u[0]]), states=1, inputs=1),
        controller=lambda x: -rate * x[0],
        reference=mg.setpoint([0.0]),
        start=mg.Box([-1.0], [1.0]),
        constraints=lambda x: {"bound": abs(x) <= bound},
    )


def followed(
    mode: mg.Mode, start: float, radius: float, safety: bool = False, centre: float = 0.0
) -> tuple[bool, bool]:
    scene = scene_of(mode, compile_mode(mode, None))
    runs = [(np.array([start]), np.zeros(0))]
    target = Region(mg.Ball([centre], radius))
    outside, broken = followed_in_floats(scene, runs, np.zeros(0), [target], SECONDS, safety)
    return bool(outside[0, 0]), bool(broken[0])


@pytest.mark.parametrize("share, outside", [(0.98, True), (1.05, False)])
def test_a_decay_enters_what_it_reaches_in_time(share: float, outside: bool) -> None:
    assert followed(decay(), 1.0, share * np.exp(-SECONDS)) == (outside, False)


def test_a_constraint_counts_until_the_target_is_entered_or_always() -> None:
    growing = decay(rate=-1.0, bound=5.0)
    assert followed(growing, 0.5, 0.1) == (True, True)
    # It begins in the target; the bound is broken later.
    assert followed(growing, 0.5, 0.6) == (False, False)
    assert followed(growing, 0.5, 0.6, safety=True) == (False, True)


def test_too_stiff_a_loop_is_left_to_the_flowpipe() -> None:
    assert followed(decay(rate=10.0), 1.0, 0.1, centre=2.0) == (True, False)
    assert followed(decay(rate=1e5), 1.0, 0.1, centre=2.0) == (True, True)


def test_a_switch_that_needs_longer_than_the_horizon_is_refuted() -> None:
    """Every trajectory from 1 stays outside for log 10 seconds."""
    graph = mg.build([decay(), mg.Target("home", mg.Ball([0.0], 0.1))], horizon=2.0)
    assert graph.verdict("decay", "home").status is mg.Status.REFUTED
