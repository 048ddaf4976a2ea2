"""What was stated cannot be changed, only stated anew."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.model.immutable import Immutable


def moved(x: Any, u: Any) -> Any:
    return u - x


def held(x: Any, r: Any) -> Any:
    return r - x


PLANT = mg.System(moved, states="x", inputs="u", name="cart")
MODE = mg.Mode("m", PLANT, controller=held, reference=mg.setpoint([0.5]), start=mg.Box([0.0], [1.0]), horizon=3.0)
MADE = [
    (MODE, "controller"),
    (PLANT, "dynamics"),
    (mg.Memory("z", lambda x: x, lambda x: x), "reset"),
    (mg.Target("t", mg.Box([0.0], [1.0])), "set"),
    (mg.setpoint([0.5]), "points"),
    (mg.Points([[0.5]]), "points"),
    (mg.quintic([0.0], [1.0], 2.0), "signal"),
    (mg.Box([0.0], [1.0]), "lo"),
    (mg.Ball([0.0], 1.0), "radius"),
    (mg.Ellipsoid([0.0], [[1.0]]), "shape"),
    (mg.Zonotope([0.0], [[1.0]]), "generators"),
    (mg.Polytope([[1.0], [-1.0]], [1.0, 1.0]), "b"),
    (mg.Sublevel(lambda x: x[0] ** 2, 1.0), "level"),
]


@pytest.mark.parametrize(("made", "name"), MADE, ids=lambda v: v if isinstance(v, str) else type(v).__name__)
def test_no_attribute_can_be_set_or_deleted(made: Any, name: str) -> None:
    before = getattr(made, name)
    for change in (lambda: setattr(made, name, None), lambda: delattr(made, name), lambda: setattr(made, "_own", 1)):
        with pytest.raises(mg.ModegraphError, match=f"{type(made).__name__}.* cannot be changed.*another one"):
            change()
    assert getattr(made, name) is before


def test_the_remedy_and_a_misspelt_name_are_told() -> None:
    with pytest.raises(mg.ModegraphError, match=r"Mode 'm' cannot be changed .* use \.replace\(name=value\)"):
        MODE.start = mg.Box([0.0], [2.0])
    with pytest.raises(mg.ModegraphError, match=r"no attribute 'contoller'; did you mean 'controller'\?"):
        MODE.contoller = held  # type: ignore[attr-defined]
    with pytest.raises(mg.ModegraphError, match=r"Mode 'm' has no attribute 'refernce'; did you mean 'reference'\?"):
        _ = MODE.refernce  # type: ignore[attr-defined]
    with pytest.raises(AttributeError, match=r"this Box has no attribute 'radius_of_it'$"):
        _ = MODE.start.radius_of_it  # type: ignore[union-attr]
    assert not hasattr(MODE, "contoller")


def test_copies_and_pickles_are_the_same_and_as_closed() -> None:
    twin = copy.copy(MODE)
    assert (twin.name, twin.controller, twin.start, twin.horizon) == ("m", held, MODE.start, 3.0)
    box = pickle.loads(pickle.dumps(MODE.start))
    assert box == MODE.start
    for same in (twin, box, copy.deepcopy(MODE.reference)):
        with pytest.raises(mg.ModegraphError, match="cannot be changed"):
            same.name = "n"


def test_a_replaced_mode_has_everything_else_the_same() -> None:
    other = MODE.replace(name="n", controller=moved)
    assert (other.name, other.controller) == ("n", moved)
    assert (MODE.name, MODE.controller) == ("m", held)
    for name in ("system", "reference", "start", "constraints", "output", "horizon", "memory", "hold"):
        assert getattr(other, name) is getattr(MODE, name)


def test_a_replaced_plant_keeps_its_names() -> None:
    plant = mg.System(lambda x, u, w: u - x + w, states=1, inputs="u", disturbance=mg.Box([0.0], [1.0]), name="p")
    other = plant.replace(disturbance=mg.Box([0.0], [2.0]))
    assert other.disturbance == mg.Box([0.0], [2.0])
    assert (other.dynamics, other.states, other.inputs, other.name) == (plant.dynamics, ("x[0]",), ("u",), "p")
    affine = mg.System.affine(lambda x: -x, lambda x: np.ones(1), states="x", inputs="u").replace(name="named")
    assert (affine.name, affine.n) == ("named", 1)


def test_a_replacement_is_checked_as_any_mode() -> None:
    with pytest.raises(mg.ModegraphError, match=r"no argument 'contoller'; did you mean 'controller'\?; it takes"):
        MODE.replace(contoller=held)
    with pytest.raises(mg.ModegraphError, match="horizon must be > 0"):
        MODE.replace(horizon=-1.0)


def test_what_is_computed_once_is_kept() -> None:
    level = mg.Sublevel(lambda x: x[0] ** 2, 1.0)
    level.settle(1)
    assert level.function is level.function
    assert level.dim == 1
    assert level.center is level.center


def test_an_error_inside_a_property_is_not_hidden() -> None:
    class Odd(Immutable):
        @property
        def broken(self) -> int:
            return [].missing  # type: ignore[attr-defined,no-any-return]

    with pytest.raises(AttributeError, match="'list' object has no attribute 'missing'"):
        _ = Odd().broken
