"""Certified pairs of continuous classes, held against independent runs: a disturbed pendulum, and the two-link arm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import modegraph as mg
from modegraph.certify.continuous import ContinuousReferences
from tests.soundness.examples import load

Vector = Any
PUSH = 0.05


@dataclass(frozen=True)
class Loop:
    """A mode of the graph written down again in plain numbers.

    ``rate(x, r, w)``; ``limits(x, r)`` are satisfied where all are <= 0; ``shape`` (n,) half-axes of its starts.
    """

    rate: Callable[[Vector, Vector, Vector], Vector]
    limits: Callable[[Vector, Vector], Vector]
    centre: Callable[[Vector], Vector]
    shape: Vector
    push: Vector


def pendulum() -> tuple[mg.ModeGraph, dict[str, Loop]]:
    plant = mg.System(
        lambda x, u, w: np.array([x[1], -np.sin(x[0]) + u[0] + w[0]]), states="angle rate", inputs="torque",
        disturbance=mg.Box([-PUSH], [PUSH]),
    )  # fmt: skip
    modes, loops = [], {}
    for name, kp, kd, size in (("wide", 4.0, 3.0, 0.4), ("narrow", 16.0, 7.0, 0.12)):

        def control(x: Any, r: Any, kp: float = kp, kd: float = kd) -> Any:
            return np.sin(r[0]) - kp * (x[0] - r[0]) - kd * x[1]

        modes.append(
            mg.Mode(
                name, plant, controller=lambda x, r, c=control: np.array([c(x, r)]),
                reference=mg.setpoint(mg.Box([-1.0], [1.0])),
                start=lambda r, size=size: mg.Ball([r[0], 0.0], size),
                constraints=lambda x, u: {"torque": abs(u[0]) <= 6.0},
            )
        )  # fmt: skip
        loops[name] = Loop(
            lambda x, r, w, c=control: np.array([x[1], -np.sin(x[0]) + c(x, r) + w[0]]),
            lambda x, r, c=control: np.array([abs(c(x, r)) - 6.0]),
            lambda r: np.array([r[0], 0.0]), np.full(2, size), np.array([PUSH]),
        )  # fmt: skip
    return mg.build(modes, horizon=8.0), loops


def arm() -> tuple[mg.ModeGraph, dict[str, Loop]]:
    """The shipped example: set-points over +-.5 rad."""
    model = load("arm_points")
    loops = {}
    for mode, shape in zip(model.modes, ((0.15, 0.15, 0.3, 0.3), (0.08, 0.08, 0.25, 0.25)), strict=True):

        def torque(x: Vector, r: Vector, controller: Any = mode.controller) -> Vector:
            return np.asarray(controller(x, r))

        loops[mode.name] = Loop(
            lambda x, r, w, u=torque: model.dynamics(x, u(x, r)),
            lambda x, r, u=torque: np.concatenate([np.abs(x[2:]) - 1.6, np.abs(u(x, r)) - [13.0, 3.5]]),
            lambda r: np.array([r[0], r[1], 0.0, 0.0]), np.array(shape), np.zeros(1),
        )  # fmt: skip
    return mg.build(model.modes, horizon=model.horizon), loops


def violations(graph: mg.ModeGraph, loops: dict[str, Loop], pairs: int, runs: int, seed: int) -> tuple[int, list[str]]:
    """Runs of certified pairs that are late, or break a limit before they arrive."""
    rng = np.random.default_rng(seed)
    found: list[str] = []
    count = 0
    for switch in graph.switches:
        assert isinstance(switch.references, ContinuousReferences)
        source, target = loops[switch.source], loops[switch.target]
        for r_i, r_j in switch.references.sample(pairs, seed=seed):
            time = graph.verdict(switch.source, switch.target, r_i, r_j).time
            assert time is not None
            for _ in range(runs):
                way = rng.normal(size=len(source.shape))
                x0 = source.centre(r_i) + source.shape * way / np.linalg.norm(way)
                w = source.push * rng.choice([-1.0, 1.0], size=len(source.push))
                flip = rng.uniform(0.2, 2.0)

                def rate(t: float, x: Vector, r: Vector = r_i, w: Vector = w, flip: float = flip) -> Vector:
                    return source.rate(x, r, w if int(t / flip) % 2 == 0 else -w)  # noqa: B023

                end = max(time[1], 1e-9)
                done = solve_ivp(rate, (0.0, end), x0, method="DOP853", rtol=1e-9, atol=1e-11, max_step=0.05)
                gauge = np.sqrt((((done.y.T - target.centre(r_j)) / target.shape) ** 2).sum(axis=1))
                count += 1
                if gauge[-1] > 1.0 + 1e-7 and gauge.min() > 1.0 + 1e-7:
                    found.append(f"{switch.source} {r_i} -> {switch.target} {r_j}: late, {gauge.min():.6f}")
                until = int(np.argmax(gauge <= 1.0)) if (gauge <= 1.0).any() else len(gauge)
                for x in done.y.T[: until + 1]:
                    if source.limits(x, r_i).max() > 1e-7:
                        found.append(f"{switch.source} {r_i}: limit broken by {source.limits(x, r_i).max():.3g}")
                        break
    return count, found


def test_pendulum_quick() -> None:
    count, found = violations(*pendulum(), pairs=12, runs=2, seed=1)
    assert count >= 72
    assert not found, found[:3]


@pytest.mark.campaign
@pytest.mark.parametrize("make", [pendulum, arm])
def test_campaign(make: Any, record_property: Any) -> None:
    """1,000 random pairs of every certified R^ij, each with a random start."""
    count, found = violations(*make(), pairs=1000, runs=1, seed=5)
    record_property("campaign", f"classes, {make.__name__}: {count} runs of certified pairs, {len(found)} violations")
    assert not found, found[:3]
