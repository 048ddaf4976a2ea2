"""All time is claimed only where the loop exists for all time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.reach.compiled import compile_mode
from modegraph.reach.failure import Mechanism
from modegraph.reach.flow.flow import Flow, Order
from modegraph.reach.tail.base import Tail, TailFailure
from modegraph.reach.tail.box import TailSearch, relevant_states
from tests.soundness.families import Family, pendulum, references, runs


def mode(dynamics: Callable[..., Any], start: mg.Box, controller: Callable[..., Any] | None = None) -> mg.Mode:
    plant = mg.System(dynamics, states=start.dim, inputs=1)
    return mg.Mode(
        "m",
        plant,
        controller=controller or (lambda x: 0.0 * x[0]),
        reference=mg.setpoint([0.0]),
        start=start,
        constraints=lambda x: {"first": x[0] <= 2.0},
    )


def check(source: mg.Mode) -> mg.Verdict:
    return mg.build([source], budget=20.0).check("m")


CLOCK = mg.Box([0.5, 0.0, -10.0], [1.0, 0.1, -9.9])
"""The third state is a clock with x3' = 1 that nothing bounded reads: it is 0 at about t = 10 s."""


@pytest.mark.parametrize(
    "rate",
    [
        lambda x: 1.0 / x[2],
        lambda x: np.log(-x[2]),
        lambda x: np.sqrt(-x[2]),
        lambda x: x[0] * x[2] / x[2],
        lambda x: 0.0 * (1.0 / x[2]),
        lambda x: 1.0 / x[2] - 1.0 / x[2],
    ],
    ids=["reciprocal", "logarithm", "square root", "cancelled", "times zero", "difference"],
)
def test_a_state_that_feeds_nothing_may_still_leave_a_domain(rate: Callable[[Any], Any]) -> None:
    source = mode(lambda x, u: np.array([u[0] - x[0], rate(x), 1.0]), CLOCK)
    assert check(source).status is not mg.Status.CERTIFIED


def test_a_pole_where_no_state_is_relevant() -> None:
    plant = mg.System(lambda x, u: np.array([u[0] + 1.0 / x[1], 1.0]), states=2, inputs=1)
    source = mg.Mode(
        "m",
        plant,
        controller=lambda x: 0.0 * x[0],
        reference=mg.setpoint([0.0]),
        start=mg.Box([0, -10], [0.1, -9.9]),
    )
    assert check(source).status is not mg.Status.CERTIFIED


def test_a_cancelled_pole_in_a_drifting_state() -> None:
    source = mode(lambda x, u: np.array([u[0] - x[0] * x[1] / x[1], 1.0]), mg.Box([0.5, -10.0], [1.0, -9.9]))
    assert check(source).status is not mg.Status.CERTIFIED


def test_a_cancelled_pole_in_time() -> None:
    source = mode(
        lambda x, u: np.array([u[0]]),
        mg.Box([0.5], [1.0]),
        controller=lambda x, t: -(x[0] * (t - 10.0)) / (t - 10.0),
    )
    assert check(source).status is not mg.Status.CERTIFIED


@pytest.mark.parametrize("rate", [lambda x: x[0], lambda x: np.sin(x[2]) * x[0], lambda x: 1.0 / (2.0 + x[0])])
def test_a_drifting_state_that_is_defined_everywhere_is_no_obstacle(rate: Callable[[Any], Any]) -> None:
    source = mode(lambda x, u: np.array([u[0] - x[0], rate(x), 1.0]), CLOCK)
    assert check(source).status is mg.Status.CERTIFIED


def test_only_states_that_matter_are_relevant() -> None:
    source = mode(lambda x, u: np.array([u[0] - x[0], x[0], 1.0]), CLOCK)
    assert relevant_states(compile_mode(source, None).fields[-1]) == [0]


@pytest.mark.parametrize("size, good", [(0.5, True), (0.9, True), (1.03, False), (1.2, False)])
def test_a_set_that_leaves_is_no_invariant_set(size: float, good: bool) -> None:
    """x' = x^3 - x settles from |x| < 1 only, and starts just outside are slow to leave."""
    c = compile_mode(mode(lambda x, u: np.array([x[0] ** 3 - x[0] + u[0]]), mg.Box([-size], [size])), None)
    order = Order(4, 3)
    flow = Flow(c.fields, c.whole(), c.w_centre, c.w_radius, order, names=c.loop.names)
    assert flow.advance(0.01)
    search = TailSearch(c.fields[-1], flow.piece.chart, c.w_centre, c.w_radius, c.loop.names, order)
    assert isinstance(search.attempt([flow]), Tail) is good


def class_of(width: float) -> Family:
    """The pendulum held at any angle of a class, from starts around that angle."""
    family = pendulum()
    original = family.mode
    held = mg.Mode(
        "held", original.system, controller=original.controller, reference=mg.setpoint(mg.Box([0.2], [0.2 + width])),
        start=lambda r: mg.Ball([r[0], 0.0], 0.05),
    )  # fmt: skip
    return replace(family, mode=held, until=8.0)


