"""Which degrees a class of references is given, after a run of low degree."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.enclosure.monomials import monomial_count
from modegraph.reach.compiled import CompiledMode, compile_mode
from modegraph.reach.cover import degrees
from modegraph.reach.cover.chain import Chain
from modegraph.reach.cover.degrees import is_light, pipe_orders
from modegraph.reach.cover.probe import orders_of
from modegraph.reach.flow.records import Order
from tests.reach.test_flowpipe import follower
from tests.soundness.examples import load
from tests.soundness.families import oscillator, pendulum, pushed


def compiled_of(mode: mg.Mode) -> CompiledMode:
    return compile_mode(mode, None, observed=False)


def test_a_class_where_all_is_linear_needs_degree_one() -> None:
    compiled = compiled_of(follower(mg.setpoint(mg.Box([0.0], [1.0]))))
    assert orders_of(compiled, compiled.whole(), 1.0) == [Order(1, 0), Order(4, 3)]


@pytest.mark.parametrize(
    "reference, start",
    [
        (mg.trajectory(lambda t, p: np.sin(p * t), 1.0, over=mg.Box([0.0], [1.0])), mg.Box([0.0], [0.1])),
        (mg.setpoint(mg.Box([0.0], [1.0])), lambda r: mg.Ball(r**2, 0.1)),
        (mg.setpoint(mg.Box([0.0], [1.0])), lambda r: mg.Ball(r, 0.1 + r[0])),
    ],
)
def test_what_is_not_linear_in_the_parameters_needs_more(reference: Any, start: Any) -> None:
    plant = mg.System(lambda x, u: u, states="x", inputs="u")
    mode = mg.Mode("m", plant, controller=lambda x, r: r - x, reference=reference, start=start)
    compiled = compiled_of(mode)
    assert compiled.linear
    assert not compiled.flat
    assert orders_of(compiled, compiled.whole(), 1.0)[0].degree > 2


def test_nearly_straight_variables_count_twice() -> None:
    compiled = compiled_of(oscillator().mode)
    whole = compiled.whole()
    (order,) = orders_of(compiled, whole, 2.5)[-1:]
    assert len(order.weights) == whole.variables
    assert set(order.weights) == {1, 2}
    assert monomial_count(order.weights, order.degree) <= degrees.CLASS_MONOMIALS
    assert is_light(order, whole)


def test_a_class_that_is_tight_at_once_keeps_the_lowest_degree() -> None:
    compiled = compiled_of(pendulum().mode)
    assert orders_of(compiled, compiled.whole(), 0.05) == pipe_orders(compiled, 3)[:1]


def test_a_disturbed_class_has_moderate_degrees() -> None:
    compiled = compiled_of(pushed().mode)
    assert max(o.degree for o in orders_of(compiled, compiled.whole(), 1.0)) <= degrees.MOST_DISTURBED


def test_a_run_for_the_weights_ends_before_it_breaks_down(monkeypatch: pytest.MonkeyPatch) -> None:
    """The remainder of low degree soon feeds itself: hundreds of ever smaller steps would tell nothing more."""
    compiled = compiled_of(load("quadrotor").modes[0])
    probes: list[Chain] = []
    advance = Chain.run

    def run(self: Chain, *arguments: Any) -> bool:
        probes.append(self)
        return advance(self, *arguments)

    monkeypatch.setattr(Chain, "run", run)
    assert set(orders_of(compiled, compiled.whole(), 3.0)[0].weights) == {1, 2}
    (probe,) = probes
    assert not probe.failure
    assert probe.time < 3.0


def test_one_reference_needs_no_probe() -> None:
    compiled = compile_mode(follower(mg.setpoint([0.0])), None, observed=False)
    assert orders_of(compiled, compiled.whole(), 1.0) == pipe_orders(compiled, compiled.whole().variables)
