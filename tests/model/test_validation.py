"""Lists of modes."""

import numpy as np
import pytest

import modegraph as mg
from modegraph.errors import ModegraphError
from modegraph.model.validation import validate_modes

PLANT = mg.System(lambda x, u: np.array([x[1], u[0]]), states="position speed", inputs="force")
SWAPPED = mg.System(lambda x, u: np.array([u[0], x[0]]), states="speed position", inputs="force")
OTHER = mg.System(lambda x, u: u, states="height", inputs="force")


def mode(name, system=PLANT, start=None):
    start = start or mg.Ball([0] * system.n, 0.5)
    return mg.Mode(name, system, controller=lambda x: -x[:1], reference=mg.setpoint([0.0]), start=start)


def test_a_good_list():
    modes = [mode("a"), mode("b"), mg.Target("goal", mg.Box([0, 0], [1, 1]))]
    assert validate_modes(modes) == tuple(modes)
    assert validate_modes(iter(modes)) == tuple(modes)


def test_the_same_states_of_another_plant_are_fine():
    heavier = mg.System(lambda x, u: np.array([x[1], u[0] / 2]), states=["position", "speed"], inputs=1)
    assert validate_modes([mode("a"), mode("b", heavier)])


@pytest.mark.parametrize(
    "modes, words",
    [
        ([], "the list of modes is empty"),
        (mode("a"), "put it in a list"),
        ({"a": mode("a")}, "got dict"),
        ("model.py", "got str"),
        (3, "got int"),
        ([mode("a"), "b"], "entry 1"),
        ([mg.Target("goal", mg.Box([0, 0], [1, 1]))], "no mode"),
        ([mode("a"), mode("a")], "two modes are called 'a'"),
        ([mode("a"), mg.Target("a", mg.Box([0, 0], [1, 1]))], "two modes are called 'a'"),
        ([mode("a"), mode("b", OTHER)], "mode 'b' has the states height but mode 'a' has position, speed"),
        ([mode("a"), mode("b", SWAPPED)], "in the same order"),
        ([mode("a"), mg.Target("goal", mg.Box([0], [1]))], "target 'goal': its set has 1 coordinates"),
        ([mode("a"), mode("b", start=mg.Ball([0], 1))], "mode 'b': the start set has 1 coordinates"),
    ],
)
def test_bad_lists(modes, words):
    with pytest.raises(ModegraphError) as error:
        validate_modes(modes)
    assert words in str(error.value)


def test_the_start_sets_of_a_class_are_checked():
    def hover(start):
        return mg.Mode(
            "hover", PLANT, controller=lambda x: -x[:1], reference=mg.setpoint(mg.Box([0.0], [1.0])), start=start
        )

    assert validate_modes([hover(lambda r: mg.Ball([r[0], 0.0], 0.5))])
    with pytest.raises(ModegraphError, match=r"mode 'hover', start: the radius .* for the reference \(0\)"):
        validate_modes([hover(lambda r: mg.Ball([r[0], 0.0], r[0] - 0.5))])
