"""Chains that are cut on the way: the halves hold everything, and share what came before."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import modegraph as mg
from modegraph.reach import flowpipe as module
from modegraph.reach.compiled import compile_mode
from modegraph.reach.cover import chain as chain_module
from modegraph.reach.cover import cutting
from modegraph.reach.cover.chain import Chain
from modegraph.reach.flow.flow import Flow, Order
from modegraph.reach.flowpipe import Flowpipe

START = mg.Box([1.25, 2.35], [1.55, 2.45])
PUSH, END = 0.1, 7.0


def rate(x: Any, w: Any, damping: Any) -> Any:
    return [x[1], damping * (1 - x[0] ** 2) * x[1] - x[0] + w]


def van_der_pol(unknown: bool = False) -> mg.Mode:
    """The input costs energy and does nothing."""

    def pushed(x: Any, u: Any, w: Any) -> Any:
        return np.array(rate(x, w[0], 1.0 + 0.0 * u[0]))

    def damped(x: Any, u: Any, w: Any, d: Any) -> Any:
        return np.array(rate(x, w[0], d["damping"] + 0.0 * u[0]))

    plant = mg.System(
        damped if unknown else pushed,
        states="x y",
        inputs="push",
        disturbance=mg.Box([-PUSH], [PUSH]),
        unknowns={"damping": (0.95, 1.05)} if unknown else None,
    )
    return mg.Mode("loop", plant, controller=lambda x: 0.1 * x[0], reference=mg.setpoint([0.0]), start=START)


def run_of(mode: mg.Mode, end: float) -> Chain:
    compiled = compile_mode(mode, None)
    found = Chain(compiled, compiled.whole(), Order(6, 3))
    assert found.run(end), found.failure
    return found


@pytest.fixture(scope="module")
def chain() -> Chain:
    """Two restarts: the second flow has four set variables, and so has the third."""
    found = run_of(van_der_pol(), 3.0)
    assert [flow.piece.variables for flow in found.flows] == [2, 4, 4]
    return found


def extremes(flow: Flow) -> np.ndarray:
    """Points of the last set of a flow, far out in many directions."""
    p, G = flow.last_set.p, flow.last_set.G
    linear = flow.bounds.linear_part(p)
    found = []
    for d in np.random.default_rng(4).normal(size=(200, len(p))):
        xi = np.where(d @ linear < 0.0, -1.0, 1.0)
        powers = np.prod(xi**flow.table.exponents, axis=1)
        columns = G @ powers[: G.shape[2]]
        found.append(p @ powers + np.where(columns @ d < 0.0, -1.0, 1.0) @ columns)
    return np.array(found)


def is_in(flow: Flow, x: np.ndarray) -> np.ndarray:
    """Which points lie in the start of a flow from a part of a parallelotope."""
    chart, n = flow.piece.chart, x.shape[1]
    assert chart.free == n
    xi = np.linalg.solve(chart.axes, (x - chart.centre).T).T
    return np.asarray(((flow.piece.lo[:n] - 1e-9 <= xi) & (xi <= flow.piece.hi[:n] + 1e-9)).all(axis=1))


def test_halves_hold_all_that_the_flow_before_has_reached(chain: Chain) -> None:
    halves = chain.halves(2)
    assert len(halves) == 2
    x = extremes(chain.flows[1])
    inside = np.array([is_in(half.flows[2], x) for half in halves])
    assert inside.any(axis=0).all()
    assert not inside[0].all()
    assert not inside[1].all()


def test_halves_go_on_where_the_flow_began(chain: Chain) -> None:
    before = list(chain.flows)
    last = before[1].steps[-1]
    spent = float(before[1].seen_bounds.upper(last.energy)) + last.energy_radius
    assert spent > 0.0
    for half in chain.halves(2):
        assert half.flows[:2] == before[:2]
        assert half.shared == 2
        assert half.flows[2].time == before[1].time
        assert half.flows[2].spent >= spent
        assert half.run(2.5)
        assert all(k >= 2 for k in half.weak())
        for quarter in half.halves(2):
            assert quarter.flows[2].piece.depth == 2
            assert quarter.flows[2].spent >= spent
            assert quarter.flows[2].time == before[1].time
    assert chain.flows == before
    assert chain.shared == 0


def test_an_unknown_constant_is_cut_too(monkeypatch: pytest.MonkeyPatch) -> None:
    chain = run_of(van_der_pol(unknown=True), 2.0)
    assert len(chain.flows) == 2
    monkeypatch.setattr(chain_module, "nonlinear_variable", lambda flow: flow.piece.variables - 1)
    left, right = (half.flows[1].piece.unknown_range(0) for half in chain.halves(1))
    assert left[0] == 0.95
    assert right[0] <= left[1]
    assert right[1] == 1.05


def test_where_a_remainder_feeds_itself_comes_first(chain: Chain, monkeypatch: pytest.MonkeyPatch) -> None:
    for flow, feedback in zip(chain.flows, (0.1, 0.6, 0.5), strict=True):
        monkeypatch.setattr(flow, "feedback", feedback)
    assert chain.weak() == [1, 2, 0]
    monkeypatch.setattr(chain, "shared", 2)
    assert chain.weak() == [2]


def pipe_of(*chains: Chain) -> Flowpipe:
    return Flowpipe("loop", ["x", "y"], 3.0, chains, "")


def test_shared_flows_are_looked_at_once(chain: Chain, monkeypatch: pytest.MonkeyPatch) -> None:
    halves = chain.halves(2)
    for half in halves:
        assert half.run(3.0)
    seen: list[Flow] = []

    class Recorded(module.Slicer):
        def __init__(self, flow: Flow) -> None:
            super().__init__(flow)
            seen.append(flow)

    monkeypatch.setattr(module, "Slicer", Recorded)
    whole, pipe = pipe_of(chain), pipe_of(*halves)
    assert seen == [*chain.flows, *chain.flows[:2], halves[0].flows[2], halves[1].flows[2]]
    assert pipe.pieces == 2
    assert pipe.steps == sum(len(flow.steps) for flow in seen[3:])
    assert "1 piece of the start set, cut into 2 on the way" in pipe.reason
    cut = chain.flows[1].time
    for t in (0.0, 0.5 * cut, cut):
        np.testing.assert_array_equal(pipe.at(t).lo, whole.at(t).lo)
        np.testing.assert_array_equal(pipe.at(t).hi, whole.at(t).hi)
    times, boxes = pipe.tubes()
    assert len(boxes) == 4
    for a, b in pairwise(times[::7]):
        box = pipe.hull(a, b)
        for t in (a, 0.5 * (a + b), b):
            assert (pipe.at(t).lo >= box.lo).all()
            assert (pipe.at(t).hi <= box.hi).all()
    covered = np.zeros(len(times) - 1)
    for rows, lo, _ in boxes:
        assert len(lo) == rows.stop - rows.start
        covered[rows] += 1
    np.testing.assert_array_equal(covered, np.where(times[1:] <= cut, 1, 2))


@pytest.fixture(scope="module")
def pipe() -> Flowpipe:
    return mg.flowpipe(van_der_pol(), horizon=END)


def test_what_breaks_down_whole_is_complete_in_pieces(pipe: Flowpipe, record_property: Any) -> None:
    assert pipe.complete, pipe.reason
    assert 1 < pipe.pieces <= cutting.MOST_TIGHTENED
    assert f"1 piece of the start set, cut into {pipe.pieces} on the way" in pipe.reason
    box = pipe.at(END)
    print(f"VDP, w +-{PUSH:g} at T = {END:g}: {pipe.pieces} pieces, width {box.hi - box.lo}")
    record_property("width", (box.hi - box.lo).tolist())
    assert (box.hi - box.lo < [3.5, 9.0]).all()


@pytest.mark.parametrize("interval", [0.25, 3.5])
def test_runs_under_switched_disturbances_stay_inside(pipe: Flowpipe, interval: float) -> None:
    rng = np.random.default_rng(7)
    switches = np.arange(0.0, END + 1e-9, interval)
    starts = np.array([[x, y] for x in (START.lo[0], START.hi[0]) for y in (START.lo[1], START.hi[1])])
    for x0 in np.vstack([starts, START.sample(2, seed=5)]):
        bang = rng.choice([-PUSH, PUSH], len(switches))
        for pushes in (bang, rng.uniform(-PUSH, PUSH, len(switches)), np.abs(bang), -np.abs(bang)):
            x = x0
            for (a, b), w in zip(pairwise([*switches, END]), pushes, strict=True):
                if a >= b:
                    continue
                instants = [*pipe.times[(pipe.times >= a) & (pipe.times <= b)][::5], *rng.uniform(a, b, 2), b]
                run = solve_ivp(
                    lambda t, y, w=w: rate(y, w, 1.0), (a, b), x, "DOP853", rtol=1e-10, atol=1e-12, dense_output=True
                )
                for t in instants:
                    box = pipe.at(t)
                    assert (box.lo - 1e-8 <= run.sol(t)).all()
                    assert (run.sol(t) <= box.hi + 1e-8).all()
                box = pipe.hull(a, b)
                for t in np.linspace(a, b, 9):
                    assert (box.lo - 1e-8 <= run.sol(t)).all()
                    assert (run.sol(t) <= box.hi + 1e-8).all()
                x = run.y[:, -1]


def test_cutting_on_the_way_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cutting, "MOST_PIECES", 1)
    pipe = mg.flowpipe(van_der_pol(), horizon=END)
    assert not pipe.complete
    assert "1 piece of the start set; no more are tried" in pipe.reason
