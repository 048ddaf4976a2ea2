"""Sampled sets stay inside restarted sets."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import modegraph as mg
from modegraph.reach.compiled import CompiledMode, compile_mode
from modegraph.reach.cover.chain import Chain
from modegraph.reach.cover.restart import filled_share, restarted
from modegraph.reach.flow.flow import Flow, Order
from modegraph.reach.start.substitution import Substitution
from tests.soundness.families import pushed, references, runs

LO, HI = np.array([0.4, -0.1]), np.array([0.6, 0.1])


def rate(x: Any, w: Any) -> Any:
    return [x[1], -4.0 * np.sin(x[0]) - 2.0 * x[1] + 0.3 * w[0]]


@pytest.fixture(scope="module")
def compiled() -> CompiledMode:
    plant = mg.System(lambda x, u, w: np.array(rate(x, w)), states=2, inputs=1, disturbance=mg.Box([-1], [1]))
    mode = mg.Mode("m", plant, controller=lambda x: 0.0 * x[0], reference=mg.setpoint([0.0]), start=mg.Box(LO, HI))
    return compile_mode(mode, None)


def flow_of(compiled: CompiledMode, piece: Any, steps: int) -> Flow:
    flow = Flow(compiled.fields, piece, compiled.w_centre, compiled.w_radius, Order(3, 2), names=compiled.loop.names)
    for _ in range(steps):
        assert flow.advance(10.0)
    return flow


def points(flow: Flow) -> np.ndarray:
    p, G = flow.last_set.p, flow.last_set.G
    rng = np.random.default_rng(1)
    xi = rng.choice([-1.0, 1.0, 0.5], (100, flow.piece.variables))
    powers = np.prod(xi[:, None, :] ** flow.table.exponents, axis=2)
    zeta = rng.choice([-1.0, 1.0], (100, len(G)))
    return powers @ p.T + np.einsum("sg,gik,sk->si", zeta, G, powers[:, : G.shape[2]])


def extremes(flow: Flow) -> np.ndarray:
    """Points of the last set, far out in many directions."""
    p, G = flow.last_set.p, flow.last_set.G
    linear = flow.bounds.linear_part(p)
    found = []
    for d in np.random.default_rng(2).normal(size=(50, len(p))):
        powers = np.prod(np.where(d @ linear < 0.0, -1.0, 1.0) ** flow.table.exponents, axis=1)
        columns = G @ powers[: G.shape[2]]
        found.append(p @ powers + np.where(columns @ d < 0.0, -1.0, 1.0) @ columns)
    return np.array(found)


def holds(flow: Flow, x: np.ndarray) -> None:
    p, G = flow.reach_set(0).p, flow.reach_set(0).G
    for d in np.random.default_rng(2).normal(size=(50, x.shape[1])):
        top = (
            float(flow.bounds.upper(d @ p)) + np.abs(d @ G[:, :, 0].T).sum()
            if len(G)
            else float(flow.bounds.upper(d @ p))
        )
        assert (x @ d <= top + 1e-12 * abs(top)).all()


@pytest.mark.parametrize("framed", [False, True])
def test_a_restart_holds_the_end(compiled: CompiledMode, framed: bool) -> None:
    flow = flow_of(compiled, compiled.whole(), 14)
    following = restarted([flow], compiled.framed_fields if framed else compiled.fields)
    assert following is not None
    assert following.time == flow.time
    holds(following, points(flow))
    spent = float(flow.seen_bounds.upper(flow.steps[-1].energy)) + flow.steps[-1].energy_radius
    assert following.advance(10.0)
    step = following.steps[-1]
    assert float(following.seen_bounds.upper(step.energy)) + step.energy_radius >= spent


def test_a_restart_holds_what_is_bent() -> None:
    """The end is a banana: far wider in its nonlinear part than in its remainder."""
    plant = mg.System(
        lambda x, u, w: np.array([-x[0] + 0.001 * w[0], 2.0 * x[0] ** 2 - x[1]]),
        states=2, inputs=1, disturbance=mg.Box([-1], [1]),
    )  # fmt: skip
    start = mg.Box([-1.0, -0.01], [1.0, 0.01])
    mode = mg.Mode("m", plant, controller=lambda x: 0.0 * x[0], reference=mg.setpoint([0.0]), start=start)
    c = compile_mode(mode, None)
    flow = flow_of(c, c.whole(), 12)
    following = restarted([flow], c.fields)
    assert following is not None
    holds(following, points(flow))


@pytest.mark.parametrize("compact", [False, True])
def test_a_second_restart_holds_what_it_has_no_columns_for(compiled: CompiledMode, compact: bool) -> None:
    second = restarted([flow_of(compiled, compiled.whole(), 14)], compiled.fields)
    assert second is not None
    assert second.piece.variables == 4
    for _ in range(14):
        assert second.advance(10.0)
    third = restarted([second], compiled.fields, compact=compact)
    assert third is not None
    assert third.piece.variables == (2 if compact else 4)
    holds(third, extremes(second))


def test_a_common_restart_holds_all_ends(compiled: CompiledMode) -> None:
    flows = [flow_of(compiled, piece, 10 + 2 * k) for k, piece in enumerate(compiled.whole().split(0))]
    following = restarted(flows, compiled.fields)
    assert following is not None
    assert following.time == max(flow.time for flow in flows)
    for flow in flows:
        holds(following, points(flow))


def test_a_chain_holds_trajectories_under_switched_disturbances(compiled: CompiledMode) -> None:
    chain = Chain(compiled, compiled.whole(), Order(3, 2))
    assert chain.run(1.5), chain.failure
    flow = chain.flows[-1]
    lo, hi = flow.last_set.ranges()
    rng = np.random.default_rng(3)
    for _ in range(12):
        x, w = rng.choice([LO, HI], axis=0).astype(float), rng.choice([-1.0, 1.0])
        for _ in range(3):
            x = solve_ivp(lambda t, y, v=w: rate(y, [v]), (0, 0.5), x, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
            w = -w
        assert (lo - 1e-10 <= x).all()
        assert (x <= hi + 1e-10).all()


def ends_at(flow: Flow, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Quick box of the last set of one reference."""
    return Substitution(flow.bounds, p)(flow.last_set).ranges()


