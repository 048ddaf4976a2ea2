"""Quadrotor with twelve states, and a spacecraft on its way to another one."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

import modegraph as mg
from benchmarks.case import Case, around, autonomous

GRAVITY, MASS, JX, JY, JZ = 9.81, 1.4, 0.054, 0.054, 0.104
MU, RADIUS, CHASER = 3.986e14 * 60**2, 42164e3, 500.0
"""m^3 / min^2, m, kg."""
APPROACH = ((-28.8287, 0.1005, -1449.9754, 0.0046), (-0.087, -33.2562, 0.00462, -1451.5013))
"""LQR gains of the benchmark while the chaser is more than 100 m away."""


def rates(x: Any, u: Any) -> Any:
    """Position north, east and up; velocity in the body's frame; roll, pitch, yaw; body rates."""
    vx, vy, vz, roll, pitch, yaw, p, q, r = x[3:]
    sr, cr, sp, cp = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    sy, cy, tp = np.sin(yaw), np.cos(yaw), np.tan(pitch)
    return np.array(
        [
            cp * cy * vx + (sr * sp * cy - cr * sy) * vy + (cr * sp * cy + sr * sy) * vz,
            cp * sy * vx + (sr * sp * sy + cr * cy) * vy + (cr * sp * sy - sr * cy) * vz,
            sp * vx - sr * cp * vy - cr * cp * vz,
            r * vy - q * vz - GRAVITY * sp,
            p * vz - r * vx + GRAVITY * cp * sr,
            q * vx - p * vy + GRAVITY * cp * cr - u[0] / MASS,
            p + sr * tp * q + cr * tp * r,
            cr * q - sr * r,
            (sr * q + cr * r) / cp,
            ((JY - JZ) * q * r + u[1]) / JX,
            ((JZ - JX) * p * r + u[2]) / JY,
            ((JX - JY) * p * q + u[3]) / JZ,
        ]
    )


def hover(x: Any) -> Any:
    """Height 1, level; the yaw is left to itself."""
    return np.array([MASS * GRAVITY - 10.0 * (x[2] - 1.0) + 3.0 * x[5], -x[6] - x[9], -x[7] - x[10], 0.0])


def quadrotor(start: mg.Box, *, disturbance: float = 0.0) -> mg.Mode:
    names: dict[str, Any] = {"states": [f"x{k}" for k in range(1, 13)], "inputs": 4}
    if disturbance:

        def pushed(x: Any, u: Any, w: Any) -> Any:
            return rates(x, u) + np.array([0.0] * 3 + [w[0], w[1], w[2]] + [0.0] * 6)

        plant = mg.System(pushed, disturbance=mg.Box([-disturbance] * 3, [disturbance] * 3), **names)
    else:
        plant = mg.System(rates, **names)
    return mg.Mode("quadrotor", plant, controller=hover, reference=mg.setpoint([0.0]), start=start)


def rendezvous(start: mg.Box) -> mg.Mode:
    """The approach alone, without the modes that follow."""

    def field(x: Any) -> Any:
        east, north, ve, vn = x
        rate = np.sqrt(MU / RADIUS**3)
        pull = MU / np.sqrt((RADIUS + east) ** 2 + north**2) ** 3
        u = np.array(APPROACH) @ x
        return np.array(
            [
                ve,
                vn,
                rate**2 * east + 2 * rate * vn + MU / RADIUS**2 - pull * (RADIUS + east) + u[0] / CHASER,
                rate**2 * north - 2 * rate * ve - pull * north + u[1] / CHASER,
            ]
        )

    return autonomous("approach", field, "x y vx vy", start)


def start(position: float, attitude: float = 0.0) -> mg.Box:
    return around([0.0] * 12, [position] * 6 + [attitude] * 6)


CASES = [
    *(Case(f"QUAD20 +-{a:g}", quadrotor, start(a), 5.0) for a in (0.1, 0.4, 0.8)),
    Case("QUAD-A", quadrotor, start(0.4, 0.1), 5.0),
    *(Case(f"QUAD20 +-.1, w +-{w:g}", partial(quadrotor, disturbance=w), start(0.1), 5.0) for w in (0.01, 0.1)),
    Case("SPRE22 approach", rendezvous, mg.Box([-925, -425, 0, 0], [-875, -375, 5, 5]), 100.0),
]
