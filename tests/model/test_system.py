"""Plants: names, disturbances, unknown constants, the affine form."""

import functools

import numpy as np
import pytest

import modegraph as mg
from modegraph.errors import ModegraphError
from modegraph.model.closed_loop import close_loop


def drift(x, u):
    return np.array([x[1], u[0]])


def test_names():
    plant = mg.System(drift, states="position speed", inputs="force")
    assert plant.dynamics is drift
    assert plant.states == ("position", "speed")
    assert plant.inputs == ("force",)
    assert (plant.n, plant.p, plant.q) == (2, 1, 0)
    assert mg.System(drift, states=["a", "b"], inputs=1).inputs == ("u[0]",)
    assert mg.System(drift, states=2, inputs=np.int64(1)).states == ("x[0]", "x[1]")


def test_uncertainty_is_kept():
    box = mg.Box([-1], [1])
    plant = mg.System(drift, states=2, inputs=1, disturbance=box, unknowns={"m": (1, 2), "k": (3, 3)})
    assert plant.disturbance is box
    assert plant.q == 1
    assert dict(plant.unknowns) == {"m": (1.0, 2.0), "k": (3.0, 3.0)}
    assert plant.unknown_centres() == {"m": 1.5, "k": 3.0}


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"dynamics": 3}, "dynamics must be a function"),
        ({"states": "a a"}, "'a' appears twice"),
        ({"states": 0}, "at least one state"),
        ({"states": -1}, "count >= 0"),
        ({"states": ["a", 3]}, "non-empty string"),
        ({"states": ["a", ""]}, "non-empty string"),
        ({"states": 2.5}, "list of names"),
        ({"inputs": True}, "names or a count"),
        ({"disturbance": mg.Ball([0], 1)}, "must be a Box"),
        ({"unknowns": {"m": (2, 1)}}, "inverted"),
        ({"unknowns": {"m": 2}}, "pair (lo, hi)"),
        ({"unknowns": {"m": (0, float("inf"))}}, "finite"),
        ({"unknowns": [("m", 1, 2)]}, "dict"),
        ({"unknowns": {3: (1, 2)}}, "non-empty string"),
        ({"name": ""}, "name"),
    ],
)
def test_bad_plants(changes, words):
    given = {"dynamics": drift, "states": 2, "inputs": 1, **changes}
    with pytest.raises(ModegraphError, match="System") as error:
        mg.System(given.pop("dynamics"), **given)
    assert words in str(error.value)


def test_the_plant_is_named():
    with pytest.raises(ModegraphError, match="System 'cart': unknown 'm' is inverted"):
        mg.System(drift, states=2, inputs=1, unknowns={"m": (2, 1)}, name="cart")


def mode_of(plant, controller=lambda x: -x[:1]):
    return mg.Mode("m", plant, controller=controller, reference=mg.setpoint(0), start=mg.Box([-1, -1], [1, 1]))


def rates(plant):
    return [e.text() for e in close_loop(mode_of(plant)).segments[0].rhs]


def test_affine_is_the_same_as_written_out():
    written = mg.System(
        lambda x, u, d: np.array([x[1], np.sin(x[0]) + u[0] / d["m"]]),
        states="a b",
        inputs=1,
        unknowns={"m": (1, 2)},
    )
    affine = mg.System.affine(
        lambda x: np.array([x[1], np.sin(x[0])]),
        lambda x, d: np.array([[0], [1 / d["m"]]]),
        states="a b",
        inputs=1,
        unknowns={"m": (1, 2)},
    )
    assert rates(affine) == rates(written)


def test_affine_with_one_input_and_a_vector():
    affine = mg.System.affine(lambda x: [x[1], 0.0], lambda: np.array([0.0, 1.0]), states="a b", inputs=1)
    assert rates(affine) == ["b", "-a"]
    assert affine.dynamics.f([1, 2]) == [2, 0.0]


def test_affine_accepts_partials():
    def f(x, k):
        return np.array([x[1], -k * x[0]])

    affine = mg.System.affine(functools.partial(f, k=2.0), lambda x, g=3.0: [0.0, g], states="a b", inputs=1)
    assert len(rates(affine)) == 2
    value = affine.dynamics(x=np.array([1.0, 2.0]), u=np.array([1.0]))
    assert value.tolist() == [2.0, 1.0]


def test_affine_errors():
    with pytest.raises(ModegraphError, match="but not u"):
        mg.System.affine(lambda x, u: x, lambda x: x, states=2, inputs=1)
    with pytest.raises(ModegraphError, match="args"):
        mg.System.affine(lambda *args: args, lambda x: x, states=2, inputs=1)
    wrong = mg.System.affine(lambda x: x, lambda x: np.eye(2), states=2, inputs=1)
    with pytest.raises(ModegraphError, match=r"mode 'm', dynamics.*g returned shape \(2, 2\), expected \(2, 1\)"):
        close_loop(mode_of(wrong))
