"""Passages of kinks hold the runs, start by start, at their ends and inside; and they are thin."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import modegraph as mg
from modegraph.reach.compiled import CompiledMode, compile_mode
from modegraph.reach.cover.cuts import nonlinear_variable
from modegraph.reach.flow import passage as module
from modegraph.reach.flow.flow import Flow, Order
from modegraph.reach.flow.own_time import in_own_time
from modegraph.reach.flow.records import Step
from modegraph.reach.generators import generator_box

TOLERANCE = 1e-8


def mode(acceleration: Any, start: mg.Box, controller: Any, *, w: float = 0.0, **more: Any) -> mg.Mode:
    """x'' = acceleration(x, u) + w."""
    if w:
        push = lambda x, u, w: np.array([x[1], acceleration(x, u[0]) + w[0]])
        plant = mg.System(push, states="x v", inputs="u", disturbance=mg.Box([-w], [w]))
    else:
        plant = mg.System(lambda x, u: np.array([x[1], acceleration(x, u[0])]), states="x v", inputs="u")
    return mg.Mode("loop", plant, controller=controller, reference=mg.setpoint([0.0]), start=start, **more)


def clipped(kp: float, kd: float, limit: float) -> Any:
    return lambda x, r: np.clip(-kp * (x[:1] - r) - kd * x[1:], -limit, limit)


def saturated(**more: Any) -> mg.Mode:
    return mode(lambda x, u: u, mg.Box([0.6, -0.1], [1.0, 0.1]), clipped(9.0, 6.0, 2.0), **more)


def swinging() -> mg.Mode:
    """Both limits, one after the other, before all starts have left the first."""
    return mode(lambda x, u: u - 0.2 * np.sin(3.0 * x[0]), mg.Box([0.75, -0.1], [1.0, 0.1]), clipped(9.0, 1.5, 2.0))


def bouncing() -> mg.Mode:
    return mode(
        lambda x, u: -4.0 - 0.2 * x[1] + 200.0 * np.maximum(-x[0], 0.0), mg.Box([0.9, -0.1], [1.1, 0.1]),
        lambda x: 0.0,
    )  # fmt: skip


def flow_of(made: mg.Mode, until: float, degree: int = 8) -> tuple[Flow, CompiledMode]:
    c = compile_mode(made, None)
    flow = Flow(c.fields, c.whole(), c.w_centre, c.w_radius, Order(degree, 3), names=c.loop.names)
    flow.run(until)
    return flow, c


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> list[Step]:
    """The passages of the flows of a test."""
    found: list[Step] = []
    attempt = module.Passages.attempt

    def recorded(self: Any, *args: Any) -> Step | None:
        step = attempt(self, *args)
        if step is not None:
            found.append(step)
        return step

    monkeypatch.setattr(module.Passages, "attempt", recorded)
    return found


def run_from(made: mg.Mode, x0: np.ndarray, until: float, w: Any = None) -> Any:
    plant, control = made.system, made.controller

    def rate(t: float, x: np.ndarray) -> Any:
        u = np.atleast_1d(control(x) if control.__code__.co_argcount == 1 else control(x, np.zeros(1)))
        return plant.dynamics(x, u, [w(t)]) if w is not None else plant.dynamics(x, u)

    return solve_ivp(rate, (0.0, until), x0, method="DOP853", rtol=1e-10, atol=1e-12, max_step=0.02, dense_output=True)


def assert_holds(flow: Flow, made: mg.Mode, pushes: list[Any]) -> None:
    """Each run is in the set of its very own start, at the ends of steps and inside them."""
    rng = np.random.default_rng(4)
    corners = np.array([[a, b] for a in (-1.0, 1.0) for b in (-1.0, 1.0)])
    until = flow.steps[-1].end
    lo, hi = np.array(made.start.lo), np.array(made.start.hi)
    tubes = flow.tubes()
    for xi in np.vstack([corners, rng.uniform(-1.0, 1.0, (5, 2))]):
        powers = np.prod(xi**flow.table.exponents, axis=1)
        for push in pushes:
            sol = run_from(made, 0.5 * (lo + hi) + 0.5 * (hi - lo) * xi, until, push).sol
            for k, step in enumerate(flow.steps):
                rest = sol(step.end) - step.p @ powers
                assert (np.abs(rest) <= generator_box(step.G) + TOLERANCE).all(), step.end
                for share in np.linspace(0.0, 1.0, 11):
                    x = sol(step.start + share * (step.end - step.start))
                    chord = (1.0 - share) * flow.set_at(k).p + share * step.p
                    assert (np.abs(x - chord @ powers) <= flow.swell(step) + TOLERANCE).all(), step.end
                    assert (tubes[0][k] - TOLERANCE <= x).all()
                    assert (x <= tubes[1][k] + TOLERANCE).all()


@pytest.mark.parametrize(
    "made, until, passages",
    [(saturated(), 3.0, 1), (swinging(), 1.5, 1), (bouncing(), 1.3, 2)],
    ids=["saturated", "swinging", "bouncing"],
)
def test_runs_are_in_the_sets_of_their_starts(made: mg.Mode, until: float, passages: int, seen: list[Step]) -> None:
    flow, _ = flow_of(made, until)
    assert flow.failure is None
    assert len(seen) >= passages
    assert all(any(step is other for other in flow.steps) for step in seen)
    assert_holds(flow, made, [None])


def test_runs_under_a_disturbance(seen: list[Step]) -> None:
    made = saturated(w=0.05)
    flow, _ = flow_of(made, 1.5)
    assert flow.failure is None
    assert seen
    pushes = [lambda t: 0.05, lambda t: -0.05, lambda t: 0.05 * np.sign(np.sin(9.0 * t))]
    assert_holds(flow, made, pushes)


def test_what_a_passage_adds_is_thin() -> None:
    """A step that crosses the kink with a chord adds more than .1 in v."""
    flow, _ = flow_of(saturated(), 3.0)
    assert max(float(generator_box(step.G).max()) for step in flow.steps) < 1e-3


def test_a_saturated_arm_arrives_in_one_piece() -> None:
    from benchmarks.arm import arm, clipped_pd, start

    pipe = mg.flowpipe(arm(start(0.02), controller=clipped_pd), horizon=3.0)
    assert pipe.complete, pipe.reason
    assert pipe.pieces == 1


def test_energy_counts_common_time(seen: list[Step]) -> None:
    """While it is saturated the loop spends limit^2 a second."""
    made = saturated()
    flow, _ = flow_of(made, 1.5)
    assert seen
    step = seen[-1]
    spent = flow.seen_bounds.upper(np.vstack([step.energy, -step.energy])) + step.energy_radius
    for xi in np.array([[a, b] for a in (-1.0, 0.0, 1.0) for b in (-1.0, 1.0)]):
        sol = run_from(made, np.array([0.8 + 0.2 * xi[0], 0.1 * xi[1]]), step.end).sol
        t = np.linspace(0.0, step.end, 4001)
        u = np.clip(-9.0 * sol(t)[0] - 6.0 * sol(t)[1], -2.0, 2.0)
        energy = np.trapezoid(u**2, t)
        assert -spent[1] - 1e-4 <= energy <= spent[0] + 1e-4


def test_a_constraint_is_watched_during_a_passage(seen: list[Step]) -> None:
    """The speed comes closest to its limit while starts leave the saturation."""
    for limit, proved in ((1.6, True), (0.9, False)):
        made = saturated(constraints=lambda x, limit=limit: {"speed": -x[1] <= limit})
        flow, _ = flow_of(made, 1.5)
        assert all((step.face_upper <= 0.0).all() for step in flow.steps) == proved
    assert seen


def clocks(made: mg.Mode) -> Any:
    """A walk at the start of a flow."""
    c = compile_mode(made, None)
    flow = Flow(c.fields, c.whole(), c.w_centre, c.w_radius, Order(4, 3), names=c.loop.names)
    own = in_own_time(c.fields[0])
    assert own is not None
    return module._Walk(flow, module.Kinks(c.fields[0]), own, 0.05)


def test_clocks_that_do_not_add_up_exactly_are_refused() -> None:
    walk = clocks(saturated())
    assert walk._part(walk._constant(0.125))
    assert not walk._part(walk._constant(1.0 / 6.0))
    assert not walk._part(walk._constant(2.0**-70))
    assert walk.clock[0] == 0.125


def test_no_start_goes_back_in_time() -> None:
    walk = clocks(saturated())
    seconds = walk._constant(0.125)
    seconds[walk.flow.table.linear[0]] = 0.25
    assert not walk._part(seconds)


def test_the_bend_of_a_passage_counts_every_product() -> None:
    """Clock and travel both depend on xi: off the chord by their product, whatever the polynomials say."""
    walk = clocks(saturated())
    assert walk._part(walk._constant(0.125))
    linear = walk.flow.table.linear
    travel = np.zeros_like(walk.walk._p)
    travel[:, 0], travel[:, linear[0]], travel[:, linear[1]] = 1.0, 0.5, 0.25
    share = walk._constant(0.5)
    share[linear[0]] = 0.25
    inside = 0.5 * travel
    inside[:, 1:] += np.outer(travel[:, 0], share[1:])
    walk.walk._p = walk.flow._p + travel
    walk.knots = [(share, walk.flow._p + inside)]
    step = walk._step(1.0, 1.0)
    # At xi = (1, 1): (.5 + .25) (1 + .5 + .25), less what the knot holds.
    assert (step.bend >= 0.75 * 1.75 - (0.5 * 1.75 + 0.25) - 1e-15).all()
    assert (step.bend <= 0.2).all()


def test_a_passage_takes_the_worst_of_its_parts() -> None:
    walk = clocks(saturated(constraints=lambda x: {"speed": x[1] <= 9.0}))
    assert walk._part(walk._constant(0.125))
    assert walk._part(walk._constant(0.125))
    first = walk.walk.steps[0]
    first.face_upper, first.tube, first.bend = np.array([7.0]), np.array([5.0, 6.0]), np.array([3.0, 4.0])
    step = walk._step(0.25, 0.25)
    assert (step.face_upper >= 7.0).all()
    assert (step.tube >= [5.0, 6.0]).all()
    assert (step.bend >= [3.0, 4.0]).all()


def test_a_set_astride_of_a_kink_is_cut_across_it() -> None:
    """u = clip(-9 x - v / 100): x decides on which side of the limits a start is."""
    made = mode(lambda x, u: u - 0.3 * np.sin(x[1]), mg.Box([-1.0, -1.0], [1.0, 1.0]), clipped(9.0, 0.01, 2.0))
    flow, _ = flow_of(made, 0.2)
    assert flow.astride is not None
    assert nonlinear_variable(flow) == 0


def test_starts_on_both_sides_of_both_limits() -> None:
    made = mode(lambda x, u: u, mg.Box([-1.0, -0.5], [1.0, 0.5]), clipped(9.0, 6.0, 4.0))
    pipe = mg.flowpipe(made, horizon=6.0)
    assert pipe.complete, pipe.reason
    box = pipe.at(6.0)
    assert (np.abs([box.lo, box.hi]) < 1e-3).all()
