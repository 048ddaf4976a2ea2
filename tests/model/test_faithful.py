"""Traps: models whose proof would be about something else than what was written. Each has an honest twin."""

from __future__ import annotations

import time
from itertools import count
from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.model.faithful import require_faithful

BOX = mg.Box([0.5, 0.5], [1.0, 1.0])
SMALL = mg.Box([-0.1], [0.1])


def dynamics(x: Any, u: Any) -> Any:
    return np.array([x[1], u[0]])


def controller(x: Any, r: Any) -> Any:
    return r - x[:1] - 2 * x[1:]


def mode(**changes: Any) -> mg.Mode:
    system = mg.System(changes.pop("dynamics", dynamics), states="a b", inputs="u", **changes.pop("system", {}))
    given = {"controller": controller, "reference": mg.setpoint([0.0]), "start": BOX, **changes}
    return mg.Mode("m", system, **given)


RNG = np.random.default_rng(2)
CALLS = count(1)


def remembering(x: Any, r: Any, kept: list[Any] = []) -> Any:  # noqa: B006
    kept.append(x[0])
    return -kept[0] - x[1]


def by_type(x: Any, r: Any) -> Any:
    return -x[0] if x.dtype == object else -2.0 * x[0]


IMPURE = {
    "controller": [
        lambda x, r: controller(x, r) + np.random.randn(),  # noqa: NPY002
        lambda x, r: controller(x, r) + time.perf_counter(),
        lambda x, r: controller(x, r) * next(CALLS),
        remembering,
        by_type,
    ],
    "dynamics": [
        lambda x, u: np.array([x[1], u[0] + 1e-9 * RNG.random()]),
        lambda x, u: np.array([x[1], u[0] + (0.1 if isinstance(x[0], float) else 0.0)]),
    ],
    "constraints": [
        lambda x: {"c": x[0] <= 2 + RNG.random()},
        lambda x: {f"c{next(CALLS)}": x[0] <= 2},
        lambda x: {"c": x[0] <= (0.0 if isinstance(x[0], float) else 2.0)},
    ],
    "output": [
        lambda x: x[:1] + RNG.random(),
        lambda x: x[:1] + isinstance(x[0], float),
    ],
    "start": [
        lambda r: mg.Ball([0.0, 0.0], 1.0 + RNG.random()),
    ],
}


@pytest.mark.parametrize(("role", "k"), [(role, k) for role, found in IMPURE.items() for k in range(len(found))])
def test_a_function_that_does_not_depend_on_its_arguments_alone(role: str, k: int) -> None:
    with pytest.raises(mg.ModegraphError, match=rf"mode 'm', {role} does not depend on its arguments alone.*random"):
        require_faithful(mode(**{role: IMPURE[role][k]}))


def memory(change: Any = 0.0, entry: Any = 0.0) -> mg.Memory:
    value = lambda what: what() if callable(what) else what
    return mg.Memory("z", lambda x, r, z: x[:1] - r - z + value(change), lambda x: 0 * x[:1] + value(entry))


@pytest.mark.parametrize(("part", "role"), [("change", "memory dynamics"), ("entry", "memory reset")])
def test_a_memory_is_held_against_its_functions(part: str, role: str) -> None:
    require_faithful(mode(memory=memory(**{part: 0.5}), controller=lambda x, z: -x[:1] - z))
    with pytest.raises(mg.ModegraphError, match=f"mode 'm', {role} does not depend on its arguments alone"):
        require_faithful(mode(memory=memory(**{part: RNG.random}), controller=lambda x, z: -x[:1] - z))


@pytest.mark.parametrize(
    "signal",
    [lambda t: np.array([np.sin(t) + RNG.random()]), lambda t: np.array([np.sin(t) + isinstance(t, float)])],
)
def test_a_signal_is_held_against_its_function(signal: Any) -> None:
    with pytest.raises(mg.ModegraphError, match=r"mode 'm'.*signal does not depend on its arguments alone"):
        require_faithful(mode(reference=mg.trajectory(signal, 2.0)))


@pytest.mark.parametrize(
    "start",
    [
        lambda r: mg.Ball([r[0], 0.0], 1.0 + RNG.random()),
        lambda r: mg.Ball([r[0], 0.0], 1.5 if isinstance(r[0], float) else 1.0),
        lambda r: mg.Ball([0.0, 0.0], 1.0 + RNG.random()),
    ],
)
def test_starts_of_a_continuous_class_are_held_against_their_function(start: Any) -> None:
    points = mg.setpoint(mg.Box([-1.0], [1.0]))
    mg.build([mode(reference=points, start=lambda r: mg.Ball([r[0], 0.0], 1.0))], horizon=0.1)
    with pytest.raises(mg.ModegraphError, match=r"mode 'm.*start does not depend on its arguments alone"):
        mg.build([mode(reference=points, start=start)], horizon=0.1)