def test_a_class_of_references_has_one_invariant_set_for_all() -> None:
    """It holds the equilibria of all of them, so it is at least as wide as they lie apart; or there is none."""
    family = class_of(0.2)
    compiled = compile_mode(family.mode, None)
    flow = Flow(
        compiled.fields, compiled.whole(), compiled.w_centre, compiled.w_radius, Order(4, 3),
        names=compiled.loop.names,
    )  # fmt: skip
    search = TailSearch(
        compiled.fields[-1], flow.piece.chart, compiled.w_centre, compiled.w_radius, flow.names, Order(4, 3)
    )
    found: Tail | TailFailure = TailFailure(Mechanism.DOES_NOT_RETURN)
    while not isinstance(found, Tail) and flow.time < 4.0 and flow.advance(4.0):
        found = search.attempt([flow])
    assert isinstance(found, Tail), found
    assert found.lo[0] <= 0.2
    assert found.hi[0] >= 0.4
    rng = np.random.default_rng(6)
    times = np.array([found.start, 3.0, 5.0, 8.0])
    x = runs(family, references(family, 400, rng), times, rng)
    assert (found.lo[:, None] - 1e-9 <= x).all()
    assert (x <= found.hi[:, None] + 1e-9).all()


def line_class(limit: float = 9.0, gain: Callable[[Any], Any] = lambda r: 1.0) -> mg.Mode:
    """x' = -gain(r) (x - 2 r) + x^2 / 100, held at any r in [-1, 1]."""
    plant = mg.System(lambda x, u: u + 0.01 * x**2, states="x", inputs="u")
    return mg.Mode(
        "held", plant, controller=lambda x, r: -gain(r[0]) * (x - 2.0 * r),
        reference=mg.setpoint(mg.Box([-1.0], [1.0])), start=lambda r: mg.Ball(2.0 * r, 0.1),
        constraints=lambda x: {"high": x[0] <= limit},
    )  # fmt: skip


@pytest.mark.parametrize("cut", [False, True])
def test_the_invariant_set_moves_with_the_equilibria_of_a_class(cut: bool) -> None:
    compiled = compile_mode(line_class(), None)
    order = Order(4, 3)
    whole = compiled.whole()
    pieces = whole.split(whole.variables - 1) if cut else [whole]
    flows = []
    for piece in pieces:
        flow = Flow(compiled.fields, piece, compiled.w_centre, compiled.w_radius, order, names=compiled.loop.names)
        while flow.time < 6.0:
            assert flow.advance(6.0)
        flows.append(flow)
    search = TailSearch(compiled.fields[-1], whole.chart, compiled.w_centre, compiled.w_radius, flows[0].names, order)
    found = search.attempt(flows)
    assert isinstance(found, Tail), found
    # x = 2 p + x^2 / 100 at rest.
    rest = 50.0 * (1.0 - np.sqrt(1.0 - 0.08 * np.array([-1.0, 1.0])))
    assert found.lo[0] <= rest[0] <= rest[1] <= found.hi[0]
    # The sets around the equilibria are small: one around all of them alike would be 4 wide on each side.
    assert found.hi[0] - found.lo[0] <= rest[1] - rest[0] + 0.5


@pytest.mark.parametrize("limit, good", [(2.03, False), (2.15, True)])
def test_a_class_is_safe_for_ever_only_if_its_last_reference_is(limit: float, good: bool) -> None:
    """Starts reach 2.1; the reference p = 1 rests at 2.042."""
    verdict = mg.build([line_class(limit)], horizon=6.0).check("held")
    assert (verdict.status is mg.Status.CERTIFIED) is good


@pytest.mark.parametrize("top, good", [(1.15, False), (0.5, True)])
def test_one_reference_that_does_not_settle_is_enough(top: float, good: bool) -> None:
    """The gain of the reference p = 1 is 1 - top: below 0 it leaves, after the horizon."""
    verdict = mg.build([line_class(9.0, lambda r: 1.0 - top * r * r)], horizon=2.0).check("held")
    assert (verdict.status is mg.Status.CERTIFIED) is good


def test_an_invariant_set_keeps_its_constraints_where_it_begins() -> None:
    """A slow spiral: the set leaves itself before it returns, and is largest in the first state at the beginning."""
    source = mode(
        lambda x, u: np.array([u[0] - 0.1 * x[0] + x[1], -x[0] - 0.1 * x[1]]), mg.Box([-0.5, -0.5], [0.5, 0.5])
    )
    c = compile_mode(source, None)
    flow = c.flow(c.whole(), Order(1, 0))
    assert flow.run(1.0)
    search = TailSearch(c.fields[-1], flow.piece.chart, c.w_centre, c.w_radius, c.loop.names, Order(1, 0))
    tail = search.attempt([flow])
    assert isinstance(tail, Tail)
    # All of the end is in the set: what is proved of the limit x <= 2 is no better than the end itself.
    assert tail.face_upper[0] >= flow.last_set.ranges()[1][0] - 2.0
    assert tail.face_upper[0] >= tail.hi[0] - 2.0 - 1e-9
