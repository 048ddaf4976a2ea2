"""Parameters put into the polynomials of a flow."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

import modegraph as mg
from modegraph.reach.compiled import compile_mode
from modegraph.reach.cover.chain import Chain
from modegraph.reach.flow.flow import Flow, Order
from modegraph.reach.reach_set import ReachSet
from modegraph.reach.start.class_chart import parameters_of, scale_of
from modegraph.reach.start.piece import Piece
from modegraph.reach.start.substitution import Substitution, holds
from tests.soundness.families import oscillator

P = np.array([0.61, 0.17])


def flow_of(piece: Piece | None = None) -> Flow:
    compiled = compile_mode(oscillator().mode, None, observed=False)
    chain = Chain(compiled, piece or compiled.whole(), Order(4, 2))
    assert chain.run(0.5)
    return chain.flows[0]


def test_the_polynomial_with_the_parameters_fixed() -> None:
    flow = flow_of()
    p = flow.steps[-1].p
    one = Substitution(flow.bounds, P)(ReachSet.of(flow.bounds, p))
    fixed, out = one.p, one.box
    exponents = flow.bounds.exponents
    variables = [v for v, _ in parameters_of(flow.piece)]
    assert not fixed[:, (exponents[:, variables] > 0).any(axis=1)].any()
    eta = np.random.default_rng(0).uniform(-1.0, 1.0, (50, flow.piece.variables))
    for v, k in parameters_of(flow.piece):
        centre, radius = scale_of(flow.piece, v)
        eta[:, v] = (P[k] - centre) / radius
    powers = np.prod(eta[:, None, :] ** exponents, axis=2)
    apart = np.abs(powers @ p.T - powers @ fixed.T)
    assert (apart <= out + 1e-14).all()
    assert (out < 1e-11).all()


def test_rounding_is_in_the_box() -> None:
    """Against exact arithmetic, coefficient by coefficient."""
    flow = flow_of()
    p = flow.steps[-1].p
    one = Substitution(flow.bounds, P)(ReachSet.of(flow.bounds, p))
    fixed, out = one.p, one.box
    exponents = flow.bounds.exponents
    factor = [Fraction(1)] * len(exponents)
    rest = exponents.copy()
    for v, k in parameters_of(flow.piece):
        centre, radius = scale_of(flow.piece, v)
        eta = (Fraction(float(P[k])) - Fraction(centre)) / Fraction(radius)
        factor = [f * eta ** int(e[v]) for f, e in zip(factor, exponents, strict=True)]
        rest[:, v] = 0
    for row, found, room in zip(p, fixed, out, strict=True):
        exact: dict[tuple[int, ...], Fraction] = {}
        for c, f, e in zip(row, factor, rest.tolist(), strict=True):
            exact[tuple(e)] = exact.get(tuple(e), Fraction(0)) + Fraction(float(c)) * f
        given = {tuple(e): Fraction(float(c)) for c, e in zip(found, exponents.tolist(), strict=True)}
        apart = sum(abs(exact.get(e, Fraction(0)) - c) for e, c in given.items())
        assert 0 < apart <= Fraction(float(room))


def test_the_end_of_the_class_is_in_it() -> None:
    flow = flow_of()
    region = oscillator().region
    for p in (region.lo, region.hi, np.array([region.lo[0], region.hi[1]])):
        assert holds(flow.piece, p)
        assert Substitution(flow.bounds, p)(flow.set_at(0)).p.any()
    assert not holds(flow.piece, np.nextafter(region.hi, 2.0) + 1e-15)


def test_pieces_share_their_border() -> None:
    compiled = compile_mode(oscillator().mode, None, observed=False)
    whole = compiled.whole()
    variable, k = parameters_of(whole)[0]
    low, high = whole.split(variable)
    middle = oscillator().region.center
    assert holds(low, middle)
    assert holds(high, middle)
    for p in np.random.default_rng(1).uniform(oscillator().region.lo, oscillator().region.hi, (50, 2)):
        assert holds(low, p) or holds(high, p)
        assert holds(low, p) == (p[k] <= middle[k])


def test_a_class_of_one_value_has_no_variable() -> None:
    plant = mg.System(lambda x, u: u - x, states="x", inputs="u")
    mode = mg.Mode(
        "m", plant, controller=lambda x, r: r[:1] * r[1], reference=mg.setpoint(mg.Box([1.0, 0.0], [1.0, 1.0])),
        start=lambda r: mg.Box(r[:1], r[:1] + 1.0),
    )  # fmt: skip
    pipe = mg.flowpipe(mode, horizon=1.0)
    box = pipe.at(1.0, r=[1.0, 0.5])
    exact = 0.5 + (np.array([1.0, 2.0]) - 0.5) * np.exp(-1.0)
    assert box.lo[0] <= exact[0] <= box.lo[0] + 1e-6
    assert box.hi[0] - 1e-6 <= exact[1] <= box.hi[0]