def test_a_sublevel_start_is_traced_twice() -> None:
    with pytest.raises(mg.ModegraphError, match=r"Sublevel, fn.* does not depend on its arguments alone"):
        require_faithful(mode(start=mg.Sublevel(lambda x: x @ x + 0.1 * RNG.random(), 1.0)))
    require_faithful(mode(start=lambda r: mg.Sublevel(lambda x: x @ x, 1.0)))
    with pytest.raises(mg.ModegraphError, match=r"Sublevel, fn does not depend on its arguments alone: at x = "):
        require_faithful(mode(start=mg.Sublevel(lambda x: x @ x * (2.0 if isinstance(x[0], float) else 1.0), 1.0)))


def clipped(x: Any, r: Any) -> Any:
    return np.clip(controller(x, r), -0.6, 0.6)


def domain(x: Any, r: Any) -> Any:
    return -np.sqrt(x[0] - 0.45) - np.log(x[1] - 0.2) - 1 / (x[0] - 0.49)


def moving(x: Any, r: Any) -> Any:
    return r.ddot + 2 * (r.dot - x[1:]) + (r - x[:1])


def failing(x: Any, r: Any) -> Any:
    return -np.sqrt(x[0]) if not isinstance(x[0], float) or x[0] > 0.7 else [][0]


@pytest.mark.parametrize(
    "changes",
    [
        {"controller": clipped},
        {"controller": domain},
        {"controller": failing},
        {"controller": lambda x, r: -np.arctan2(x[1], x[0])},
        {"controller": lambda x, r, t: np.where(t < 1.0, -x[0], -x[1])},
        {"controller": lambda x, r: -np.sign(x[1]), "start": mg.Box([0.5, 0.0], [1.0, 0.0])},
        {"controller": moving, "reference": mg.quintic([0.0], [1.0], 2.0)},
        {"controller": moving, "reference": mg.trajectory(lambda t, p: p * np.sin(t), 2.0, over=mg.Box([0.1], [1.0]))},
        {"controller": moving, "reference": mg.minimum_time([0.0], [1.0], speed=1.0, acceleration=2.0)},
        {"constraints": lambda x, u: {"a": abs(x) <= 9.0, "u": [u[0] <= 9, np.maximum(u[0], x[0]) >= -9]}},
        {"constraints": lambda x: {"edge": x[0] <= x[0]}},
        {"output": lambda x: x[0]},
    ],
    ids=lambda v: next(iter(v)),
)  # fmt: skip
def test_honest_models_pass(changes: dict[str, Any]) -> None:
    require_faithful(mode(**changes))


def uncertain(**changes: Any) -> dict[str, Any]:
    return {"system": {"disturbance": SMALL, "unknowns": {"m": (0.9, 1.1)}}, **changes}


def whole(x: Any, u: Any, w: Any, d: Any) -> Any:
    return np.array([x[1], u[0] / d["m"] + w[0]])


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (lambda x, u: np.array([x[1], u[0]]), "read the disturbance w, .*Name w among .* add 0 \\* w\\[0\\]"),
        (lambda x, u, w, d: np.array([x[1], u[0] / d["m"]]), "read the disturbance w, .*leave it out of disturbance="),
        (lambda x, u, w: np.array([x[1], u[0] + w[0]]), "the unknown constant d\\['m'\\], .*leave it out of unknowns="),
    ],
)
def test_what_is_uncertain_must_be_read(changed: Any, message: str) -> None:
    require_faithful(mode(dynamics=whole, **uncertain()))
    with pytest.raises(mg.ModegraphError, match=f"mode 'm': neither the dynamics of the plant nor .*{message}"):
        require_faithful(mode(dynamics=changed, **uncertain()))


def test_every_door_looks() -> None:
    forgetful = mode(**uncertain())
    doors = (
        lambda: mg.build([forgetful], horizon=0.1),
        lambda: mg.flowpipe(forgetful, horizon=0.1),
        lambda: mg.largest_start(forgetful, mg.Ball([0.0, 0.0], 1.0)),
    )
    for door in doors:
        with pytest.raises(mg.ModegraphError, match="the disturbance w,"):
            door()


def test_one_component_and_the_array_as_a_whole() -> None:
    two = {"disturbance": mg.Box([-1.0, -1.0], [1.0, 1.0])}
    one_read = lambda x, u, w: np.array([x[1], u[0] + w[0]])
    with pytest.raises(mg.ModegraphError, match=r"read the disturbance w\[1\], .* add 0 \* w\[1\]"):
        require_faithful(mode(dynamics=one_read, system=two))
    matrix = np.array([[0.0, 0.0], [1.0, 0.0]])
    require_faithful(mode(dynamics=lambda x, u, w: np.array([x[1], u[0]]) + matrix @ w, system=two))
    require_faithful(mode(dynamics=lambda x, u, w: one_read(x, u, w) + 0 * w[1], system=two))


def test_constraints_may_be_the_only_reader() -> None:
    read = lambda x, w, d: {"c": x[0] + w[0] <= 9 * d["m"]}
    require_faithful(mode(**uncertain(constraints=read)))
    touched = lambda x, w, d: {"c": x[0] + 0 * w[0] <= 9 + 0 * d["m"]}
    require_faithful(mode(**uncertain(constraints=touched)))
