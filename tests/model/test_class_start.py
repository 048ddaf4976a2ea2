"""Start sets of a continuous class are traced, and proved to exist for every reference."""

import numpy as np
import pytest

import modegraph as mg
from modegraph.errors import ModegraphError
from modegraph.expression.evaluate import Evaluator
from modegraph.expression.tape import compile_tape
from modegraph.model.class_start import StartClass, class_start
from modegraph.model.sets.parametrised import numbers
from modegraph.model.start import mode_start

PLANT = mg.System(lambda x, u: np.array([x[1], u[0]]), states="position speed", inputs="force")


def make(start, reference=None, memory=None):
    reference = reference or mg.setpoint(mg.Box([-1.0, 0.5], [1.0, 2.0]))
    return mg.Mode("hover", PLANT, controller=lambda x: -x[:1], reference=reference, start=start, memory=memory)


WIDTH = np.array([0.1, 0.2])
STARTS = {
    "ball": lambda r: mg.Ball([r[0], 0.0], 0.5),
    "growing ball": lambda r: mg.Ball([np.sin(r[0]), r[0] * r[1]], 0.1 + r[1] ** 2),
    "box": lambda r: mg.Box(np.array([r[0], 0.0]) - WIDTH, np.array([r[0], 0.0]) + WIDTH),
    "box of the reference": lambda r: mg.Box(np.concatenate([r[:1], [0]]) - WIDTH, np.concatenate([r[:1], [r[1]]])),
    "named": lambda r: mg.Box(hi=[r[1], 1.0], lo=[0.0, -r[1]]),
    "zonotope": lambda r: mg.Zonotope(np.array([r[1], r[0]]), [[r[1], 0.5, 0.0], [0.0, 0.1, r[0]]]),
    "one generator": lambda r: mg.Zonotope(r, [0.5, r[1]]),
    "ellipsoid": lambda r: mg.Ellipsoid(r - 1.0, np.array([[2.0, 0.5], [0.5, 1.0]])),
    "parameters": lambda r: mg.Ball([r.p[0], r.dot[0]], r.p[1]),
}


