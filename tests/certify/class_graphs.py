"""Graphs with continuous classes whose R^ij are known."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import modegraph as mg


def double_integrators(dim: int) -> list[mg.Mode]:
    """x'' = u in ``dim`` directions: a slow loop with wide starts and a quick one with narrow ones, set-points in
    [-1, 1]^dim. The undisturbed loops converge: R^ij tends to {|r_i - r_j| <= radius of S_j}."""
    plant = mg.System(lambda x, u: np.concatenate([x[dim:], u]), states=2 * dim, inputs=dim)

    def mode(name: str, kp: float, kd: float, radius: float) -> mg.Mode:
        return mg.Mode(
            name,
            plant,
            controller=lambda x, r: -kp * (x[:dim] - r) - kd * x[dim:],
            reference=mg.setpoint(mg.Box([-1.0] * dim, [1.0] * dim)),
            start=lambda r: mg.Ball(np.concatenate([r, np.zeros(dim)]), radius),
        )

    return [mode("wide", 1.0, 2.0, 0.5), mode("narrow", 9.0, 6.0, 0.1)]


def one_integrator(
    centre: Callable[[Any], Any], start: Callable[[Any], mg.Set], region: mg.Box, name: str, rate: float = 1.0
) -> mg.Mode:
    """x' = -rate (x - c(r)) in the plane."""
    plant = mg.System(lambda x, u: u, states="a b", inputs="ua ub")
    return mg.Mode(
        name, plant, controller=lambda x, r: -rate * (x - centre(r)), reference=mg.setpoint(region), start=start
    )
