"""Restricting polynomials to a part of the starts."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

import modegraph as mg
from modegraph.enclosure.monomials import monomials
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.cells import Restriction
from modegraph.reach.start import whole


@pytest.mark.parametrize("scale", [1e-150, 1.0, 1e150])
@pytest.mark.parametrize("start", [mg.Box([0, 0], [1, 1]), mg.Ball([0, 0], 1.0), mg.Box([0, 1], [1, 1])])
def test_a_restricted_polynomial_is_the_same_function(start: mg.Box, scale: float) -> None:
    parent = whole(start, [])
    table = monomials((1,) * parent.variables, 3)
    rng = np.random.default_rng(0)
    for variable in range(parent.variables):
        for child in parent.split(variable):
            for grandchild in child.split(0):
                restriction = Restriction(parent, grandchild, table, table.size)
                p = rng.normal(size=(3, table.size)) * scale
                q, error = restriction.apply(p)
                top = PolynomialBounds(grandchild, table, table.size).upper(q) + error
                for _ in range(20):
                    eta = rng.uniform(grandchild.lo, grandchild.hi)
                    if start.__class__ is mg.Ball and eta @ eta > 1.0:
                        continue
                    powers = [
                        np.prod([Fraction(float(e)) ** int(k) for e, k in zip(eta, a, strict=True)])
                        for a in table.exponents
                    ]
                    for row, bound in zip(p, top, strict=True):
                        assert sum(Fraction(float(c)) * x for c, x in zip(row, powers, strict=True)) <= Fraction(
                            float(bound)
                        )
