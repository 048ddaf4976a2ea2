"""Two-link arm that may be held anywhere: set-points over a box of +-.5 rad, and a planner that chooses them.

The arm is that of two_link_arm.py without disturbance. ``reach`` cancels the arm's own dynamics and may start up to
.15 rad from its set-point, ``hold`` is a stiff PD controller for starts within .08 rad. From one posture to another
farther away the planner walks by set-points, each step certified.

    modegraph build    examples/arm_points.py
    modegraph plan     examples/arm_points.py --from reach --to hold --r-start 0.1,0.8 --r-goal 0.9,1.6 --minimize time
"""

import numpy as np

import modegraph as mg

MASS, LENGTH, CENTRE, INERTIA = 1.0, 1.0, 0.5, 1.0 / 12.0  # both links: kg, m, m, kg m^2
ALPHA = 2 * INERTIA + MASS * CENTRE**2 + MASS * (LENGTH**2 + CENTRE**2)
BETA = MASS * LENGTH * CENTRE
DELTA = INERTIA + MASS * CENTRE**2

POSTURES = mg.Box([0.0, 0.7], [1.0, 1.7])  # joint angles, rad


def inertia(q):
    """Joint-space inertia matrix M(q), kg m^2."""
    c = BETA * np.cos(q[1])
    return np.array([[ALPHA + 2 * c, DELTA + c], [DELTA + c, DELTA]])


def coriolis(q, dq):
    """Matrix C(q, q') of the Coriolis and centrifugal torques C q'."""
    s = BETA * np.sin(q[1])
    return np.array([[-s * dq[1], -s * (dq[0] + dq[1])], [s * dq[0], 0.0]])


def dynamics(x, u):
    q, dq = x[:2], x[2:]
    return np.concatenate([dq, np.linalg.solve(inertia(q), u - coriolis(q, dq) @ dq)])


def limits(x, u):
    return {
        "joint rate": abs(x[2:]) <= 1.6,  # rad/s
        "shoulder torque": abs(u[0]) <= 13.0,  # N m
        "elbow torque": abs(u[1]) <= 3.5,
    }


def computed_torque(x, r):
    """Error dynamics e'' + 4 e' + 4 e = 0."""
    q, dq = x[:2], x[2:]
    return inertia(q) @ (-4.0 * dq - 4.0 * (q - r)) + coriolis(q, dq) @ dq


def stiff(x, r):
    return -np.array([40.0, 10.0]) * (x[:2] - r) - np.array([18.0, 4.5]) * x[2:]


arm = mg.System(
    dynamics,
    states="shoulder elbow shoulder_rate elbow_rate",
    inputs="shoulder_torque elbow_torque",
    name="two-link arm",
)


def mode(name, controller, angle, rate):
    """Held at any posture, from the ellipsoid of half-axes ``angle`` (rad), ``rate`` (rad/s) around rest there."""
    shape = np.diag([angle**2, angle**2, rate**2, rate**2])
    return mg.Mode(
        name,
        arm,
        controller=controller,
        reference=mg.setpoint(POSTURES),
        output=lambda x: x[:2],
        start=lambda r: mg.Ellipsoid([r[0], r[1], 0.0, 0.0], shape),
        constraints=limits,
    )


modes = [mode("reach", computed_torque, 0.15, 0.3), mode("hold", stiff, 0.08, 0.25)]
horizon = 6.0
tasks = {"across": {"start": "reach", "goal": "hold", "r_start": [0.1, 0.8], "r_goal": [0.9, 1.6], "minimize": "time"}}