@pytest.mark.parametrize("name", STARTS)
def test_the_class_agrees_with_each_of_its_references(name):
    mode = make(STARTS[name])
    found = class_start(mode)
    assert isinstance(found, StartClass)
    assert found.dim == 2
    entries = [e for c, row in zip(found.set.centre, found.set.axes, strict=True) for e in (c, *row)]
    evaluate = Evaluator(compile_tape(entries, found.parameters))
    for p in [(-1.0, 0.5), (1.0, 2.0), (0.3, 0.7)]:
        instance = mode_start(mode, p)
        centre, axes = numbers(instance)
        expected = np.concatenate([centre[:, None], axes], axis=1)
        np.testing.assert_allclose(evaluate(np.array(p)), expected.ravel(), rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize("name", STARTS)
def test_one_reference_of_a_class_has_the_same_set_as_alone(name):
    mode = make(STARTS[name])
    for p in [(-1.0, 0.5), (0.3, 0.7)]:
        assert mode_start(mode, p) == mode_start(make(STARTS[name], mg.setpoint(p)))


def test_affine_classes():
    assert class_start(make(STARTS["ball"])).is_affine
    assert not class_start(make(STARTS["growing ball"])).is_affine
    assert not class_start(make(STARTS["named"])).is_affine


def test_constant_sets():
    region = mg.Polytope([[1, 0], [-1, 0], [0, 1], [0, -1]], [1, 1, 1, 1])
    assert class_start(make(region)) is region
    assert class_start(make(lambda r: mg.Box(np.zeros(2), np.ones(2)))) == mg.Box([0, 0], [1, 1])
    cut = mg.Sublevel(lambda x: x[0] ** 2 + x[1] ** 2, 1.0)
    assert class_start(make(cut)) is cut


def test_a_moving_class_starts_where_it_is_at_entry():
    reference = mg.trajectory(lambda t, p: np.array([np.cos(p[0] * t)]), 1.0, over=mg.Box([1.0], [2.0]))
    found = class_start(make(lambda r: mg.Ball([r[0], r.ddot[0]], 1.0), reference))
    assert [e.text() for e in found.set.centre] in (["1", "-p[0]**2"], ["1", "-(p[0]**2)"])


def test_joint_with_memory():
    memory = mg.Memory("integral", lambda x: x[:1], lambda: [0.0])
    assert class_start(make(lambda r: mg.Ball([r[0], 0, r[1]], 1), memory=memory)).dim == 3


@pytest.mark.parametrize(
    "start, words",
    [
        (lambda r: mg.Ball([r[0], 0.0], r[0]), "the radius of the Ball is negative for the reference (-1, 0.5)"),
        (lambda r: mg.Ball([r[0], 0.0], 0.3 - r[0] ** 2), "the radius of the Ball is negative"),
        (lambda r: mg.Ball([r[0], 0.0], 0.999 - np.cos(r[0])), "the radius of the Ball is negative"),
        (lambda r: mg.Box([r[0], 0.0], [0.5, 1.0]), "coordinate 0 of the Box is inverted (lo above hi)"),
        (lambda r: mg.Box([0.0, r[1]], [0.5, 2.0 - 0.1 * r[0] ** 2]), "coordinate 1 of the Box is inverted"),
        (lambda r: mg.Box([r[0], 1.0], [r[0] + 1.0, 0.0]), "coordinate 1 of the Box is inverted"),
        (lambda r: mg.Ball([1.0 / r[0], 0.0], 1.0), "not proved that the start set is defined near the reference (0"),
        (lambda r: mg.Ball([np.log(r[0] + 1.0), 0.0], 1.0), "not proved that the start set is defined"),
        (lambda r: mg.Ball([0.0 / r[0], 0.0], 1.0), "not proved that the start set is defined"),
        (lambda r: mg.Ball([r[0] - r[0], r[1]], (r[0] - r[0] ** 3) ** 2 * 1e-3), "undecided whether the radius"),
        (lambda r: mg.Ball([r[0]], 0.5), "has 1 coordinates, expected 2"),
        (lambda r: mg.Ball([r[0], 0.0], [0.5, r[1]]), "radius must be one number, got 2"),
        (lambda r: mg.Box([r[0], 0.0], [1.0]), "lo has 2 coordinates but hi has 1"),
        (lambda r: mg.Zonotope([r[0], 0.0], [[r[1], 0.0]]), "must be a matrix with 2 rows"),
        (lambda r: mg.Ellipsoid(r, np.diag([r[1], 1.0])), "shape must not depend on the reference"),
        (lambda r: mg.Ellipsoid(r, np.diag([-1.0, 1.0])), "mode 'hover', start, Ellipsoid"),
        (lambda r: mg.Polytope([[1, 0], [-1, 0], [0, 1], [0, -1]], [r[0], 1, 1, 1]), "a Polytope cannot depend"),
        (lambda r: mg.Sublevel(lambda x: x[0] ** 2 + x[1] ** 2, r[1]), "a Sublevel cannot depend"),
        (lambda r: [r[0], 0.0], "start must return a set"),
        (lambda r: mg.Ball([r[0], 0.0], 1.0 if r[0] > 0 else 2.0), "np.where"),
        (lambda r: mg.Ball([float(r[0]), 0.0], 1.0), "start"),
        (lambda r: mg.Ball([r[0], 0.0], np.nan), "start"),
    ],
)
def test_bad_start_sets(start, words):
    with pytest.raises(ModegraphError) as error:
        class_start(make(start))
    assert words in str(error.value)
    assert "'hover'" in str(error.value)


def test_a_fold_that_hides_a_pole_is_seen():
    with pytest.raises(ModegraphError, match="not proved that the start set is defined"):
        class_start(make(lambda r: mg.Ball([r[0] / r[0], r[1]], 1.0)))


def test_an_irrational_bound_is_decided_in_intervals():
    assert class_start(make(lambda r: mg.Ball([r[0], 0.0], r[0] + np.exp(1.0) - 1.7))).dim == 2
    with pytest.raises(ModegraphError, match="negative"):
        class_start(make(lambda r: mg.Ball([r[0], 0.0], r[0] + np.sin(r[1] - r[1] + 0.5))))


def test_a_margin_is_enough():
    assert class_start(make(lambda r: mg.Ball([r[0], 0.0], r[0] ** 2 - 0.5 * r[0] + 0.07))).dim == 2
    with pytest.raises(ModegraphError, match="negative"):
        class_start(make(lambda r: mg.Ball([r[0], 0.0], r[0] ** 2 - 0.5 * r[0] + 0.06)))
