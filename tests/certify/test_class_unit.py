"""Relations out of one mode: budget, parts, resting centres, checks."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.class_unit import relate
from modegraph.certify.question import TargetSpec
from modegraph.certify.relation import Relation
from modegraph.deadline import Deadline
from modegraph.reach.failure import Mechanism
from tests.certify.class_graphs import double_integrators, one_integrator

SQUARE = mg.Box([-1.0, -1.0], [1.0, 1.0])


def related(mode: mg.Mode, targets: list[Any], seconds: float = 60.0) -> Any:
    specs = [TargetSpec(t.name, None, t) for t in targets]
    deadline = Deadline(seconds)
    return relate(mode, None, specs, horizon=6.0, deadline=deadline, progress=lambda text: None)


def test_what_cannot_be_a_target_is_told_and_the_rest_is_related() -> None:
    mode = one_integrator(lambda r: r, lambda r: mg.Ball(r, 0.1), SQUARE, "mode")
    level = mg.Target("level", mg.Sublevel(lambda x: x[0] ** 4 + x[1] ** 2, 1.0))
    found = related(mode, [level, mode])
    assert found.relations[0].outcome is mg.Outcome.UNUSABLE_TARGET
    assert "'level'" in str(found.relations[0])
    assert isinstance(found.relations[1], Relation)
    assert found.check.status is mg.Status.CERTIFIED


def test_a_centre_that_does_not_rest_refutes_nothing() -> None:
    """The loop goes to r + (1, 0), its starts are around r."""
    mode = one_integrator(lambda r: r + np.array([1.0, 0.0]), lambda r: mg.Ball(r, 0.1), SQUARE, "mode")
    relation = related(mode, [mode]).relations[0]
    assert relation.rest is None
    source, target = np.array([[-0.5, 0.0]] * 2), np.array([[0.5, 0.0], [-0.5, 0.9]])
    assert relation.crossings(source, target).certified.tolist() == [True, False]
    assert not relation.refuted(source, target).any()


def test_a_disturbance_that_cannot_be_zero_leaves_nothing_at_rest() -> None:
    plant = mg.System(lambda x, u, w: u + w, states="a b", inputs="ua ub", disturbance=mg.Box([0.1, 0.0], [0.2, 0.0]))
    mode = mg.Mode(
        "pushed", plant, controller=lambda x, r: -4.0 * (x - r), reference=mg.setpoint(SQUARE),
        start=lambda r: mg.Ball(r, 0.2),
    )  # fmt: skip
    relation = related(mode, [mode]).relations[0]
    assert relation.rest is None
    assert relation.crossings(np.zeros((1, 2)), np.array([[0.1, 0.0]])).certified[0]


def test_the_deadline_is_kept_and_what_is_there_is_used() -> None:
    mode = double_integrators(2)[0]
    found = related(mode, [mode], seconds=-1.0)
    relation = found.relations[0]
    assert isinstance(relation, Relation)
    assert not relation.crossings(np.zeros((1, 2)), np.full((1, 2), 0.4)).certified[0]
    assert found.check.until == pytest.approx(0.0, abs=0.5) or found.check.status is mg.Status.CERTIFIED


def test_a_class_is_safe_for_ever_though_a_state_that_nobody_reads_drifts() -> None:
    """The degrees of a class have a weight for each variable of its starts; the invariant set has fewer of them."""
    plant = mg.System(
        lambda x, u, w: np.array([x[1], -np.sin(x[0]) + u[0] + w[0], -0.2]), states="angle rate odometer",
        inputs="torque", disturbance=mg.Box([-0.05], [0.05]),
    )  # fmt: skip
    mode = mg.Mode(
        "held", plant, controller=lambda x, r: np.sin(r) - 4.0 * (x[:1] - r) - 3.0 * x[1:2],
        reference=mg.setpoint(mg.Box([-0.5], [0.5])), start=lambda r: mg.Ball([r[0], 0.0, 0.0], 0.2),
        constraints=lambda x: {"rate": abs(x[1]) <= 2.0},
    )  # fmt: skip
    check = related(mode, [mode]).check
    assert check.status is mg.Status.CERTIFIED, check.reason


def test_a_check_that_fails_names_the_constraint_and_when() -> None:
    """At 0.1 e^-t from its reference, the loop breaks t |x - r| <= 0.01 soon, though not at the start."""
    mode = mg.Mode(
        "mode", mg.System(lambda x, u: u, states="a", inputs="u"), controller=lambda x, r: r - x,
        reference=mg.setpoint(mg.Box([-1.0], [1.0])), start=lambda r: mg.Ball(r, 0.1),
        constraints=lambda x, r, t: {"late": t * (x[0] - r[0]) <= 0.01},
    )  # fmt: skip
    check = related(mode, [mode]).check
    assert check.status is mg.Status.UNDECIDED
    forever, constraint = check.why
    assert forever.fields["why"].mechanism is Mechanism.ENDS_BEFORE_SETTLED
    assert constraint.outcome is mg.Outcome.CONSTRAINT_NOT_PROVED
    assert constraint.fields["constraint"] == "late"
    assert constraint.fields["by"] > 0.0
    assert check.until is not None
    assert constraint.fields["time"] == pytest.approx(check.until)
    assert forever.fields["until"] == check.until


def test_the_slack_of_a_class_is_that_at_its_entry_too() -> None:
    """Starts up to .2 from the reference, .05 from the limit; later, when the flow was restarted, they are nearer."""
    plant = mg.System(
        lambda x, u, w: np.array([x[1], u[0] - 0.3 * np.sin(x[0]) + w[0]]), states=2, inputs=1,
        disturbance=mg.Box([-0.02], [0.02]),
    )  # fmt: skip
    mode = mg.Mode(
        "m", plant, controller=lambda x, r: -4.0 * (x[:1] - r) - 4.0 * x[1:],
        reference=mg.setpoint(mg.Box([-0.5], [0.5])), start=lambda r: mg.Ball([r[0], 0.0], 0.2),
        constraints=lambda x, r: {"near": x[0] - r[0] <= 0.25},
    )  # fmt: skip
    (relation,) = related(mode, [mode]).relations
    assert isinstance(relation, Relation)
    assert 0.0 < relation.slack["near"] <= 0.05
    assert relation.extremes[0] > 1.0
