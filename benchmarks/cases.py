"""The published systems as modegraph models."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import modegraph as mg


def autonomous(name: str, states: str, field: Callable[..., Any], start: mg.Box) -> mg.Mode:
    """x' = field(x)."""
    plant = mg.System(lambda x: field(*x), states=states, inputs="none")
    return mg.Mode(name, plant, controller=lambda x: 0.0, reference=mg.setpoint([0.0]), start=start)


def van_der_pol() -> mg.Mode:
    return autonomous(
        "VDP",
        "x y",
        lambda x, y: np.array([y, (1 - x**2) * y - x]),
        mg.Box([1.25, 2.35], [1.55, 2.45]),
    )


def laub_loomis(half_width: float = 0.01) -> mg.Mode:
    def field(x1: Any, x2: Any, x3: Any, x4: Any, x5: Any, x6: Any, x7: Any) -> Any:
        return np.array(
            [
                1.4 * x3 - 0.9 * x1,
                2.5 * x5 - 1.5 * x2,
                0.6 * x7 - 0.8 * x2 * x3,
                2 - 1.3 * x3 * x4,
                0.7 * x1 - x4 * x5,
                0.3 * x1 - 3.1 * x6,
                1.8 * x6 - 1.5 * x2 * x7,
            ]
        )

    centre = np.array([1.2, 1.05, 1.5, 2.4, 1.0, 0.1, 0.45])
    return autonomous("LALO", "x1 x2 x3 x4 x5 x6 x7", field, mg.Box(centre - half_width, centre + half_width))


def arm_0() -> mg.Mode:
    """Two-link arm, computed torque to a set-point, the torque written out as a user would."""
    a, b, d = 5 / 3, 1 / 2, 1 / 3

    def inertia(q: Any) -> Any:
        c = b * np.cos(q[1])
        return np.array([[a + 2 * c, d + c], [d + c, d]])

    def coriolis(q: Any, dq: Any) -> Any:
        s = b * np.sin(q[1])
        return np.array([[-s * dq[1], -s * (dq[0] + dq[1])], [s * dq[0], 0.0]])

    def dynamics(x: Any, u: Any) -> Any:
        q, dq = x[:2], x[2:]
        return np.concatenate([dq, np.linalg.solve(inertia(q), u - coriolis(q, dq) @ dq)])

    def controller(x: Any, r: Any) -> Any:
        q, dq = x[:2], x[2:]
        return inertia(q) @ (-6.0 * dq - 9.0 * (q - r)) + coriolis(q, dq) @ dq

    return mg.Mode(
        "ARM-0",
        mg.System(dynamics, states="q1 q2 dq1 dq2", inputs="u1 u2"),
        controller=controller,
        reference=mg.setpoint([0.8, 1.2]),
        start=mg.Box([-0.1] * 4, [0.1] * 4),
    )
