"""Which degrees are tried and what is cut, until everything is enclosed to the horizon or nothing more helps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.deadline import Deadline
from modegraph.reach.compiled import compile_mode
from modegraph.reach.cover import cutting as module
from modegraph.reach.cover.cuts import nonlinear_variable
from modegraph.reach.cover.cutting import Cutting
from modegraph.reach.cover.looseness import looseness
from modegraph.reach.failure import Failure, Mechanism
from modegraph.reach.flow.flow import Flow, Order
from modegraph.reach.flowpipe import Flowpipe
from tests.reach.test_flowpipe import escaping, field_mode, van_der_pol, vdp_field
from tests.soundness.families import oscillator


def coupled(b: tuple[float, float]) -> mg.Mode:
    """Two van der Pol oscillators that pull at each other with an unknown constant."""

    def field(x: Any, d: Any) -> Any:
        pull = d["b"] * (x[2] - x[0])
        first, second = vdp_field(x[:2]), vdp_field(x[2:])
        return np.array([first[0], first[1] + pull, second[0], second[1] - pull])

    start = mg.Box([1.25, 2.35] * 2, [1.55, 2.45] * 2)
    return field_mode(field, "x1 y1 x2 y2", start, unknowns={"b": b})


def degrees_tried(monkeypatch: pytest.MonkeyPatch, mode: mg.Mode, horizon: float) -> tuple[Flowpipe, list[int]]:
    seen: list[int] = []

    class Recorded(module.Chain):
        def __init__(self, *args: Any) -> None:
            super().__init__(*args)
            seen.append(self.order.degree)

    monkeypatch.setattr(module, "Chain", Recorded)
    return mg.flowpipe(mode, horizon=horizon), seen


def test_a_cut_that_reaches_the_end_is_kept() -> None:
    """The whole ends at t = 5.63: no part of it can get 5 % further than that within 5.75 s."""
    pipe = mg.flowpipe(coupled((1.0, 3.0)), horizon=5.75)
    assert pipe.complete, pipe.reason
    assert pipe.pieces == 2
    assert pipe.steps > 2


def apart(lo: float) -> mg.Mode:
    """x' = 1 / x and y' = 1 / y, alike."""
    return field_mode(lambda x: np.array([1.0 / x[0], 1.0 / x[1]]), "x y", mg.Box([lo, lo], [2.0, 2.0]))


def test_two_variables_that_need_a_cut_each() -> None:
    """Neither cut alone gets any further."""
    pipe = mg.flowpipe(apart(0.2), horizon=0.3)
    assert pipe.complete, pipe.reason
    assert pipe.pieces == 4


def test_equal_variables_are_cut_in_turn() -> None:
    mode = field_mode(lambda x: -x, "x y z", mg.Box([-1.0] * 3, [1.0] * 3))
    c = compile_mode(mode, None, observed=False)
    piece, cuts = c.whole(), []
    for _ in range(6):
        flow = Flow(c.fields, piece, c.w_centre, c.w_radius, Order(1, 0), names=c.loop.names)
        flow.run(0.5)
        cuts.append(nonlinear_variable(flow))
        piece = piece.split(cuts[-1])[0]
    assert cuts == [0, 1, 2, 0, 1, 2]


def test_a_heavy_degree_is_for_what_is_complete_but_very_loose(monkeypatch: pytest.MonkeyPatch) -> None:
    pipe, tried = degrees_tried(monkeypatch, coupled((1.0, 1.6)), 7.0)
    assert pipe.complete
    assert max(tried) == 6
    pipe, tried = degrees_tried(monkeypatch, coupled((1.0, 1.8)), 7.0)
    assert pipe.complete
    assert max(tried) == 8


def test_a_run_of_low_degree_is_given_up_where_it_is_very_loose(monkeypatch: pytest.MonkeyPatch) -> None:
    ends: dict[int, float] = {}

    class Recorded(module.Chain):
        def run(self, *args: Any) -> bool:
            done = super().run(*args)
            ends[self.order.degree] = self.time
            return done

    monkeypatch.setattr(module, "Chain", Recorded)
    pipe = mg.flowpipe(coupled((0.95, 1.05)), horizon=7.0)
    assert pipe.complete
    assert ends[4] < 7.0
    assert ends[6] == 7.0


def test_cutting_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_PIECES", 1)
    pipe = mg.flowpipe(van_der_pol((0.5, 1.5), (2.0, 3.0)), horizon=3.0)
    assert not pipe.complete
    assert "1 piece of the start set" in pipe.reason


def test_time_that_is_up_cuts_nothing() -> None:
    compiled = compile_mode(apart(0.2), None, observed=False)
    over = Deadline(-1.0)
    chains, why = Cutting(compiled, 0.3, over).run()
    assert len(chains) == 1
    assert why == Failure(Mechanism.NO_MORE_CUTS)
    assert over.met


def test_a_cut_that_gets_no_further_is_undone() -> None:
    """Every part with the largest start escapes at t = 1."""
    compiled = compile_mode(escaping(), None, observed=False)
    chains, why = Cutting(compiled, 2.0).run()
    assert why == Failure(Mechanism.CUTS_DO_NOT_HELP)
    assert min(chain.time for chain in chains) < 1.0


def test_a_loose_class_is_cut_while_that_is_tighter(monkeypatch: pytest.MonkeyPatch) -> None:
    compiled = compile_mode(oscillator().mode, None, observed=False)
    monkeypatch.setattr(module, "is_very_loose", lambda chain: looseness(chain) > 1e-6)
    monkeypatch.setattr(module, "MOST_LOOSE_PIECES", 1)
    (whole,), _ = Cutting(compiled, 0.5).run()
    monkeypatch.setattr(module, "MOST_LOOSE_PIECES", 2)
    halves, why = Cutting(compiled, 0.5).run()
    assert len(halves) == 2
    assert not why
    assert max(map(looseness, halves)) <= module.WORTH_CUTTING * looseness(whole)
    monkeypatch.setattr(module, "WORTH_CUTTING", 0.0)
    assert len(Cutting(compiled, 0.5).run()[0]) == 1
