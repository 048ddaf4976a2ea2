"""How near a reach set comes, in the words and units of the target."""

from __future__ import annotations

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.approach import approach_of, face_in_words
from modegraph.certify.counterexamples.witnessed import witnessed
from modegraph.certify.question import TargetSpec
from modegraph.certify.switching.common_time import Missed, Reach, find_crossings
from modegraph.certify.targets.region import Region
from modegraph.certify.targets.sublevel import target_region
from modegraph.certify.unit import certify_unit
from modegraph.certify.verdict import Approach, Witness
from modegraph.deadline import NEVER
from modegraph.reach.compiled import compile_mode
from modegraph.reach.flow.flow import Flow, Order

NAMES = ("angle", "rate")


def turning() -> mg.Mode:
    """Circles of radius up to .1 around (1, 0), angle' = rate, rate' = 1 - angle."""
    plant = mg.System(lambda x, u: np.array([x[1], u[0]]), states="angle rate", inputs="torque")
    return mg.Mode(
        "turn", plant, controller=lambda x: 1.0 - x[0], reference=mg.setpoint([0.0]), start=mg.Ball([1.0, 0.0], 0.1)
    )


def approach(target: mg.Set) -> Approach:
    compiled = compile_mode(turning(), None)
    flow = Flow(
        compiled.fields, compiled.whole(), compiled.w_centre, compiled.w_radius, Order(1, 0), names=NAMES,
        longest_step=0.1,
    )  # fmt: skip
    assert flow.run(3.0)
    region = target_region(target)
    missed = find_crossings(Reach(flow, None), region)
    assert isinstance(missed, Missed)
    found = approach_of(missed.nearest, region, NAMES)
    assert found is not None
    assert found.gauge == missed.gauge
    return found


def test_a_box_is_told_in_its_states() -> None:
    found = approach(mg.Box([-0.5, -1.0], [0.5, 1.0]))
    assert (found.face, found.unit) == ("angle <= 0.5", "angle")
    assert found.missing == pytest.approx(0.6, rel=1e-6)
    assert found.gauge == pytest.approx(1.1 / 0.5, rel=1e-6)
    assert approach(mg.Box([1.5, -1.0], [2.5, 1.0])).face == "angle >= 1.5"


def test_a_face_across_one_state_is_measured_in_that_state() -> None:
    found = approach(mg.Polytope([[-4.0, 0.0]], [-6.0]))
    assert (found.face, found.unit) == ("angle >= 1.5", "angle")
    assert found.missing == pytest.approx(0.6, rel=1e-6)


def test_a_slanted_face_is_a_combination() -> None:
    found = approach(mg.Polytope([[-1.0, 2.0]], [-2.0]))
    assert (found.face, found.unit) == ("-angle + 2 rate <= -2", "-angle + 2 rate")
    assert found.missing == pytest.approx(1.0 + 0.1 * np.sqrt(5.0), rel=1e-6)


def test_round_targets() -> None:
    ball = approach(mg.Ball([3.0, 0.0], 0.5))
    assert ball.face == "the ball of radius 0.5 around (3, 0)"
    assert ball.missing == pytest.approx(2.1 - 0.5, rel=1e-3)
    assert ball.detail == "angle up to 2.1 from its centre, where 0.5 is allowed"
    ellipsoid = approach(mg.Ellipsoid([0.5, 0.0], [[0.0025, 0.0], [0.0, 1.0]]))
    assert ellipsoid.unit == "times its size"
    assert ellipsoid.missing == pytest.approx(0.6 / 0.05 - 1.0, rel=0.01)
    assert ellipsoid.detail.startswith("angle up to 0.6 from its centre, where 0.05")


def test_a_sublevel_is_told_in_its_function() -> None:
    found = approach(mg.Sublevel(lambda x: x[0] ** 2 + x[1] ** 4, 0.25))
    assert (found.face, found.unit) == ("fn <= 0.25", "fn")
    assert found.missing >= 0.9**2 - 0.25


def test_a_flat_target_has_faces_too() -> None:
    words, unit, scale = face_in_words(Region(mg.Box([0.0, 0.0], [0.0, 0.0])), 2, NAMES)
    assert (words, unit, scale) == ("rate <= 0", "rate", 1.0)


def test_the_worst_start_is_a_start() -> None:
    mode = turning()
    target = mg.Target("middle", mg.Box([0.95, -0.05], [1.05, 0.05]))
    spec = TargetSpec(target.name, None, target)
    found = certify_unit(mode, None, [spec], horizon=3.0, deadline=NEVER, switches_only=True)
    closest = found.verdicts[0].closest
    assert closest is not None
    assert closest.start is not None
    assert closest.origin == "sampled"
    assert mg.Ball([1.0, 0.0], 0.1).contains(closest.start)
    assert np.linalg.norm(closest.start - [1.0, 0.0]) > 0.09
    assert found.check.status is mg.Status.UNDECIDED


def test_the_trajectory_of_a_witness() -> None:
    """From (1.1, 0) it circles: nearest to angle <= .8 after half a turn, at .9."""
    mode, target = turning(), mg.Target("left", mg.Box([0.0, -1.0], [0.8, 1.0]))
    witness = Witness(np.array([1.1, 0.0]), None, {}, 5.0, "horizon")
    spec = TargetSpec("left", None, target)
    closest, breach = witnessed(mode, None, witness, spec, horizon=5.0, deadline=NEVER)
    assert breach is None
    assert closest is not None
    assert closest.time == pytest.approx(np.pi, abs=0.01)
    assert closest.missing == pytest.approx(0.1, abs=1e-4)
    assert closest.missing >= 0.1
    assert (closest.face, closest.origin) == ("angle <= 0.8", "witness")
