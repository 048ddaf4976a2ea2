"""Random model functions, as an author writes them, enclosed from trace to tape and held against ball arithmetic."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx, fmpq
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import modegraph as mg
from modegraph.reach.compiled import compile_mode
from modegraph.reach.flow.flow import Flow, Order

Tree = tuple[Any, ...]
CONSTANTS = [0.0, -0.0, 5e-324, -1e-310, 2.2250738585072014e-308, 1e-17, 1 / 3, 0.5, 1.0, -2.0, 3.0, 1e8, -1e150, 1e300]
ENDS = [0.0, -0.0, 5e-324, -5e-324, 1e-310, -1e-200, 1e-9, 0.25, 0.5, 1.0, -1.0, -0.3, 1.5, 40.0, -1e3, 1e10, 1e100]
PRECISION = 2500

NUMPY: dict[str, Callable[..., Any]] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "square": lambda a: a**2,
    "cube": lambda a: a**3,
    "neg": lambda a: -a,
    "sin": np.sin,
    "cos": np.cos,
    "exp": np.exp,
    "log": np.log,
    "sqrt": np.sqrt,
    "tanh": np.tanh,
    "arctan": np.arctan,
    "abs": np.abs,
    "maximum": np.maximum,
    "minimum": np.minimum,
    "clip": lambda a: np.clip(a, -0.5, 0.75),
    "where": lambda a, b, c: np.where(a > 0.25, b, c),
}
ARITY = dict.fromkeys(NUMPY, 1) | dict.fromkeys(("add", "sub", "mul", "div", "maximum", "minimum"), 2) | {"where": 3}
LEAVES = st.one_of(
    st.integers(0, 1).map(lambda k: ("x", k)),
    st.one_of(st.sampled_from(CONSTANTS), st.floats(-3, 3)).map(lambda v: ("c", v)),
)


def _grow(inner: st.SearchStrategy[Tree]) -> st.SearchStrategy[Tree]:
    return st.one_of([st.tuples(st.just(name), *[inner] * ARITY[name]) for name in NUMPY])


TREES = st.recursive(LEAVES, _grow, max_leaves=6)


def traced(tree: Tree, x: Any) -> Any:
    if tree[0] == "x":
        return x[tree[1]]
    if tree[0] == "c":
        # Part of the trace, or Python would fold constants in floats before the library sees them.
        return 0.0 * x[0] + tree[1]
    return NUMPY[tree[0]](*(traced(part, x) for part in tree[1:]))


def exact(tree: Tree, x: list[arb]) -> arb | None:
    """The value; None where it is undefined or where the balls cannot tell."""
    name, *parts = tree
    if name == "x":
        return x[parts[0]]
    if name == "c":
        return arb(parts[0])
    values = [exact(part, x) for part in parts]
    if name == "where" and values[0] is not None:
        chosen = values[1] if values[0] > arb(0.25) else values[2] if values[0] <= arb(0.25) else None
        return chosen
    if any(v is None for v in values):
        return None
    a, b = values[0], values[-1]
    domain = {"div": lambda: b != 0, "log": lambda: a > 0, "sqrt": lambda: a >= 0}
    if name in domain and not domain[name]():
        return None
    balls: dict[str, Callable[[], arb]] = {
        "add": lambda: a + b, "sub": lambda: a - b, "mul": lambda: a * b, "div": lambda: a / b,
        "square": lambda: a * a, "cube": lambda: a * a * a, "neg": lambda: -a,
        "sin": lambda: a.sin(), "cos": lambda: a.cos(), "exp": lambda: a.exp(), "log": lambda: a.log(),
        "sqrt": lambda: a.sqrt(), "tanh": lambda: a.tanh(), "arctan": lambda: a.atan(), "abs": lambda: abs(a),
        "maximum": lambda: a.max(b), "minimum": lambda: a.min(b),
        "clip": lambda: a.max(arb(-0.5)).min(arb(0.75)),
    }  # fmt: skip
    value = balls[name]()
    return value if value.is_finite() else None


def ball(v: Fraction) -> arb:
    return arb(fmpq(v.numerator, v.denominator))


def enclosure(tree: Tree, lo: list[float], hi: list[float]) -> tuple[Flow, np.ndarray, float] | None:
    """The flow with its start polynomials, and polynomial and radius of the tree; None where tracing refuses."""
    plant = mg.System(lambda x, u: np.array([traced(tree, x) + 0.0 * x[0], 0.0 * x[1]]), states=2, inputs=1)
    mode = mg.Mode("m", plant, controller=lambda x: 0.0, reference=mg.setpoint([0.0]), start=mg.Box(lo, hi))
    try:
        c = compile_mode(mode, None)
    except mg.ModegraphError:
        return None
    flow = Flow(c.fields, c.whole(), c.w_centre, c.w_radius, Order(3, 2), names=c.loop.names)
    with np.errstate(all="ignore"):
        inputs, radius = flow.variables_at(0.0, flow.set_at(0), c.fields[0])
        p, off, _ = flow.evaluate(c.fields[0].rates, inputs, radius)
    return flow, p[0], float(off[0])


def value(c: np.ndarray, exponents: np.ndarray, xi: tuple[Fraction, ...]) -> Fraction:
    total = Fraction(0)
    for k in np.flatnonzero(c):
        term = Fraction(float(c[k]))
        for v, e in zip(xi, exponents[k], strict=True):
            term *= v ** int(e)
        total += term
    return total


def check(tree: Tree, ends: list[float]) -> None:
    lo, hi = [min(ends[0], ends[1]), min(ends[2], ends[3])], [max(ends[0], ends[1]), max(ends[2], ends[3])]
    found = enclosure(tree, lo, hi)
    if found is None or not np.isfinite(found[2]) or not np.isfinite(found[1]).all():
        return
    flow, p, off = found
    with ctx.workprec(PRECISION):
        for xi in product((Fraction(-1), Fraction(0), Fraction(5, 8), Fraction(1)), repeat=flow.piece.variables):
            x = [value(row, flow.table.exponents, xi) for row in flow.p0]
            true = exact(tree, [ball(v) for v in x])
            if true is not None:
                assert not abs(true - ball(value(p, flow.table.exponents, xi))) > arb(off), (tree, lo, hi, xi)


BOXES = st.lists(st.one_of(st.sampled_from(ENDS), st.floats(-2.0, 2.0)), min_size=4, max_size=4)


def setting(examples: int) -> settings:
    return settings(max_examples=examples, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


@setting(150)
@given(TREES, BOXES)
def test_quick(tree: Tree, ends: list[float]) -> None:
    check(tree, ends)


@pytest.mark.campaign
@setting(20000)
@given(TREES, BOXES)
def test_campaign(tree: Tree, ends: list[float]) -> None:
    check(tree, ends)


@pytest.mark.parametrize("name", NUMPY)
@pytest.mark.parametrize("scale", [5e-324, 1e-310, 1e-160, 1e-9, 0.25, 0.75, 1.0, 30.0, 1e8, 1e160, 1e300])
def test_every_function_at_every_scale(name: str, scale: float) -> None:
    tree = (name, *[("x", 0), ("x", 1), ("mul", ("x", 0), ("x", 1))][: ARITY[name]])
    for sign, share in product((1.0, -1.0), (0.0, 1e-9, 0.5, 1.0, 2.0)):
        ends = sorted([sign * scale, sign * scale * (1.0 - share)])
        check(tree, [*ends, 0.5 * ends[0], ends[1]])
