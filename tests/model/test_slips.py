"""Models that are legitimate and hardly meant."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.model.faithful import require_faithful
from modegraph.model.slips import warn_of_slips

PLANT = mg.System(lambda x, u: u, states="x", inputs="u")
GAINS = (1.0, 2.0, 3.0)


def told(modes: list[mg.Mode]) -> list[str]:
    """The warnings about these modes."""
    loops = [[require_faithful(m, p) for p in m.reference.parameters()] for m in modes]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warn_of_slips(modes, loops)
    assert all(w.category is mg.ModegraphWarning for w in caught)
    return [str(w.message) for w in caught]


def modes(
    controllers: list[Any], *, reference: Callable[[int], Any] | None = None, start: Any = None, system: Any = None
) -> list[mg.Mode]:
    return [
        mg.Mode(
            f"m{k}", system or PLANT, controller=c, reference=reference(k) if reference else mg.setpoint([0.0]),
            start=start or mg.Box([-1.0 - k], [1.0 + k]),
        )
        for k, c in enumerate(controllers)
    ]  # fmt: skip


def late() -> list[Any]:
    made = []
    for k in GAINS:
        made.append(lambda x, r: k * (r - x))  # noqa: B023
    return made


def bound() -> list[Any]:
    return [lambda x, r, k=k: k * (r - x) for k in GAINS]


def gain(k: float) -> Any:
    return lambda x, r: k * (r - x)


def test_functions_made_in_a_loop_that_use_its_last_value() -> None:
    (text,) = told(modes(late()))
    assert text.startswith("the modes 'm0', 'm1', 'm2' are one and the same closed loop")
    assert "controller" in text
    assert "lambda x, k=k: ..." in text


def test_signals_of_the_references_are_compared_as_they_are_traced() -> None:
    (text,) = told(modes(late(), reference=lambda k: mg.quintic([0.0], [1.0], 2.0)))
    assert "'m0', 'm1', 'm2'" in text
    assert told(modes(late(), reference=lambda k: mg.quintic([0.0], [1.0 + k], 2.0))) == []
    assert told(modes(late(), reference=lambda k: mg.quintic([0.0], [1.0], 2.0 + k))) == []


def test_dynamics_made_in_a_loop() -> None:
    systems = []
    for k in GAINS:
        systems.append(mg.System(lambda x, u: u - k * x, states="x", inputs="u"))  # noqa: B023
    common = gain(1.0)
    made = [
        mg.Mode(f"m{k}", s, controller=common, reference=mg.setpoint([0.0]), start=mg.Box([-1.0], [1.0]))
        for k, s in enumerate(systems)
    ]
    (text,) = told(made)
    assert "the dynamics of each is a function of its own" in text


@pytest.mark.parametrize(
    "honest",
    [
        modes(bound()),
        modes([gain(k) for k in GAINS]),
        modes([gain(1.0), gain(1.0)]),
        modes([gain(1.0)] * 1 + [gain(2.0)]),
        modes([(same := gain(1.0)), same, same]),
        modes([same, same], start=mg.Box([0.0], [1.0])),
        modes(late(), reference=lambda k: mg.setpoint([float(k)])),
        modes([functools.partial(lambda x, r, k: k * (r - x), k=k) for k in GAINS]),
    ],
    ids=["bound", "factory", "one factory twice", "two gains", "one object", "twice the same", "references", "partial"],
)
def test_what_may_well_be_meant(honest: list[mg.Mode]) -> None:
    assert told(honest) == []


def factory(name: str, radius: float) -> mg.Mode:
    return mg.Mode(
        name, PLANT, controller=lambda x, r: GAINS[0] * (r - x), reference=mg.setpoint([0.0]),
        start=mg.Box([-radius], [radius]),
    )  # fmt: skip


def test_a_factory_of_modes_whose_controller_reads_a_constant_of_the_module() -> None:
    assert told([factory("a", 1.0), factory("b", 2.0)]) == []


@pytest.mark.parametrize(("body", "count"), [("k * (r - x)", 1), ("np.sin(r - x)", 0)])
def test_a_loop_at_the_top_level_of_a_module(body: str, count: int) -> None:
    source = f"made = []\nfor k in (1.0, 2.0):\n    made.append(lambda x, r: {body})"
    names: dict[str, Any] = {"np": np}
    exec(source, names)
    assert len(told(modes(names["made"]))) == count


def test_a_factory_called_twice_for_the_same_start() -> None:
    (text,) = told(modes([gain(1.0), gain(1.0)], start=mg.Box([0.0], [1.0])))
    assert "'m0', 'm1'" in text


def test_constraints_tell_modes_apart() -> None:
    first, second, _ = modes(late())
    assert told([first, second]) != []
    assert told([first, second.replace(constraints=lambda x: {"c": x[0] <= 9.0})]) == []


def test_an_input_that_nothing_reads_is_told_once_a_plant() -> None:
    plant = mg.System(lambda x, u: u[:1], states="x", inputs="push brake", name="cart")
    (text,) = told(modes([lambda x, r: np.concatenate([r - x, x]), lambda x, r: np.array([1.0, 2.0])], system=plant))
    assert "the plant 'cart' (mode 'm0') never read the input 'brake'" in text
    row = np.array([[1.0, 0.0]])
    whole = mg.System(lambda x, u: row @ u, states="x", inputs="push brake")
    assert told(modes([lambda x, r: np.concatenate([r - x, x])], system=whole)) == []


def test_build_warns() -> None:
    with pytest.warns(mg.ModegraphWarning, match="one and the same closed loop") as caught:
        mg.build(modes(late()), horizon=0.1)
    assert [w.filename for w in caught] == [__file__]
