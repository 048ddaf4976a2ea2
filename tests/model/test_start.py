"""Start sets are evaluated in floats and checked."""

import numpy as np
import pytest

import modegraph as mg
from modegraph.errors import ModegraphError
from modegraph.model.start import mode_start

PLANT = mg.System(lambda x, u: np.array([x[1], u[0]]), states="position speed", inputs="force")


def make(start, reference=None, memory=None):
    return mg.Mode(
        "gentle",
        PLANT,
        controller=lambda x: -x[:1],
        reference=reference or mg.setpoint([0.25]),
        start=start,
        memory=memory,
    )


def test_function_of_the_reference():
    start = mode_start(make(lambda r: mg.Ball([r[0], 0.0], 0.5)))
    assert start == mg.Ball([0.25, 0.0], 0.5)


def test_reads_derivatives_and_parameters():
    reference = mg.trajectory(lambda t, p: p[0] * t + np.array([1.0]), 1.0, over=mg.Points([[2.0], [3.0]]))
    mode = make(lambda r: mg.Box([r[0], r.dot[0]], [r[0] + r.p[0], r.dot[0]]), reference)
    assert mode_start(mode, [3.0]) == mg.Box([1, 3], [4, 3])


def test_floats_are_plain():
    def start(r):
        centre = np.zeros(2)
        centre[0] = float(r[0])
        return mg.Ellipsoid(centre, np.diag([1.0, 4.0]) * (2.0 if r[0] > 0 else 1.0))

    assert mode_start(make(start)).shape[1, 1] == 8.0


def test_constant_set():
    region = mg.Box([-1, -1], [1, 1])
    assert mode_start(make(region)) is region


def test_joint_with_memory():
    memory = mg.Memory("integral", lambda x: x[:1], lambda: [0.0])
    assert mode_start(make(mg.Ball([0, 0, 0], 1), memory=memory)).dim == 3
    assert mode_start(make(mg.Ball([0, 0], 1), memory=memory)).dim == 2


@pytest.mark.parametrize(
    "start, words",
    [
        (lambda r: [r[0], 0.0], "start must return a set"),
        (lambda r: None, "start must return a set"),
        (mg.Ball([0], 1), "has 1 coordinates, expected 2"),
        (mg.Ball([0, 0, 0], 1), "has 3 coordinates, expected 2"),
        (mg.Polytope([[1, 0], [-1, 0]], [0, -1]), "empty"),
        (mg.Polytope([[1, 0], [-1, 0]], [0, 1]), "unbounded"),
        (lambda r: mg.Ball(r, -1.0), "radius = -1.0 is negative"),
        (lambda x: mg.Ball(x, 1.0), "'x'"),
        (lambda r: mg.Ball([r[0], r[1]], 1.0), "IndexError"),
    ],
)
def test_bad_starts(start, words):
    with pytest.raises(ModegraphError, match="mode 'gentle'") as error:
        mode_start(make(start))
    assert words in str(error.value)


def test_the_reference_is_named():
    mode = make(lambda r: mg.Ball([r[0], 0], -r[0]), mg.setpoint(mg.Points([[-1], [2]])))
    assert mode_start(mode, [-1]).radius == 1.0
    with pytest.raises(ModegraphError, match=r"mode 'gentle\(2\)', start: Ball: radius"):
        mode_start(mode, [2])
