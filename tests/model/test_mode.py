"""Modes: what they keep, how they name themselves, eager checks."""

import numpy as np
import pytest

import modegraph as mg
from modegraph.errors import ModegraphError, NotBuiltYet

PLANT = mg.System(lambda x, u: np.array([x[1], u[0]]), states="position speed", inputs="force")


def make(**changes):
    given = {
        "name": "gentle",
        "system": PLANT,
        "controller": lambda x, r: -(x[:1] - r) - 2 * x[1:],
        "reference": mg.setpoint([0.0]),
        "start": mg.Ball([0, 0], 0.5),
        **changes,
    }
    return mg.Mode(given.pop("name"), given.pop("system"), **given)


def test_keeps_what_it_was_given():
    controller = lambda x: [0.0]
    limits = lambda x: {"speed": x[1] <= 1}
    start = lambda r: mg.Ball([r[0], 0], 1)
    mode = make(controller=controller, constraints=limits, start=start, horizon=3)
    assert mode.name == "gentle"
    assert mode.system is PLANT
    assert mode.controller is controller
    assert mode.constraints is limits
    assert mode.start is start
    assert mode.output is None
    assert mode.horizon == 3.0
    assert mode.memory is None
    assert mode.state_names == ("position", "speed")


def test_labels():
    assert make().label_of() == "gentle"
    many = make(reference=mg.setpoint(mg.Points([[0.5], [1]])))
    assert many.label_of([0.5]) == "gentle(0.5)"
    with pytest.raises(ModegraphError, match=r"mode 'gentle': .*names no reference"):
        many.label_of([0.7])


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"name": ""}, "name"),
        ({"name": 3}, "non-empty string"),
        ({"system": None}, "system must be a System"),
        ({"controller": None}, "controller must be a function"),
        ({"reference": [0.0]}, "mg.setpoint"),
        ({"start": [0, 0]}, "start must be a set or a function"),
        ({"constraints": {"a": 1}}, "constraints must be a function"),
        ({"output": "position"}, "output must be a function"),
        ({"horizon": 0}, "horizon must be > 0"),
        ({"horizon": float("nan")}, "horizon"),
        ({"memory": 1}, "memory must be a Memory"),
        ({"memory": mg.Memory("speed", len, len)}, "'speed' names a plant state and a memory state"),
    ],
)
def test_bad_modes(changes, words):
    with pytest.raises(ModegraphError) as error:
        make(**changes)
    assert words in str(error.value)
    if "name" not in changes:
        assert "mode 'gentle'" in str(error.value)


def test_hold_is_not_built_yet():
    with pytest.raises(NotBuiltYet, match=r"mode 'gentle': hold="):
        make(hold=0.1)
