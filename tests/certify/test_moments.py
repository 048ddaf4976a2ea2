"""At every instant all that a flow may be at is within the spread of what the reference moves."""

from __future__ import annotations

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.moments import Moments, at_state, moments_of
from modegraph.certify.targets.family import TargetClass, target_class
from modegraph.reach.compiled import CompiledMode, compile_mode
from modegraph.reach.cover.restart import restarted
from modegraph.reach.flow.flow import Flow, Order

REGION = mg.Box([-1.0], [2.0])
LOOP = mg.System(
    lambda x, u, w: np.array([x[1], u[0] + w[0] - 0.1 * x[0] ** 2]), states="x v", inputs="u",
    disturbance=mg.Box([-0.05], [0.05]),
)  # fmt: skip
TARGETS = {
    "flat": lambda r: mg.Box([r[0] - 0.3, -0.4], [r[0] + 0.3, 0.4]),
    "round": lambda r: mg.Ball([r[0], 0.0], 0.3),
}


def mode(start: object) -> mg.Mode:
    return mg.Mode(
        "m", LOOP, controller=lambda x, r: -2.0 * (x[0] - r[0]) - 3.0 * x[1], reference=mg.setpoint(REGION),
        start=start,
    )  # fmt: skip


@pytest.fixture(scope="module")
def flow() -> Flow:
    compiled = compile_mode(mode(lambda r: mg.Ball([r[0], 0.0], 0.2)), None)
    found: Flow = compiled.flow(compiled.whole(), Order(4, 3))
    assert found.run(1.0)
    return found


def moments(flow: Flow, kind: str, horizon: float = 1.0) -> tuple[Moments, TargetClass]:
    target = target_class(mode(TARGETS[kind]), None, 2)
    assert isinstance(target, TargetClass)
    found = moments_of(flow, target, horizon, [(-1.0, 2.0)])
    assert found is not None
    return found, target


def run(r: float, x: np.ndarray, w: float, times: np.ndarray) -> np.ndarray:
    from scipy.integrate import solve_ivp

    def rate(t: float, y: np.ndarray) -> list[float]:
        return [y[1], -2.0 * (y[0] - r) - 3.0 * y[1] + w - 0.1 * y[0] ** 2]

    return np.asarray(solve_ivp(rate, (0.0, 1.0), x, "DOP853", t_eval=times, rtol=1e-11, atol=1e-13).y.T)


def moved(m: Moments, r: float) -> np.ndarray:
    """What the reference alone moves, (K, f)."""
    return np.asarray(m.rows @ np.prod(((r - m.middle) / m.scale) ** m.exponents, axis=1))


@pytest.mark.parametrize("kind", TARGETS)
def test_the_spread_holds_all_runs(flow: Flow, kind: str) -> None:
    m, target = moments(flow, kind)
    largest = np.zeros(m.spread.shape)
    for r in (-1.0, -0.3, 1.4, 2.0):
        for angle in np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False):
            for w in (-0.05, 0.05):
                x = run(r, np.array([r, 0.0]) + 0.2 * np.array([np.cos(angle), np.sin(angle)]), w, m.times)
                off = x @ target.rows.T - moved(m, r)
                reach = np.linalg.norm(off, axis=1, keepdims=True) if target.round else off
                assert (reach <= m.spread + 1e-8).all()
                largest = np.maximum(largest, reach)
                assert np.abs(x).max() <= m.farthest + 1e-8
    # And it is not much more than what was met.
    assert (m.spread[-1] <= 2.5 * largest[-1]).all()


@pytest.mark.parametrize("kind", TARGETS)
def test_ranges_over_references_hold_each_of_them(flow: Flow, kind: str) -> None:
    m, _ = moments(flow, kind)
    low, high = m.over(np.array([[-0.5]]), np.array([[1.2]]))
    for r in np.linspace(-0.5, 1.2, 30):
        assert (low[0] <= moved(m, r) + 1e-12).all()
        assert (moved(m, r) <= high[0] + 1e-12).all()
    assert m.whole
    assert not m.is_constant


def test_instants_end_with_the_horizon(flow: Flow) -> None:
    m, _ = moments(flow, "flat", 0.4)
    assert m.times[0] == 0.0
    assert 0.3 < m.times[-1] <= 0.4
    assert m.energy[0] == 0.0
    assert (np.diff(m.energy) > 0.0).all()


def test_a_state_is_reached_at_once(flow: Flow) -> None:
    _, target = moments(flow, "flat")
    x = np.array([0.7, -0.1])
    m = at_state(x, target)
    assert m.is_constant
    assert m.affine
    assert np.allclose(m.rows[0, :, 0], target.rows @ x)
    assert not m.spread.any()


GOAL = target_class(mg.Target("goal", mg.Box([-1.0, -1.0], [1.0, 1.0])), None, 2)
CLASS = [(-1.0, 1.0)]


@pytest.fixture(scope="module")
def compiled() -> CompiledMode:
    plant = mg.System(
        lambda x, u, w: np.array([x[1], u[0] - 0.3 * np.sin(x[0]) + w[0]]), states=2, inputs=1,
        disturbance=mg.Box([-0.2], [0.2]),
    )  # fmt: skip
    mode = mg.Mode(
        "m", plant, controller=lambda x, r: -4.0 * (x[:1] - r) - 4.0 * x[1:],
        reference=mg.setpoint(mg.Box([-1.0], [1.0])), start=lambda r: mg.Ball([r[0], 0.0], 0.2),
    )  # fmt: skip
    return compile_mode(mode, None)


@pytest.mark.parametrize("restart", [False, True])
def test_a_flow_of_a_part_of_the_class_is_not_one_of_the_whole(compiled: CompiledMode, restart: bool) -> None:
    """After a restart the piece of a part scales its own range to [-1, 1], as a whole class does."""
    parameter = 2
    for piece, whole in [(compiled.whole(), True), *((half, False) for half in compiled.whole().split(parameter))]:
        flow = compiled.flow(piece, Order(3, 2))
        assert all(flow.advance(10.0) for _ in range(14))
        if restart:
            following = restarted([flow], compiled.fields)
            assert following is not None
            assert following.advance(10.0)
            flow = following
        found = moments_of(flow, GOAL, 10.0, CLASS)
        assert found is not None
        assert found.whole == whole
        assert bool(found.lo[0] <= -1.0 and found.hi[0] >= 1.0) == whole


def test_the_moments_follow_the_centre_and_the_spread_holds_the_rest(compiled: CompiledMode) -> None:
    flow = compiled.flow(compiled.whole(), Order(4, 3))
    assert all(flow.advance(10.0) for _ in range(20))
    found = moments_of(flow, GOAL, 10.0, CLASS)
    assert found is not None
    assert (np.diff(found.energy) >= -1e-9).all()
    below, above = found.over(np.array([[0.5]]), np.array([[0.5]]))
    # The rows are +-x: at the first instants the centre is the reference.
    assert below[0, 0, 0] == pytest.approx(0.5, abs=0.05)
    assert (above >= below).all()
    assert (found.spread[0, :1] >= 0.19).all()
