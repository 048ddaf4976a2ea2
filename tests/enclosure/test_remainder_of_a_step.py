"""Single steps far from comfortable: wide remainders, long steps, low degrees. What is accepted must hold."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import modegraph as mg
from modegraph.enclosure.step import DONE
from modegraph.reach.compiled import compile_mode
from modegraph.reach.flow.flow import Flow, Order

RATES: dict[str, tuple[Any, int]] = {
    "square": (lambda x: [x[0] ** 2], 1),
    "minus cube": (lambda x: [-3.0 * x[0] ** 3], 1),
    "exponential": (lambda x: [np.exp(0.8 * x[0]) - 2.0], 1),
    "fast decay": (lambda x: [-12.0 * x[0] + np.sin(x[0])], 1),
    # The remainder meets the kink on the way, but not at the start: one look at the tube is not enough.
    "late kink": (lambda x: [4.0 * (x[0] - 1.0) + 30.0 * np.maximum(x[0] - 2.4, 0.0)], 1),
    "pendulum": (lambda x: [x[1], -9.0 * np.sin(x[0]) - 0.2 * x[1]], 2),
    "product": (lambda x: [x[0] * x[1], 1.0 - x[0] ** 2 + 0.5 * x[1]], 2),
    "saturated": (lambda x: [x[1], -4.0 * np.clip(x[0] + x[1], -0.6, 0.6)], 2),
}
LENGTHS = (0.005, 0.02, 0.1, 0.3, 0.6)


def new_flow(dynamics: Any, start: mg.Box, order: Order, push: mg.Box | None = None) -> Flow:
    plant = mg.System(dynamics, states=start.dim, inputs=1, disturbance=push)
    mode = mg.Mode("m", plant, controller=lambda x: 0.0 * x[0], reference=mg.setpoint([0.0]), start=start)
    c = compile_mode(mode, None)
    return Flow(c.fields, c.whole(), c.w_centre, c.w_radius, order, names=c.loop.names)


@pytest.mark.parametrize("order", [Order(1, 0), Order(2, 1), Order(4, 3)])
@pytest.mark.parametrize("name", RATES)
def test_an_accepted_step_holds_its_runs(name: str, order: Order) -> None:
    rate, n = RATES[name]
    start = mg.Box(np.full(n, 0.8), np.full(n, 1.2))
    rng = np.random.default_rng(3)
    accepted = 0
    for size in (0.0, 0.01, 0.1, 0.5):
        for h in LENGTHS:
            flow = new_flow(lambda x, u: np.array(rate(x)), start, order)
            flow._G = np.zeros((n, n, flow.small))
            flow._G[np.arange(n), np.arange(n), 0] = size
            with np.errstate(all="ignore"):
                status, _, p, G, tube, bend, _, _ = flow._attempt(flow.fields[0], h)
            if status != DONE:
                continue
            accepted += 1
            for _ in range(12):
                xi, e = rng.choice([-1.0, 1.0, 0.3], n), size * rng.choice([-1.0, 1.0], n)
                times = np.linspace(0.0, h, 9)
                x0 = 1.0 + 0.2 * xi + e
                run = solve_ivp(lambda t, x: rate(x), (0.0, h), x0, "DOP853", t_eval=times, rtol=1e-11, atol=1e-12)
                assert run.success, "escapes although the step was accepted"
                powers = np.prod(xi**flow.table.exponents, axis=1)
                tolerance = 1e-9 * (1.0 + np.abs(run.y).max())
                first, last = flow.p0 @ powers, p @ powers
                room = np.abs(G @ powers[: G.shape[2]]).sum(axis=0)
                assert (np.abs(run.y[:, -1] - last) <= room + tolerance).all()
                share = times / h
                off = np.abs(run.y - first[:, None] * (1.0 - share) - last[:, None] * share)
                assert (off <= (tube + bend)[:, None] + tolerance).all()
    assert accepted >= 2


@pytest.mark.parametrize("n", [2, 5])
def test_a_push_through_a_row_of_integrators(n: int) -> None:
    """w = 1 moves the k-th state from the end by h^k / k!, far beyond what two columns carry."""
    flow = new_flow(
        lambda x, u, w: np.array([*(x[k + 1] for k in range(n - 1)), w[0]]),
        mg.Box(np.zeros(n), np.ones(n)), Order(1, 0), mg.Box([-1.0], [1.0]),
    )  # fmt: skip
    h = 0.5
    status, _, _, G, tube, _, _, _ = flow._attempt(flow.fields[0], h)
    assert status == DONE
    for i in range(n):
        reached = h ** (n - i) / math.factorial(n - i)
        assert np.abs(G[:, i]).sum() >= reached
        assert tube[i] >= reached


def test_a_push_where_the_units_of_the_states_differ() -> None:
    """A slow loop around a fast one, in metres and radians: |h J| is 5 in the infinity norm, with a spectral radius
    of 0.2. A bound of the rest in that norm alone reached .04 in every state; the push moves the first by 2e-5."""
    rates = [[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 9.81, 0.0], [0.0, 0.0, 0.0, 1.0], [-40.7, -38.5, -135.0, -18.9]]
    start = mg.Box(np.full(4, -0.1), np.full(4, 0.1))
    flow = new_flow(lambda x, w: np.array(rates) @ x + np.array([0.0, w[0], 0.0, 0.0]), start, Order(1, 0),
                    mg.Box([-0.1], [0.1]))  # fmt: skip
    h = 0.0218
    with np.errstate(all="ignore"):
        status, _, _, G, *_ = flow._attempt(flow.fields[0], h)
    assert status == DONE
    moved = np.abs(G).sum(axis=(0, 2))
    assert moved[1] <= 1.1 * 0.1 * h
    assert (moved <= [1e-4, 1.0, 1e-3, 0.2]).all()


@pytest.mark.parametrize("h", [0.05, 0.1])
def test_a_push_that_a_rising_slope_carries_on(h: float) -> None:
    """x' = 5 y^2 x + w with y' = 8 from 0: the slope is 0 at first, w = 1 moves x further than h."""
    flow = new_flow(
        lambda x, u, w: np.array([8.0 + 0.0 * x[0], 5.0 * x[0] ** 2 * x[1] + w[0]]),
        mg.Box([0.0, 0.0], [0.0, 0.0]), Order(4, 3), mg.Box([-1.0], [1.0]),
    )  # fmt: skip
    status, _, _, G, tube, _, _, _ = flow._attempt(flow.fields[0], h)
    assert status == DONE
    s = np.linspace(0.0, h, 20001)
    rise = 320.0 / 3.0 * (h**3 - s**3)
    reached = np.trapezoid(np.exp(rise), s)
    assert reached <= np.abs(G[:, 1]).sum() < 1.1 * reached
    assert tube[1] >= reached
