"""Graphs with continuous classes whose R^ij are known."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import modegraph as mg
from modegraph.certify.class_unit import relate
from modegraph.certify.question import TargetSpec
from modegraph.certify.relation import Relation
from modegraph.deadline import Deadline


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


def discs() -> Relation:
    """From discs of .4 into discs of .2, around set-points in a square, by x' = r - x."""
    square = mg.Box([-1.0, -1.0], [1.0, 1.0])
    modes = [one_integrator(lambda r: r, lambda r, a=a: mg.Ball(r, a), square, f"m{a}") for a in (0.4, 0.2)]
    spec = TargetSpec(modes[1].name, None, modes[1])
    found = relate(modes[0], None, [spec], horizon=6.0, deadline=Deadline(60.0), progress=lambda text: None)
    (made,) = found.relations
    assert isinstance(made, Relation)
    return made
