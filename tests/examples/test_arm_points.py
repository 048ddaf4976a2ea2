"""The arm held anywhere: classes of set-points, and a walk from posture to posture."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from tests.soundness.examples import build, load


@pytest.fixture(scope="module")
def graph() -> Any:
    return build(load("arm_points"))


def test_every_mode_is_safe_for_ever_at_every_posture(graph: Any) -> None:
    for name in graph.modes:
        verdict = graph.check(name)
        assert verdict.status is mg.Status.CERTIFIED, verdict.reason
        assert (graph.regions[name].hi - graph.regions[name].lo >= 1.0).all()


def test_all_switches_exist_for_pairs_that_are_near(graph: Any) -> None:
    assert {(s.source, s.target) for s in graph.switches} == {(i, j) for i in graph.modes for j in graph.modes}
    refs = graph.references("reach", "hold")
    assert refs.contains([0.5, 1.2], [0.52, 1.17])
    # Starts of hold lie within .08 rad: at .1 rad the middle of the starts rests outside.
    assert refs.statuses([[0.5, 1.2]], [[0.6, 1.2]]) == [-1]


@pytest.mark.parametrize("minimize", ["switches", "time"])
def test_from_posture_to_posture_through_references_it_chose(graph: Any, minimize: str) -> None:
    plan = graph.plan("reach", "hold", r_start=[0.1, 0.8], r_goal=[0.9, 1.6], minimize=minimize)
    between = [r for r in plan.references if not np.array_equal(r, [0.1, 0.8]) and not np.array_equal(r, [0.9, 1.6])]
    assert len(between) >= 3
    assert plan.bound <= plan.cost
    for k, switch in enumerate(plan.switches):
        assert graph.references(switch.source, switch.target).contains(plan.references[k], plan.references[k + 1])
    run = plan.simulate([0.15, 0.75, 0.1, -0.1])
    assert run.ok
    assert len(run.switch_times) == len(plan.switches)
    assert run.x[-1] == pytest.approx([0.9, 1.6, 0.0, 0.0], abs=1e-3)
