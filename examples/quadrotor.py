"""Planar quadrotor in wind: hover, climb, cruise and land, each at any place; the planner chooses the places.

The vehicle is the AscTec Hummingbird seen from the side. Every mode has a whole class of references: a hover at any
point, a climb from any point to any height, a cruise along any level line, a descent at any place. Wind pushes in any
way within its limits. The task is to get from a hover at one point to the ground at another.

    modegraph build    examples/quadrotor.py
    modegraph plan     examples/quadrotor.py --from hover --to touchdown --r-start=-4,2 --r-goal=3 --minimize time
    modegraph simulate examples/quadrotor.py --task deliver --start=-3.8,2.1,0,0.2,0,0
"""

import numpy as np

import modegraph as mg

MASS, ARM, INERTIA = 0.5, 0.17, 2.32e-3  # kg, m, kg m^2
GRAVITY = 9.81
WIND = 0.25  # N across and as much up and down: 0.5 m/s^2


def dynamics(x, u, w):
    """Rigid body in the vertical plane; pitch is positive towards +x, u are the thrusts of rear and front rotors."""
    pitch, thrust = x[2], u[0] + u[1]
    force = np.array([thrust * np.sin(pitch), thrust * np.cos(pitch) - MASS * GRAVITY]) + w
    return np.array([x[3], x[4], x[5], force[0] / MASS, force[1] / MASS, ARM * (u[0] - u[1]) / INERTIA])


quadrotor = mg.System(
    dynamics,
    states="x z pitch x_rate z_rate pitch_rate",
    inputs="rear_thrust front_thrust",
    disturbance=mg.Box([-WIND, -WIND], [WIND, WIND]),  # N, any measurable signal
    name="planar quadrotor",
)

POSITION, RATE = np.array([3.8, 6.0]), np.array([3.15, 5.0])  # gains across and up: 1/s^2, 1/s
PITCH, PITCH_RATE = 150.0, 19.8  # gains of the attitude: 1/s^2, 1/s
SINK = 0.25  # m/s


def rotors(x, ax, az):
    """Thrusts that accelerate by az upward and turn towards the pitch that accelerates by ax."""
    thrust = MASS * (GRAVITY + az) / np.cos(x[2])
    torque = INERTIA * (PITCH * (ax / GRAVITY - x[2]) - PITCH_RATE * x[5])
    return np.array([thrust + torque / ARM, thrust - torque / ARM]) / 2


def follow(x, r):
    """Position control about r = (x, z), which may move."""
    ax, az = r.ddot + RATE * (r.dot - x[3:5]) + POSITION * (r - x[:2])
    return rotors(x, ax, az)


def settle(x, r):
    """Hold the place r = (x,) and sink slowly until the legs touch."""
    return rotors(x, POSITION[0] * (r[0] - x[0]) - RATE[0] * x[3], RATE[1] * (-SINK - x[4]))


def in_flight(x, u):
    return {
        "pitch": abs(x[2]) <= 0.7,  # rad
        "speed": abs(x[3:5]) <= 3.5,  # m/s
        "thrust": abs(u - 3.0) <= 2.95,  # N a rotor
        "ground": x[1] >= 0.0,  # m
    }


def near_ground(x, u):
    return {
        "pitch": abs(x[2]) <= 0.7,
        "speed": abs(x[3:5]) <= [2.0, 0.8],
        "thrust": abs(u - 3.0) <= 2.95,
    }


def around(size):
    """Starts at rest around r: within ``size`` in position (m), pitch (rad) and their rates."""
    size = np.array(size)

    def start(r):
        centre = np.array([r[0], r[1], 0.0, 0.0, 0.0, 0.0])
        return mg.Box(centre - size, centre + size)

    return start


def smooth(t, duration):
    """From 0 to 1, at rest with no acceleration at both ends."""
    s = t / duration
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


CRUISE, CLIMB, LAND = 6.0, 5.0, 4.0  # s
FLARE = 0.15  # m above the ground, where a descent ends


def level(t, p):
    """From x = p[0] by p[2], at the height p[1]."""
    return np.array([p[0] + p[2] * smooth(t, CRUISE), p[1]])


def vertical(t, p):
    """At x = p[0] from the height p[1] to p[2]."""
    return np.array([p[0], p[1] + (p[2] - p[1]) * smooth(t, CLIMB)])


def descent(t, p):
    """At x = p[0] from the height p[1] to the flare."""
    return np.array([p[0], p[1] + (FLARE - p[1]) * smooth(t, LAND)])


def on_the_ground():
    """A x <= b: the legs have touched, the vehicle is level and slow."""
    rows = np.eye(6)
    A = np.vstack([rows[1], rows[2], -rows[2], rows[3], -rows[3], -rows[4]])
    return A, np.array([0.0, 0.2, 0.2, 0.6, 0.6, 0.4])


WIDE = [0.5, 0.3, 0.2, 0.7, 0.4, 0.8]
CALM = [0.3, 0.15, 0.18, 0.55, 0.22, 0.7]
LOW = [0.28, 0.11, 0.16, 0.55, 0.17, 0.65]

modes = [
    mg.Mode(
        "hover",
        quadrotor,
        controller=follow,
        reference=mg.setpoint(mg.Box([-6.0, 1.0], [6.0, 6.0])),
        start=around(WIDE),
        constraints=in_flight,
        horizon=3.0,
    ),
    mg.Mode(
        "climb",
        quadrotor,
        controller=follow,
        reference=mg.trajectory(vertical, CLIMB, over=mg.Box([-6.0, 1.0, 1.0], [6.0, 6.0, 6.0])),
        start=around(CALM),
        constraints=in_flight,
        horizon=6.5,
    ),
    mg.Mode(
        "cruise",
        quadrotor,
        controller=follow,
        reference=mg.trajectory(level, CRUISE, over=mg.Box([-6.0, 1.0, -7.0], [6.0, 6.0, 7.0])),
        start=around(CALM),
        constraints=in_flight,
        horizon=7.5,
    ),
    mg.Mode(
        "land",
        quadrotor,
        controller=follow,
        reference=mg.trajectory(descent, LAND, over=mg.Box([-6.0, 1.0], [6.0, 2.5])),
        start=around(CALM),
        constraints=in_flight,
        horizon=6.0,
    ),
    mg.Mode(
        "touchdown",
        quadrotor,
        controller=settle,
        reference=mg.setpoint(mg.Box([-6.0], [6.0])),
        start=lambda r: around(LOW)([r[0], FLARE]),
        constraints=near_ground,
        horizon=2.5,
    ),
    mg.Target("landed", mg.Polytope(*on_the_ground())),
]
horizon = 5.0
tasks = {
    "deliver": {"start": "hover", "goal": "touchdown", "r_start": [-4.0, 5.0], "r_goal": [3.0], "minimize": "time"},
    "give up": {"start": "hover", "goal": "landed", "r_start": [-4.0, 2.0], "minimize": "time"},
}
