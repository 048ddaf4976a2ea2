"""Degrees of a flowpipe: which to try, lowest first."""

from __future__ import annotations

import numpy as np

from modegraph.enclosure.monomials import monomial_count
from modegraph.reach.compiled import CompiledMode
from modegraph.reach.cover.chain import Chain
from modegraph.reach.cover.looseness import is_loose, is_very_loose
from modegraph.reach.flow.flow import Order
from modegraph.reach.start.piece import Piece

LADDER = ((3, 1), (4, 3), (6, 3), (8, 4), (10, 4))
"""Degrees of p and of the Jacobian flow; higher ones are tried where lower ones are loose or break down."""
LIGHT_MONOMIALS, MOST_LIGHT = 130, 8
"""The first degree tried is the highest with at most so many monomials, up to this: they cost nothing."""
MOST_MONOMIALS, MOST_GENERATOR_MONOMIALS = 500, 100
MOST_HEAVY_MONOMIALS = 2000
"""A degree with more than the first number is tried only where one below is complete but very loose."""
MOST_DISTURBED = 6
"""Highest degree with a disturbance: there the remainder is what the disturbance adds."""
CLASS_LADDER = ((5, 3), (6, 3), (7, 4), (8, 4), (9, 4), (10, 4))
CLASS_MONOMIALS, CLASS_GENERATOR_MONOMIALS = 1600, 200
"""Of a class of references the first of these degrees is tried, and the highest with at most so many monomials."""
FEEDING = 0.5
"""Share of a remainder that comes from itself, at which the run that only finds the weights has shown enough."""
STRAIGHT = 0.2
"""A variable counts twice where its nonlinear terms are smaller than this, relative to the geometric mean."""


CURVED = 4
"""Degree of a linear loop with curved constraints."""


def orders(compiled: CompiledMode, variables: int) -> list[Order]:
    """Degrees to try for a piece with so many variables, lowest first. Where all is linear, degree 1 is enough."""
    if variables == 0:
        return [Order(1, 0)]
    if compiled.flat:
        # What must be defined, and the constraints, may be curved all the same.
        return [Order(1, 0), Order(CURVED, CURVED - 1)]
    found: list[Order] = []
    for degree, jacobian in LADDER:
        if found and degree > MOST_DISTURBED and compiled.w_radius.any():
            break
        count = monomial_count((1,) * variables, degree)
        if found and count > MOST_HEAVY_MONOMIALS:
            break
        while jacobian > 1 and monomial_count((1,) * variables, jacobian) > MOST_GENERATOR_MONOMIALS:
            jacobian -= 1
        order = Order(degree, jacobian)
        if count <= LIGHT_MONOMIALS and degree <= MOST_LIGHT:
            found = [order]
        else:
            found.append(order)
    return found


def class_orders(compiled: CompiledMode, piece: Piece, end: float) -> list[Order]:
    """Degrees to try for a class of references: one reference's set is a small part of all, so they are high.

    A run of low degree shows in which variables the flow is nearly straight: those count twice.
    """
    found = orders(compiled, piece.variables)
    if compiled.flat or len(found) == 1:
        return found
    probe = Chain(compiled, piece, found[0])
    disturbed = bool(compiled.w_radius.any())
    done = probe.run(end, _feeds_itself if disturbed else None)
    if done and not disturbed and not is_loose(probe):
        return found[:1]
    weights = _weights(probe)
    rungs: list[Order] = []
    for degree, jacobian in CLASS_LADDER:
        if rungs and (monomial_count(weights, degree) > CLASS_MONOMIALS or (disturbed and degree > MOST_DISTURBED)):
            break
        while jacobian > 1 and monomial_count(weights, jacobian) > CLASS_GENERATOR_MONOMIALS:
            jacobian -= 1
        rungs.append(Order(degree, jacobian, weights))
    low = disturbed or (done and not is_very_loose(probe))
    return [rungs[0], rungs[-1]] if low and len(rungs) > 1 else rungs[-2:]


def _feeds_itself(chain: Chain) -> bool:
    """Whether the remainder of a disturbed flow comes mostly from itself: it is about to break down in small steps."""
    return chain.flows[-1].feedback > FEEDING


def _weights(chain: Chain) -> tuple[int, ...]:
    flow = chain.flows[0]
    exponents = flow.bounds.exponents
    share = np.zeros(flow.piece.variables)
    for step in flow.steps:
        size = np.abs(step.p)
        scale = np.maximum(size[:, 1:].sum(axis=1), 1e-300)
        for v in range(len(share)):
            share[v] = max(share[v], float((size[:, exponents[:, v] > 1].sum(axis=1) / scale).max()))
    typical = np.exp(np.log(np.maximum(share, 1e-12)).mean())
    return tuple(np.where(share < STRAIGHT * typical, 2, 1).tolist())


def is_light(order: Order, piece: Piece) -> bool:
    """Whether a degree is tried also where the one below it is complete and not very loose."""
    count = monomial_count(order.weights or (1,) * piece.variables, order.degree)
    return count <= (CLASS_MONOMIALS if piece.chart.parameters else MOST_MONOMIALS)
