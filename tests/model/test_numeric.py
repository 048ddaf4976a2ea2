"""Functions that give no plain numbers where the mode starts."""

import numpy as np
import pytest

import modegraph as mg
from modegraph.errors import ModegraphError
from modegraph.model.numeric import require_finite_values
from modegraph.model.start import mode_start

PLANT = mg.System(lambda x, u: np.array([x[1], u[0]]), states=2, inputs=1)


def check(controller, start=None, system=PLANT, **options):
    start = start or mg.Ball([0, 0], 1)
    mode = mg.Mode("m", system, controller=controller, reference=mg.setpoint(0), start=start, **options)
    require_finite_values(mode, None, mode_start(mode))


def test_good_values():
    check(lambda x: -x[0])
    check(lambda x, r: [r[0]])
    check(lambda x, z: z, memory=mg.Memory("a", lambda z, u: -z * u, lambda x: x[:1]))
    check(lambda x, z: z, mg.Ball([0, 0, 1], 0.5), memory=mg.Memory("a", lambda z: -z, lambda x: x[:1]))
    uncertain = mg.System(
        lambda x, w, d: w * d["m"],
        states=2,
        inputs=1,
        disturbance=mg.Box([0, 0], [1, 1]),
        unknowns={"m": (1, 2)},
    )
    check(lambda x: x[0], system=uncertain)


@pytest.mark.parametrize(
    "controller, words",
    [
        (lambda x: x[:1] / x[0], r"returned \[nan\] at x = \(0, 0\), the centre of the start set"),
        (lambda x: 1 / x[:1], r"returned \[inf\]"),
        (lambda x: x, r"returned shape \(2,\), expected shape \(1,\)"),
        (lambda x: "a", "returned 'a', not a vector of numbers"),
    ],
)
def test_bad_values(controller, words):
    with pytest.raises(ModegraphError, match=f"mode 'm', controller {words}"):
        check(controller)


def test_the_role_is_named():
    with pytest.raises(ModegraphError, match="mode 'm', memory reset returned"):
        check(lambda x: x[0], memory=mg.Memory("a", lambda z: -z, lambda x: [np.sqrt(-1 - x[0])]))
    with pytest.raises(ModegraphError, match="mode 'm', dynamics returned"):
        check(lambda x: x[0], system=mg.System(lambda x: x / x[0], states=2, inputs=1))
