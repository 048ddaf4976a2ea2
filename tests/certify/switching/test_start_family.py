"""The start sets of a node: formula, exact numbers and floats, and ranges over boxes of references."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.switching.start_family import Functions, start_family
from modegraph.errors import ModegraphError
from modegraph.expression.scalar import Graph
from modegraph.model.sets.rational import RationalSet

PLANE = mg.System(lambda x, u: u, states="x y", inputs="u v")


def mode(start: Any) -> mg.Mode:
    reference = mg.setpoint(mg.Box([0.0, 0.0], [1.0, 1.0]))
    return mg.Mode("m", PLANE, controller=lambda x, r: r - x, reference=reference, start=start)


def test_numbers_that_are_written_are_told_from_those_that_are_computed() -> None:
    found = start_family(mode(lambda r: mg.Box([r[0] - 0.1, -0.05], [r[0] + 0.1, 0.05])), None)
    assert found is not None
    assert found.plain.tolist() == [False, True]
    folded = start_family(mode(lambda r: mg.Box([r[0] - 0.1, (r[1] + 4.0) - r[1]], [r[0], 5.0])), None)
    assert folded is not None
    assert folded.plain.tolist() == [False, False]
    sized = start_family(mode(lambda r: mg.Ball([0.0, 0.0], 1.0 + r[0])), None)
    assert sized is not None
    assert sized.plain.tolist() == [False, False]
    skew = start_family(mode(lambda r: mg.Zonotope([0.0, 0.0], np.array([[1.0, 0.0], [r[0], 1.0]]))), None)
    assert skew is not None
    assert skew.plain.tolist() == [True, False]


def test_the_set_of_the_formula_is_exact() -> None:
    found = start_family(mode(lambda r: mg.Ball([r[0] / 3.0, r[1] ** 2], 0.1 + r[0])), None)
    assert found is not None
    inner = found.exact(np.array([0.1, 0.7]))
    assert isinstance(inner, RationalSet)
    assert inner.centre == [Fraction(0.1) / 3, Fraction(0.7) ** 2]
    assert inner.radius == Fraction(0.1) + Fraction(0.1)
    curved = start_family(mode(lambda r: mg.Ball([np.sin(r[0]), r[1]], 0.1)), None)
    assert curved is not None
    assert curved.exact(np.array([0.1, 0.7])) is None


def test_a_formula_that_floats_spoil_is_an_error() -> None:
    with pytest.raises(ModegraphError, match="computed in floats"):
        start_family(mode(lambda r: mg.Ball((1e12 + r) - 1e12, 1e-6)), None)


@pytest.mark.parametrize("curved", [False, True])
def test_ranges_hold_the_exact_values(curved: bool) -> None:
    graph = Graph()
    x, y = graph.variables(["x", "y"])
    exprs = [x * Fraction(1, 3) - y * Fraction(1, 10) + Fraction(1, 7), y - x]
    if curved:
        exprs[1] = y * x
    functions = Functions(exprs, [x, y])
    assert (functions.line is None) == curved
    rng = np.random.default_rng(0)
    lo = rng.uniform(-1.0, 1.0, (300, 2))
    hi = lo + rng.choice([0.0, 1e-16, 0.1], (300, 1)) * rng.uniform(size=(300, 2))
    low, high = functions.ranges(lo, hi)
    for k, point in enumerate(np.where(rng.uniform(size=lo.shape) < 0.5, lo, hi)):
        a, b = map(Fraction, point.tolist())
        values = [a / 3 - b / 10 + Fraction(1, 7), a * b if curved else b - a]
        assert all(Fraction(s) <= v <= Fraction(t) for s, v, t in zip(low[k], values, high[k], strict=True))
    assert (high - low < 1.0).all()
