"""Bounds of polynomials over pieces of a start set."""

from __future__ import annotations

import numpy as np
import pytest

import modegraph as mg
from modegraph.enclosure.monomials import monomials
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.start import whole


@pytest.mark.parametrize("size", [1.0, 1e-150, 1e-163, 1e-200, 1e-300])
def test_a_linear_form_on_a_ball_is_bounded_at_every_scale(size: float) -> None:
    table = monomials((1, 1), 1)
    bounds = PolynomialBounds(whole(mg.Ball([0.0, 0.0], 1.0), []), table, table.size)
    p = np.zeros(table.size)
    p[table.linear[0]] = size
    assert float(bounds.upper(p)) >= size
