"""Restricting polynomials to a part of the starts."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

import modegraph as mg
from modegraph.enclosure.monomials import monomials
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.start.piece import whole
from modegraph.reach.start.restriction import Restriction


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


@pytest.mark.parametrize("scale", [1e-150, 1.0, 1e150])
def test_rounding_of_a_restriction_is_counted(scale: float) -> None:
    """At the middle of the part the substitution is nothing but rounding."""
    parent = whole(mg.Box([0, 0], [1, 1]), [])
    table = monomials((1, 1), 4)
    child = parent.split(0)[1].split(1)[0].split(0)[0]
    restriction = Restriction(parent, child, table, table.size)
    middle = [Fraction(float(v)) for v in child.middle]
    rng = np.random.default_rng(1)
    for p in rng.normal(size=(40, table.size)) * scale:
        q, error = restriction.apply(p)
        true = sum(
            Fraction(float(c)) * middle[0] ** int(e[0]) * middle[1] ** int(e[1])
            for c, e in zip(p, table.exponents, strict=True)
        )
        assert abs(true - Fraction(float(q[0]))) <= Fraction(float(error))
