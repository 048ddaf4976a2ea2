"""Point mass under two pole-placement controllers (Koo, Pappas and Sastry 2001, Example 2.2).

x1' = x2, x2' = u. Mode "slow" has a wide set of allowed starts, mode "fast" settles sooner, overshoots
more and therefore gets a smaller one: with M the overshoot constant of the closed loop,
|x(t) - (r, 0)| <= M |x(0) - (r, 0)| for all t >= 0, so the ball of radius min(-v_min, v_max) / M around
(r, 0) keeps the speed within [v_min, v_max].

    modegraph build examples/point_mass.py
    modegraph plan  examples/point_mass.py --task travel
"""

import numpy as np
from scipy.linalg import expm

import modegraph as mg

STATIONS = [[0.0], [0.6], [1.2], [1.8]]  # positions to hold, m

plant = mg.System(lambda x, u: np.array([x[1], u[0]]), states="position speed", inputs="force", name="point mass")


def pole_placement(poles):
    """Gains (k1, k2) of u = -k1 (x1 - r) - k2 x2 that put the closed-loop poles at ``poles``."""
    _, k2, k1 = np.real(np.poly(poles))
    return float(k1), float(k2)


def overshoot_constant(k1, k2, *, settle=8.0, samples=8000):
    """Upper bound of M = sup over t >= 0 of the 2-norm of exp(A t), A = [[0, 1], [-k1, -k2]].

    Between two samples the norm grows at most by exp(mu h), mu the logarithmic norm (the largest
    eigenvalue of the symmetric part of A). exp(A settle) is a contraction, so nothing later than
    ``settle`` exceeds what came before.
    """
    A = np.array([[0.0, 1.0], [-k1, -k2]])
    h = settle / samples
    mu = max(0.0, float(np.linalg.eigvalsh((A + A.T) / 2)[-1]))
    step, flow, worst = expm(A * h), np.eye(2), 1.0
    for _ in range(samples):
        flow = step @ flow
        worst = max(worst, float(np.linalg.norm(flow, 2)))
    if np.linalg.norm(flow, 2) >= 1.0:
        raise ValueError(f"the loop has not settled after {settle} s; give a larger `settle`")
    return worst * float(np.exp(mu * h))


def station_keeping(name, poles, v_min, v_max):
    """The mode that holds a station, with the widest ball of starts its overshoot allows."""
    k1, k2 = pole_placement(poles)
    delta = min(-v_min, v_max) / overshoot_constant(k1, k2)
    return mg.Mode(
        name,
        plant,
        controller=lambda x, r: -k1 * (x[:1] - r) - k2 * x[1:],
        reference=mg.setpoint(mg.Points(STATIONS)),
        output=lambda x: x[:1],
        start=lambda r: mg.Ball([r[0], 0.0], delta),
        constraints=lambda x: {"speed": abs(x[1] - (v_max + v_min) / 2) <= (v_max - v_min) / 2},
    )


slow = station_keeping("slow", [-1.5 + 1j, -1.5 - 1j], v_min=-1.0, v_max=1.2)  # M about 1.08
fast = station_keeping("fast", [-3.0 + 2j, -3.0 - 2j], v_min=-0.8, v_max=0.9)  # M about 1.65

modes = [slow, fast]
horizon = 10.0
tasks = {
    "settle": {"start": "slow", "goal": "fast", "r_start": [0.6], "r_goal": [0.6], "minimize": "time"},
    "travel": {"start": "slow", "goal": "fast", "r_start": [0.0], "r_goal": [1.8], "minimize": "time"},
}
