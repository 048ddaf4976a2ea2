"""Start sets of a class as polynomials: every start of every reference is among their values."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.enclosure.monomials import monomials
from modegraph.model.class_start import StartClass, class_start
from modegraph.model.start import mode_start
from modegraph.reach.start.class_chart import class_chart, parameters_of, require_same_start, start_polynomials
from modegraph.reach.start.piece import Piece
from tests.soundness.sets import starts

REGION = mg.Box([-0.5, 1.0], [0.5, 1.5])
PLANT = mg.System(lambda x, u: np.array([x[1], u[0]]), states="position speed", inputs="force")


def hover(start: Any) -> mg.Mode:
    return mg.Mode("hover", PLANT, controller=lambda x: -x[:1], reference=mg.setpoint(REGION), start=start)


STARTS = {
    "ball": lambda r: mg.Ball([r[0], np.sin(r[1])], 0.1 * r[1]),
    "box": lambda r: mg.Box([r[0] * r[1], 0.3], [r[0] * r[1] + 0.2, 0.3]),
    "zonotope": lambda r: mg.Zonotope(np.exp(r), [[0.1, 0.0, r[0]], [0.2, 0.0, r[1]]]),
    "ellipsoid": lambda r: mg.Ellipsoid(r, np.array([[0.2, 0.05], [0.05, 0.1]])),
}


def piece_of(mode: mg.Mode) -> Piece:
    start = class_start(mode)
    assert isinstance(start, StartClass)
    return Piece.whole(class_chart(start, REGION.lo, REGION.hi))


@pytest.mark.parametrize("name", STARTS)
@pytest.mark.parametrize("order", [1, 3])
def test_every_start_of_every_reference_is_enclosed(name: str, order: int) -> None:
    """For each p: the hull over xi of the polynomials at that p, the box included, holds the starts of p."""
    mode = hover(STARTS[name])
    rng = np.random.default_rng(3)
    whole = piece_of(mode)
    halves = [half for v in range(whole.variables) for half in whole.split(v)]
    table = monomials((1,) * whole.variables, order)
    for p in rng.uniform(REGION.lo, REGION.hi, (12, 2)):
        x = starts(mode_start(mode, p), 40, rng)
        for pieces in ([whole], halves):
            inside = np.zeros(len(x), bool)
            for piece in pieces:
                states, unknowns, slack = start_polynomials(piece, table)
                theta = (p - unknowns[:, 0]) / np.array([unknowns[k, table.linear[v]] for v, k in parameters_of(piece)])
                if (np.abs(theta) > 1.0).any():
                    continue
                m = piece.chart.free
                values = np.prod(theta ** table.exponents[:, m:], axis=1) * states
                body = (table.exponents[:, :m] > 0).any(axis=1)
                centre, radius = values[:, ~body].sum(axis=1), np.abs(values[:, body]).sum(axis=1) + slack
                inside |= (np.abs(x - centre) <= radius * (1 + 1e-12) + 1e-15).all(axis=1)
            assert inside.all()


def test_what_does_not_move_is_no_variable() -> None:
    assert piece_of(hover(STARTS["box"])).chart.free == 1
    assert piece_of(hover(STARTS["zonotope"])).chart.free == 2
    assert piece_of(hover(STARTS["ball"])).chart.free == 2
    assert [k for _, k in parameters_of(piece_of(hover(STARTS["box"])))] == [0, 1]


def test_rounding_of_the_floats_is_allowed_for() -> None:
    """0.1 + r in floats is not the exact sum: the set of one reference sticks out by less than the allowance."""
    mode = hover(lambda r: mg.Ball([0.1 + r[0], r[1] / 3.0], 0.0))
    start = class_start(mode)
    assert isinstance(start, StartClass)
    chart = class_chart(start, REGION.lo, REGION.hi)
    p = np.array([0.3, 1.1])
    require_same_start(start, chart, mode_start(mode, p), p, "mode 'hover(0.3, 1.1)'")
    assert chart.rounded is not None
    tight = replace(chart, rounded=0.0 * chart.rounded)
    with pytest.raises(mg.ModegraphError, match=r"mode 'hover\(0.3, 1.1\)': the start set computed in floats"):
        require_same_start(start, tight, mode_start(mode, p), p, "mode 'hover(0.3, 1.1)'")


def test_floats_that_lose_the_reference_are_found() -> None:
    """(r + 1e20) - 1e20 is r in exact arithmetic, and 0 in floats: two different sets."""
    mode = hover(lambda r: mg.Ball([(r[0] + 1e20) - 1e20, 0.0], 0.1))
    with pytest.raises(mg.ModegraphError, match="rounding changes only its last digits"):
        mg.flowpipe(mode, horizon=0.1)
    # A part of a percent is lost: not for the trace to see, but for the proof.
    pipe = mg.flowpipe(hover(lambda r: mg.Ball([(r[0] + 1e13) - 1e13, 0.0], 0.1)), horizon=0.1)
    with pytest.raises(mg.ModegraphError, match="rounding changes only its last digits"):
        pipe.at(0.0, r=[0.3, 1.0])
    assert pipe.at(0.0, r=[0.0, 1.0]).contains([0.0, 0.0])


def test_another_shape_of_ellipsoid_is_another_set() -> None:
    mode = hover(STARTS["ellipsoid"])
    start = class_start(mode)
    assert isinstance(start, StartClass)
    chart = class_chart(start, REGION.lo, REGION.hi)
    p = np.array([0.0, 1.0])
    for other in (mg.Ellipsoid(p, np.eye(2)), mg.Ball(p, 0.1)):
        with pytest.raises(mg.ModegraphError, match="not that of the formula"):
            require_same_start(start, chart, other, p, "mode 'hover'")


def test_numbers_that_are_largest_inside_the_class_count() -> None:
    plant = mg.System(lambda x, u: u, states="x", inputs="u")
    wave = lambda r: 1000.0 * np.sin(2.0 * np.pi * r)
    mode = mg.Mode(
        "wave", plant, controller=lambda x, r: wave(r) - x, reference=mg.setpoint(mg.Box([0.0], [1.0])),
        start=lambda r: mg.Box(wave(r) - 1e-3, wave(r) + 1e-3),
    )  # fmt: skip
    box = mg.flowpipe(mode, horizon=1.0).at(1.0, [0.25])
    assert box.contains([1000.0])
