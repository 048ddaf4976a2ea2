"""Planar two-link arm: computed torque, PD, disturbed, saturated, along a bang-bang reference, to any set-point."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

import modegraph as mg
from benchmarks.case import Case, around

LENGTH, CENTRE, INERTIA = 1.0, 0.5, 1.0 / 12.0
DELTA = INERTIA + CENTRE**2
GOAL = (0.8, 1.2)


def mass_matrix(q: Any, m2: Any) -> Any:
    """For a first link of mass 1 and a second one of mass m2, both with the moment of a rod."""
    alpha = DELTA + m2 * (DELTA + LENGTH**2)
    c = m2 * LENGTH * CENTRE * np.cos(q[1])
    d = m2 * DELTA
    return np.array([[alpha + 2 * c, d + c], [d + c, d]])


def coriolis(q: Any, dq: Any, m2: Any) -> Any:
    s = m2 * LENGTH * CENTRE * np.sin(q[1])
    return np.array([[-s * dq[1], -s * (dq[0] + dq[1])], [s * dq[0], 0.0]])


def accelerations(x: Any, u: Any, m2: Any) -> Any:
    q, dq = x[:2], x[2:]
    return np.linalg.solve(mass_matrix(q, m2), u - coriolis(q, dq, m2) @ dq)


def plant(m2: float | tuple[float, float] = 1.0, disturbance: float = 0.0) -> mg.System:
    """The arm; a pair m2 is a mass that is only known to lie between the two."""
    names = {"states": "q1 q2 dq1 dq2", "inputs": "u1 u2"}
    if isinstance(m2, tuple):
        return mg.System(
            lambda x, u, d: np.concatenate([x[2:], accelerations(x, u, d["m2"])]), unknowns={"m2": m2}, **names
        )
    if disturbance:
        return mg.System(
            lambda x, u, w: np.concatenate([x[2:], accelerations(x, u, m2) + w]),
            disturbance=mg.Box([-disturbance] * 2, [disturbance] * 2),
            **names,
        )
    return mg.System(lambda x, u: np.concatenate([x[2:], accelerations(x, u, m2)]), **names)


def computed_torque(x: Any, r: Any) -> Any:
    """For the model with m2 = 1, the torque written out as a user would."""
    q, dq = x[:2], x[2:]
    wanted = r.ddot - 6.0 * (dq - r.dot) - 9.0 * (q - r)
    return mass_matrix(q, 1.0) @ wanted + coriolis(q, dq, 1.0) @ dq


def pd(x: Any, r: Any) -> Any:
    return -np.array([9.0, 1.5]) * (x[:2] - r) - np.array([6.0, 1.0]) * x[2:]


def clipped_pd(x: Any, r: Any) -> Any:
    limit = np.array([5.0, 1.2])
    return np.clip(pd(x, r), -limit, limit)


def arm(start: mg.Box, *, controller: Any = computed_torque, reference: Any = None, **options: Any) -> mg.Mode:
    reference = mg.setpoint(GOAL) if reference is None else reference
    return mg.Mode("arm", plant(**options), controller=controller, reference=reference, start=start)


def bang_bang(start: mg.Box) -> mg.Mode:
    return arm(start, reference=mg.minimum_time([0.0, 0.0], GOAL, speed=1.25, acceleration=5.0))


def start(angle: float) -> mg.Box:
    return around([0.0] * 4, (angle, angle, 0.1, 0.1))


SETPOINTS = mg.setpoint(mg.Box([0.6, 1.0], [1.0, 1.4]))
"""A class: every goal within .2 rad of GOAL."""

CASES = [
    Case("ARM-0", arm, start(0.1), 3.0),
    Case("ARM-11", partial(arm, m2=1.2), start(0.1), 3.0),
    Case("ARM-12", partial(arm, m2=(0.9, 1.1)), start(0.1), 3.0),
    Case("ARM-11, set-points +-0.2", partial(arm, m2=1.2, reference=SETPOINTS), start(0.1), 3.0),
    Case("ARM-12, set-points +-0.2", partial(arm, m2=(0.9, 1.1), reference=SETPOINTS), start(0.1), 3.0),
    *(Case(f"ARM-0, w +-{w:g}", partial(arm, disturbance=w), start(0.1), 3.0) for w in (0.01, 0.1)),
    Case("ARM-0, bang-bang", bang_bang, start(0.1), 3.0),
    *(Case(f"ARM PD +-{a:g}", partial(arm, controller=pd), start(a), 3.0) for a in (0.1, 0.2, 0.3, 0.5)),
    *(
        Case(f"ARM PD, w +-{w:g}", partial(arm, controller=pd, disturbance=w), start(0.1), 3.0)
        for w in (0.01, 0.1)
    ),
    *(Case(f"ARM PD clipped +-{a:g}", partial(arm, controller=clipped_pd), start(a), 3.0) for a in (0.02, 0.1)),
]  # fmt: skip
