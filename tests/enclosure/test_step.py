"""One validated step against exact matrix exponentials, and against a good integrator."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from flint import arb, arb_mat, ctx
from scipy.integrate import solve_ivp

import modegraph as mg
from modegraph.reach.compiled import compile_mode
from modegraph.reach.flow.flow import Flow, Order

MATRICES = {
    "stable": [[-1.0, 0.5], [-2.0, -3.0]],
    "oscillator": [[0.0, 1.0], [-4.0, 0.0]],
    "defective": [[0.0, 1.0], [0.0, 0.0]],
    "unstable": [[1.5, 2.0], [0.0, 0.7]],
}
B = np.array([[0.5, 0.0], [1.0, -0.25]])


def one_step(dynamics: Any, start: mg.Box, order: Order, h: float, w: float = 0.0) -> Flow:
    box = mg.Box([-w, -w], [w, w]) if w else None
    plant = mg.System(dynamics, states=start.dim, inputs=1, disturbance=box)
    mode = mg.Mode("m", plant, controller=lambda x: 0.0 * x[0], reference=mg.setpoint([0.0]), start=start)
    c = compile_mode(mode, None)
    flow = Flow(c.fields, c.whole(), c.w_centre, c.w_radius, order, names=c.loop.names)
    flow.h = h
    assert flow.advance(1.0)
    return flow


def holds(flow: Flow, xi: np.ndarray, x: np.ndarray, tolerance: float = 0.0) -> None:
    """x, reached from the start xi, is in p(xi) + sum_g G_g(xi) zeta_g and the tube ends around it."""
    step = flow.steps[-1]
    powers = np.prod(xi**flow.table.exponents, axis=1)
    rest = x - step.p @ powers
    G = step.G @ powers[: step.G.shape[2]]
    rng = np.random.default_rng(1)
    for d in [*np.eye(len(x)), *rng.normal(size=(30, len(x)))]:
        assert abs(d @ rest) <= np.abs(G @ d).sum() * (1 + 1e-9) + tolerance + 1e-16 * np.abs(d) @ np.abs(x)
    lo, hi = flow.tubes()
    assert (lo[-1] - tolerance <= x).all()
    assert (x <= hi[-1] + tolerance).all()


def exponential(A: np.ndarray, push: np.ndarray, h: arb, x: arb_mat) -> arb_mat:
    """x(h) for x' = A x + push, in ball arithmetic."""
    n = len(A)
    rows = [[*(arb(float(v)) * h for v in A[i]), arb(float(push[i])) * h] for i in range(n)]
    whole = arb_mat([*rows, [arb(0)] * (n + 1)]).exp()
    end = whole * arb_mat([*([x[i, 0]] for i in range(n)), [arb(1)]])
    return arb_mat([[end[i, 0]] for i in range(n)])


@pytest.mark.parametrize("name", MATRICES)
@pytest.mark.parametrize("w", [0.0, 0.5])
def test_a_linear_step_is_exact_up_to_its_remainder(name: str, w: float) -> None:
    A = np.array(MATRICES[name])
    start = mg.Box([0.75, -0.5], [1.25, 0.5])
    flow = one_step((lambda x, u, w: A @ x + B @ w) if w else (lambda x, u: A @ x), start, Order(1, 0), 0.03125, w)
    rng = np.random.default_rng(0)
    with ctx.workprec(300):
        h = arb(flow.steps[0].end)
        for k in range(24):
            xi = rng.choice([-1.0, 1.0, 0.25], 2)
            x = arb_mat([[arb(v)] for v in (1.0 + 0.25 * xi[0], 0.5 * xi[1])])
            corner = rng.choice([-w, w], 2)
            # Constant, then switched at a quarter and at the middle of the step.
            for share, push in ((arb(1), corner),) if k % 3 == 0 else (
                (arb(k % 3) / 4, corner), (1 - arb(k % 3) / 4, -corner),
            ):  # fmt: skip
                x = exponential(A, B @ push, share * h, x)
            holds(flow, xi, np.array([float(x[i, 0]) for i in range(2)]))
    size = np.abs(flow.steps[0].G).sum(axis=(0, 2))
    reached = flow.steps[0].end * w * np.abs(B).sum(axis=1)
    assert (size <= 1.5 * reached + 1e-8).all()


@pytest.mark.parametrize("order", [Order(2, 1), Order(4, 3)])
@pytest.mark.parametrize("w", [0.0, 0.3])
def test_a_nonlinear_step_holds_integrated_trajectories(order: Order, w: float) -> None:
    def rate(x: Any, w: Any) -> Any:
        return [x[1] + 0.2 * x[0] * w[0], -np.sin(x[0]) - 0.5 * x[1] ** 3 + np.exp(0.3 * x[0]) * w[1]]

    start = mg.Box([0.5, -0.5], [1.0, 0.5])
    dynamics = (lambda x, u, w: np.array(rate(x, w))) if w else (lambda x, u: np.array(rate(x, (0.0, 0.0))))
    flow = one_step(dynamics, start, order, 0.04, w)
    end = flow.steps[0].end
    rng = np.random.default_rng(5)
    for _ in range(16):
        xi = rng.choice([-1.0, 1.0, 0.3], 2)
        x = np.array([0.75 + 0.25 * xi[0], 0.5 * xi[1]])
        push = rng.choice([-w, w], 2)
        for t in (0.5 * end, 0.5 * end):
            x = solve_ivp(lambda t, y, p=push: rate(y, p), (0, t), x, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
            push = -push * rng.choice([-1.0, 1.0])
        holds(flow, xi, x, 1e-11)
