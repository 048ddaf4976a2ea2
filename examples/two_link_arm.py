"""Two-link arm on a horizontal table, eight controllers (Koo, Pappas and Sastry 2001, section 5).

q1, q2, q3 hold the arm at A, each stiffer than the one before and with a smaller set of allowed starts;
q4 (gentle) and q5 (quick) carry it from A to B by computed torque; q6, q7, q8 hold it at B. The actuators
are disturbed. The task is to get from a wide set of starts in q1 to a small error in q8.

    modegraph build    examples/two_link_arm.py
    modegraph plan     examples/two_link_arm.py --from q1 --to q8 --minimize time
    modegraph explain  examples/two_link_arm.py q5 q8
    modegraph simulate examples/two_link_arm.py --from q1 --to q8 --start 0.1,1.5,0,0
"""

import numpy as np

import modegraph as mg

MASS, LENGTH, CENTRE, INERTIA = 1.0, 1.0, 0.5, 1.0 / 12.0  # both links: kg, m, m, kg m^2
ALPHA = 2 * INERTIA + MASS * CENTRE**2 + MASS * (LENGTH**2 + CENTRE**2)
BETA = MASS * LENGTH * CENTRE
DELTA = INERTIA + MASS * CENTRE**2

A = np.array([0.0, 1.6])  # joint angles, rad
B = np.array([1.0, 0.8])


def inertia(q):
    """Joint-space inertia matrix M(q), kg m^2."""
    c = BETA * np.cos(q[1])
    return np.array([[ALPHA + 2 * c, DELTA + c], [DELTA + c, DELTA]])


def coriolis(q, dq):
    """Matrix C(q, q') of the Coriolis and centrifugal torques C q' (Murray, Li and Sastry 1994)."""
    s = BETA * np.sin(q[1])
    return np.array([[-s * dq[1], -s * (dq[0] + dq[1])], [s * dq[0], 0.0]])


def dynamics(x, u, w):
    q, dq = x[:2], x[2:]
    ddq = np.linalg.solve(inertia(q), u + w - coriolis(q, dq) @ dq)
    return np.concatenate([dq, ddq])


def limits(x, u):
    return {
        "joint rate": abs(x[2:]) <= 1.6,  # rad/s
        "shoulder torque": abs(u[0]) <= 13.0,  # N m
        "elbow torque": abs(u[1]) <= 3.5,
    }


arm = mg.System(
    dynamics,
    states="shoulder elbow shoulder_rate elbow_rate",
    inputs="shoulder_torque elbow_torque",
    disturbance=mg.Box([-0.2, -0.05], [0.2, 0.05]),  # N m, any measurable signal
    name="two-link arm",
)


def pd(Kp, Kv):
    """Joint-space proportional-derivative control about a set-point."""
    return lambda x, r: -np.diag(Kp) @ (x[:2] - r) - np.diag(Kv) @ x[2:]


def computed_torque(kp, kv):
    """Cancel the arm's own dynamics and track r with error dynamics e'' + kv e' + kp e = 0."""

    def controller(x, r):
        q, dq = x[:2], x[2:]
        acceleration = r.ddot - kv * (dq - r.dot) - kp * (q - r)
        return inertia(q) @ acceleration + coriolis(q, dq) @ dq

    return controller


def mode(name, controller, reference, angle, rate):
    """A mode with starts in the ellipsoid of half-axes ``angle`` (rad), ``rate`` (rad/s) around rest at r."""
    shape = np.diag([angle**2, angle**2, rate**2, rate**2])
    return mg.Mode(
        name,
        arm,
        controller=controller,
        reference=reference,
        output=lambda x: x[:2],
        start=lambda r: mg.Ellipsoid([r[0], r[1], 0.0, 0.0], shape),
        constraints=limits,
    )


wide = pd((12, 3), (10, 2.5))
medium = pd((40, 10), (18, 4.5))
tight = pd((160, 40), (36, 9))

modes = [
    mode("q1", wide, mg.setpoint(A), 0.30, 0.60),
    mode("q2", medium, mg.setpoint(A), 0.08, 0.25),
    mode("q3", tight, mg.setpoint(A), 0.018, 0.12),
    mode("q4", computed_torque(16, 8), mg.minimum_energy(A, B, duration=6.0), 0.05, 0.20),
    mode("q5", computed_torque(4, 4), mg.minimum_time(A, B, speed=1.25, acceleration=5.0), 0.005, 0.05),
    mode("q6", wide, mg.setpoint(B), 0.30, 0.60),
    mode("q7", medium, mg.setpoint(B), 0.08, 0.25),
    mode("q8", tight, mg.setpoint(B), 0.018, 0.12),
]
horizon = 10.0
tasks = {
    "fastest": {"start": "q1", "goal": "q8", "minimize": "time"},
    "frugal": {"start": "q1", "goal": "q8", "minimize": "energy"},
    "simplest": {"start": "q1", "goal": "q8", "minimize": "switches"},
}
