"""Elementary functions of traced scalars, lowered to the primitives of the tape at construction.

Each lowering is an identity of real numbers on its domain; where the original is undefined or not
differentiable, so is a primitive of the lowering (a reciprocal at zero, a logarithm at or below zero).
"""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

from modegraph.errors import ModegraphError
from modegraph.expression.graph import rational_root

if TYPE_CHECKING:
    from modegraph.expression.scalar import Expr

HALF = Fraction(1, 2)


def _make(a: Expr, index: int) -> Expr:
    return type(a)(a.graph, index)


def sin(a: Expr) -> Expr:
    """Sine (radians)."""
    return _make(a, a.graph.sin(a.index))


def cos(a: Expr) -> Expr:
    """Cosine (radians)."""
    return _make(a, a.graph.cos(a.index))


def tan(a: Expr) -> Expr:
    """sin a / cos a."""
    g = a.graph
    note = f"tan({a.text(50)}) reaches a pole"
    return _make(a, g.mul(g.sin(a.index), g.recip(g.cos(a.index), note)))


def exp(a: Expr) -> Expr:
    """Exponential."""
    return _make(a, a.graph.exp(a.index))


def expm1(a: Expr) -> Expr:
    """exp a - 1."""
    return exp(a) - 1


def log(a: Expr) -> Expr:
    """Natural logarithm, a > 0."""
    return _make(a, a.graph.log(a.index))


def log1p(a: Expr) -> Expr:
    """log(1 + a)."""
    return log(a + 1)


def log10(a: Expr) -> Expr:
    """Decimal logarithm."""
    return log(a) / log(a.graph.constant(10))


def log2(a: Expr) -> Expr:
    """Binary logarithm."""
    return log(a) / log(a.graph.constant(2))


def sqrt(a: Expr) -> Expr:
    """exp(log(a) / 2): differentiable, hence defined, for a > 0 only."""
    return _make(a, a.graph.square_root(a.index, f"sqrt({a.text(50)}) needs a positive argument"))


def cbrt(a: Expr) -> Expr:
    """Cube root of a positive number."""
    return power(a, a.graph.constant(Fraction(1, 3)))


def power(a: Expr, p: Expr) -> Expr:
    """a ** p: products for integer p; exp(p log a), a > 0, otherwise."""
    g = a.graph
    exponent = g.value(p.index)
    if exponent is None:
        base = g.value(a.index)
        if base is not None and base <= 0:
            raise ModegraphError(f"{float(base):g} ** ({p.text(40)}) is not smooth; make the base positive")
        return exp(p * log(a))
    if exponent.denominator == 1:
        n = exponent.numerator
        if n == 0:
            g.drop(a.index)
            return g.constant(1)
        base_index = a.index if n > 0 else g.recip(a.index)
        return _make(a, g.power(base_index, abs(n)))
    if exponent == HALF:
        return sqrt(a)
    value = g.value(a.index)
    if value is not None and value >= 0 and exponent.denominator == 2 and exponent > 0:
        root = rational_root(value)
        if root is not None:
            return g.constant(root**exponent.numerator)
    note = f"({a.text(40)}) ** {float(exponent):g} needs a positive base"
    return _make(a, g.exp(g.scale(g.log(a.index, note), exponent)))


def tanh(a: Expr) -> Expr:
    """1 - 2 / (1 + exp(2 a))."""
    return 1 - 2 / (exp(2 * a) + 1)


def sinh(a: Expr) -> Expr:
    """(exp a - exp -a) / 2."""
    return (exp(a) - exp(-a)) / 2


def cosh(a: Expr) -> Expr:
    """(exp a + exp -a) / 2."""
    return (exp(a) + exp(-a)) / 2


def arctan(a: Expr) -> Expr:
    """Inverse tangent."""
    return _make(a, a.graph.atan(a.index))


def arcsin(a: Expr) -> Expr:
    """arctan(a / sqrt(1 - a^2)), |a| < 1."""
    return arctan(a / sqrt(1 - a * a))


def arccos(a: Expr) -> Expr:
    """Not built: it needs an exact pi."""
    raise ModegraphError(f"np.arccos({a.text(40)}) is not supported; use np.arctan2(np.sqrt(1 - a**2), a)")


def arctan2(y: Expr, x: Expr) -> Expr:
    """2 arctan(y / (sqrt(x^2 + y^2) + x)): undefined exactly on the cut y = 0, x <= 0."""
    g = y.graph
    abscissa = g.value(x.index)
    if abscissa is not None and abscissa > 0:
        return arctan(y / x)
    note = f"arctan2({y.text(30)}, {x.text(30)}) reaches its cut (y = 0, x <= 0)"
    radius = g.square_root(g.add(g.sqr(x.index), g.sqr(y.index)), note)
    ratio = g.mul(y.index, g.recip(g.add(radius, x.index), note))
    return 2 * arctan(_make(y, ratio))


def hypot(x: Expr, y: Expr) -> Expr:
    """sqrt(x^2 + y^2)."""
    return sqrt(x * x + y * y)


def relu(a: Expr) -> Expr:
    """max(a, 0)."""
    return _make(a, a.graph.relu(a.index))


def absolute(a: Expr) -> Expr:
    """2 relu(a) - a."""
    return _make(a, a.graph.absolute(a.index))


def maximum(a: Expr, b: Expr) -> Expr:
    """b + relu(a - b)."""
    return _make(a, a.graph.maximum(a.index, b.index))


def minimum(a: Expr, b: Expr) -> Expr:
    """a - relu(a - b)."""
    return _make(a, a.graph.minimum(a.index, b.index))


def sign(a: Expr) -> Expr:
    """-1, 0 or 1; discontinuous."""
    g = a.graph
    one, zero, minus = g.number(Fraction(1)), g.number(Fraction(0)), g.number(Fraction(-1))
    return _make(a, g.where(a.index, one, g.where(g.neg(a.index), minus, zero)))
