"""The quadrotor's certificates held against flights that share nothing with the library."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.soundness.quadrotor import KINDS, Wind, fly, some_start, storm, wind

QUESTIONS = (
    {"r_start": [-4.0, 2.0], "r_goal": [3.0]},
    {"r_start": [-6.0, 5.0], "r_goal": [5.5]},
)


def test_a_wind_beyond_its_bounds_is_noticed(quadrotor: Any) -> None:
    plan = quadrotor.plan("hover", "touchdown", **QUESTIONS[0], minimize="time")
    latest = [s.time[1] for s in plan.switches]
    rng = np.random.default_rng(0)
    x0 = some_start("hover", plan.references[0], rng)
    flight = fly(plan.modes, plan.references, latest, x0, Wind(lambda t, x, left: np.array([1.5, 0.0])))
    assert flight.faults


@pytest.mark.campaign
@pytest.mark.parametrize("question", range(len(QUESTIONS)))
def test_a_hundred_winds(quadrotor: Any, question: int, record_property: Any) -> None:
    plan = quadrotor.plan("hover", "touchdown", **QUESTIONS[question], minimize="time")
    count, faults, used = storm(plan, winds=102, seed=question)
    record_property(
        "campaign",
        f"quadrotor {' '.join(plan.modes)}: 102 winds, {count} switches, at most {used.max():.0%} of a certified time "
        f"used, {len(faults)} violations",
    )
    assert not faults, faults[:3]


@pytest.mark.campaign
def test_certified_pairs_of_every_switch(quadrotor: Any, record_property: Any) -> None:
    """Random certified pairs of references, three winds each."""
    rng = np.random.default_rng(9)
    flights, faults = 0, []
    for switch in quadrotor.switches:
        for r_i, r_j in switch.references.sample(8, seed=4):
            time = quadrotor.verdict(switch.source, switch.target, r_i, r_j).time
            for kind in rng.choice(KINDS, 3, replace=False):
                x0 = some_start(switch.source, r_i, rng)
                names = [switch.source, switch.target]
                found = fly(names, [r_i, r_j], [max(time[1], 1e-9)], x0, wind(kind, rng)).faults
                flights += 1
                faults += [f"{kind}: {fault}" for fault in found]
    record_property("campaign", f"quadrotor, pairs of every switch: {flights} flights, {len(faults)} violations")
    assert not faults, faults[:3]
