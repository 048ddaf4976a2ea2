"""Rounding constants of the validated arithmetic, each with the bound it rests on.

Every float operation satisfies fl(a op b) = (a op b)(1 + delta) + eta with |delta| <= UNIT and
|eta| <= 2**-1075 (eta only for products and quotients). A sum of products with k roundings on any
path, in any order, fused or not, is off by at most gamma(k) times the sum of the absolute products
(Higham, Accuracy and Stability of Numerical Algorithms, section 3.1).
"""

from __future__ import annotations

import math

UNIT = 2.0**-53

MAX_ROUNDINGS = 2**19
"""No bound in the kernels is computed with more roundings than this on one path."""

MAX_MONOMIALS = 2**14
"""Limit of one monomial table; keeps a sum of absolute coefficients below MAX_ROUNDINGS."""


def gamma(k: int) -> float:
    """gamma_k = k u / (1 - k u), rounded up."""
    ku = k * UNIT
    return math.nextafter(math.nextafter(ku / (1.0 - ku), math.inf), math.inf)


UP = 1.0 + math.nextafter(gamma(MAX_ROUNDINGS + 2), math.inf)
"""Factor that turns a computed sum of non-negative terms into an upper bound.

For a computed value c of an exact non-negative sum s: s <= c (1 + gamma(MAX_ROUNDINGS)); the two
further roundings are those of the multiplication with UP itself.
"""

MAX_PRODUCTS = 2**40
TINY = 2.0**-1034
"""Absolute allowance for gradual underflow: MAX_PRODUCTS products each lose at most 2**-1075 (the
factor 2 covers the rounding of the addition)."""

LIBM = 4.0 * UNIT
"""Allowance for one call of sin, cos, exp, log, atan of the C library, relative to max(1, |value|)
for sin and cos and relative to |value| for the others: 2 ulp. The GNU library documents errors of
at most 1 ulp for these functions on every platform it supports."""
