"""The judge itself: certificates that are wrong on purpose have to be found out."""

from __future__ import annotations

import numpy as np

import modegraph as mg
from tests.graph.fakes import because
from tests.soundness.checker import Claim, examine, refutation_holds
from tests.traps.question import flow

TIME = (0.0, float(np.log(10.0)))  # x' = -x from [.5, 1] into |x| <= .1


def decay(limit: float = 2.0, push: float | None = None) -> mg.Mode:
    bound = lambda x: {"limit": x[0] <= limit}
    if push is None:
        return flow("decay", lambda x: -x, mg.Box([0.5], [1.0]), constraints=bound)
    return flow(
        "decay",
        lambda x, w: w - x,
        mg.Box([0.5], [1.0]),
        constraints=bound,
        disturbance=mg.Box([-push], [push]),
    )


def kinds(mode: mg.Mode, claim: Claim) -> set[str]:
    return {violation.kind for violation in examine(mode, [claim], runs=28, seed=1)}


def test_a_right_claim_passes():
    assert not kinds(decay(), Claim("goal", mg.Box([-0.1], [0.1]), TIME))


def test_a_latest_time_that_is_too_early():
    claim = Claim("goal", mg.Box([-0.1], [0.1]), (0.0, TIME[1] - 1e-6))
    assert kinds(decay(), claim) == {"has not entered the target"}


def test_an_earliest_time_that_is_too_late():
    claim = Claim("goal", mg.Box([-0.1], [0.1]), (2.0, TIME[1]))
    assert kinds(decay(), claim) == {"entered the target before the earliest time"}


def test_a_target_that_is_too_small():
    claim = Claim("goal", mg.Box([-0.1], [0.0999999]), TIME)
    assert kinds(decay(), claim) == {"has not entered the target"}


def test_a_target_passed_too_late_on_the_wrong_side():
    assert kinds(decay(), Claim("goal", mg.Box([1.2], [2.0]), (0.0, 5.0))) == {"has not entered the target"}


def test_a_violated_constraint():
    assert kinds(decay(limit=0.97), Claim("goal", mg.Box([-0.1], [0.1]), TIME)) == {"violated limit"}


def test_a_disturbance_that_was_forgotten():
    claim = Claim("goal", mg.Box([-0.1], [0.1]), TIME)
    assert "has not entered the target" in kinds(decay(push=0.05), claim)


def test_an_energy_that_is_too_small():
    mode = mg.Mode(
        "drive",
        mg.System(lambda x, u: u, states=1, inputs=1),
        controller=lambda x: -x[0],
        reference=mg.setpoint([0.0]),
        start=mg.Box([0.5], [1.0]),
    )
    true = (1.0 - 0.01) / 2  # integral of exp(-2 t) up to ln 10
    claim = lambda energy: Claim("goal", mg.Box([-0.1], [0.1]), TIME, energy)
    assert not kinds(mode, claim(true * 1.0001))
    assert kinds(mode, claim(true * 0.8)) == {"spent more energy"}


def refuted(x0: float, kind: str, time: float) -> mg.Verdict:
    witness = mg.Witness(np.array([x0]), None, {}, time, kind)  # type: ignore[arg-type]
    return mg.Verdict(mg.Status.REFUTED, because("by hand"), witness=witness, horizon=2.0)


def test_a_right_refutation_passes():
    goal = mg.Box([-0.1], [0.1])
    assert refutation_holds(decay(), goal, refuted(1.0, "horizon", 2.0), 2.0) is None
    assert refutation_holds(decay(limit=0.9), goal, refuted(1.0, "violates", 0.0), 2.0) is None


def test_wrong_refutations_are_found_out():
    goal = mg.Box([-0.1], [0.1])
    assert "enters" in (refutation_holds(decay(), goal, refuted(0.6, "horizon", 2.0), 2.0) or "")
    assert "not in the start set" in (refutation_holds(decay(), goal, refuted(1.5, "horizon", 2.0), 2.0) or "")
    assert "violates nothing" in (refutation_holds(decay(), goal, refuted(1.0, "violates", 0.0), 2.0) or "")