def test_a_restart_keeps_what_depends_on_the_reference() -> None:
    """Twice: first the linear part in the starts is kept as well, then only that in the parameters."""
    family = pushed()
    compiled = compile_mode(family.mode, None, observed=False)
    flow = flow_of(compiled, compiled.whole().split(2)[1], 14)
    for _ in range(2):
        following = restarted([flow], compiled.fields)
        assert following is not None
        holds(following, points(flow))
        for p in (np.array([0.25]), np.array([0.3]), np.array([0.5])):
            before, after = ends_at(flow, p), ends_at(following, p)
            width = before[1] - before[0]
            # In state coordinates what is held may be turned: it need not be inside face by face.
            assert (after[1] - after[0] <= 2.0 * width).all()
            assert (np.abs(after[0] + after[1] - before[0] - before[1]) <= 0.5 * width).all()
        flow = following
        for _ in range(14):
            assert flow.advance(10.0)


def test_runs_of_a_class_stay_inside_after_restarts() -> None:
    family = pushed()
    compiled = compile_mode(family.mode, None, observed=False)
    flow = flow_of(compiled, compiled.whole(), 20)
    for _ in range(2):
        following = restarted([flow], compiled.fields)
        assert following is not None
        flow = following
        for _ in range(20):
            assert flow.advance(10.0)
    rng = np.random.default_rng(4)
    until = replace(family, until=flow.time)
    for p in references(family, 6, rng):
        x = runs(until, np.repeat(p[None], 40, axis=0), np.array([flow.time]), rng)[0]
        lo, hi = ends_at(flow, p)
        assert (lo[:, None] - 1e-10 <= x).all()
        assert (x <= hi[:, None] + 1e-10).all()


def test_how_much_of_a_set_is_remainder(compiled: CompiledMode) -> None:
    flow = flow_of(compiled, compiled.whole(), 1)
    n = len(flow.p0)
    flow.steps[0].p = np.zeros_like(flow.steps[0].p)
    flow.steps[0].p[:, 1] = 2.0
    flow.steps[0].G = np.zeros((n, n, 1))
    flow.steps[0].G[np.arange(n), np.arange(n), 0] = 1.0 + np.arange(n)
    assert filled_share(flow) == pytest.approx(0.5)


@pytest.fixture(scope="module")
def uncertain() -> CompiledMode:
    """A spring of unknown stiffness, beside a constant that is known exactly and named last."""
    plant = mg.System(
        lambda x, u, w, d: np.array([x[1], -d["stiffness"] * x[0] - x[1] - x[0] ** 3 + 0.2 * w[0] + 0.0 * d["one"]]),
        states=2, inputs=0, disturbance=mg.Box([-1.0], [1.0]), unknowns={"stiffness": (0.5, 4.5), "one": (1.0, 1.0)},
    )  # fmt: skip
    mode = mg.Mode(
        "m", plant, controller=lambda x: np.zeros(0), reference=mg.setpoint([0.0]),
        start=mg.Box([1.4, -0.1], [1.6, 0.1]),
    )  # fmt: skip
    return compile_mode(mode, None)


@pytest.mark.parametrize("order", [[0, 1], [1, 0], [0, 1, 2, 3], [3, 0, 2, 1]])
def test_parts_of_an_unknown_are_enclosed_together_for_all_of_it(uncertain: CompiledMode, order: list[int]) -> None:
    """Each was restarted alone before: then its piece scales the unknown to a range of its own."""
    stiffness = 2
    pieces = uncertain.whole().split(stiffness)
    if len(order) == 4:
        pieces = [quarter for half in pieces for quarter in half.split(stiffness)]
    alone = []
    for k, piece in enumerate(pieces):
        following = restarted([flow_of(uncertain, piece, 14)], uncertain.fields)
        assert following is not None
        for _ in range(2 + k):
            assert following.advance(10.0)
        assert following.piece.unknown_ranges[1][0] - following.piece.unknown_ranges[0][0] < 2.1
        alone.append(following)
    together = restarted([alone[k] for k in order], uncertain.fields)
    assert together is not None
    lo, hi = together.piece.unknown_ranges
    assert lo[0] <= 0.5
    assert hi[0] >= 4.5
    assert (lo[1], hi[1]) == (1.0, 1.0)
    assert together.time == max(flow.time for flow in alone)
    spent = [float(f.seen_bounds.upper(f.steps[-1].energy)) + f.steps[-1].energy_radius for f in alone]
    assert together.spent >= max(spent)
    for flow in alone:
        holds(together, points(flow))


def test_what_all_have_spent_is_the_most_that_one_has(compiled: CompiledMode) -> None:
    flows = [flow_of(compiled, piece, 10) for piece in compiled.whole().split(0)]
    for k, spent in enumerate((3.0, 7.0)):
        flows[k].steps[-1].energy_radius = spent
    for order in (flows, flows[::-1]):
        following = restarted(order, compiled.fields)
        assert following is not None
        assert following.spent >= 7.0
