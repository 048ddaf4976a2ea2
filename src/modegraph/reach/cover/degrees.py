"""Every choice of the degrees of a flowpipe.

Polynomials over a set of many variables grow fast: a choice weighs what a degree makes tighter against the number of
its monomials.
"""

from __future__ import annotations

from modegraph.enclosure.monomials import monomial_count
from modegraph.reach.compiled import CompiledMode
from modegraph.reach.flow.records import Order
from modegraph.reach.start.piece import Piece

EXACT = Order(1, 0)
"""Of what is affine in all set variables, and of a single trajectory, which has none."""
CURVED = Order(4, 3)
"""Of an affine flow of which something curved is asked: constraints, or what must be defined."""
TOUCHED = Order(4, 2)
"""Of a flow that is looked at at its start alone."""
RETURNING = Order(3, 2)
"""Of a candidate for an invariant set, which is small and runs for long."""

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

PART_LADDER = ((4, 3), (5, 4))
"""Of a part that is explored for a proof: first try, and second try where the first breaks down."""
PART_MONOMIALS, LEAST_PART_DEGREE = 1300, 3

AFTER_RESTART, CHEAP_AFTER_RESTART, RESTART_MONOMIALS = Order(4, 3), Order(3, 2), 500
"""After a restart, if the first makes at most so many monomials, or else."""

CLASS_TAIL_MONOMIALS, LEAST_CLASS_TAIL = 400, 3
"""Of a candidate for an invariant set of a class."""


def pipe_orders(compiled: CompiledMode, variables: int) -> list[Order]:
    """Degrees to try for a flowpipe of a piece with so many variables, lowest first."""
    if variables == 0:
        return [EXACT]
    if compiled.flat:
        # What must be defined, and the constraints, may be curved all the same.
        return [EXACT, CURVED]
    found: list[Order] = []
    for degree, jacobian in LADDER:
        if found and degree > MOST_DISTURBED and compiled.w_radius.any():
            break
        count = monomial_count((1,) * variables, degree)
        if found and count > MOST_HEAVY_MONOMIALS:
            break
        order = Order(degree, _fitting(jacobian, (1,) * variables, MOST_GENERATOR_MONOMIALS))
        if count <= LIGHT_MONOMIALS and degree <= MOST_LIGHT:
            found = [order]
        else:
            found.append(order)
    return found


def class_orders(weights: tuple[int, ...], disturbed: bool, low: bool) -> list[Order]:
    """Degrees to try for a flowpipe of a class of references with these weights of the variables.

    One reference's set is a small part of all, so they are high; ``low``: the lowest may be enough.
    """
    rungs: list[Order] = []
    for degree, jacobian in CLASS_LADDER:
        if rungs and (monomial_count(weights, degree) > CLASS_MONOMIALS or (disturbed and degree > MOST_DISTURBED)):
            break
        rungs.append(Order(degree, _fitting(jacobian, weights, CLASS_GENERATOR_MONOMIALS), weights))
    return [rungs[0], rungs[-1]] if low and len(rungs) > 1 else rungs[-2:]


def is_light(order: Order, piece: Piece) -> bool:
    """Whether a degree is tried also where the one below it is complete and not very loose."""
    count = monomial_count(order.weights or (1,) * piece.variables, order.degree)
    return count <= (CLASS_MONOMIALS if piece.chart.parameters else MOST_MONOMIALS)


def part_order(linear: bool, variables: int, effort: int) -> Order:
    """Of a part of the starts that is explored for a proof; ``effort``: its place in PART_LADDER."""
    if linear or variables == 0:
        return EXACT
    degree, jacobian = PART_LADDER[effort]
    degree = _fitting(degree, (1,) * variables, PART_MONOMIALS, LEAST_PART_DEGREE)
    jacobian = _fitting(jacobian, (1,) * variables, MOST_GENERATOR_MONOMIALS)
    return Order(degree, min(jacobian, degree - 1))


def start_order(linear: bool) -> Order:
    """Of a flow that is looked at at its start alone."""
    return EXACT if linear else TOUCHED


def restart_order(variables: int) -> Order:
    """Of a flow from an enclosure of the end of another."""
    count = monomial_count((1,) * variables, AFTER_RESTART.degree)
    return AFTER_RESTART if count <= RESTART_MONOMIALS else CHEAP_AFTER_RESTART


def tail_order(linear: bool) -> Order:
    """Of a candidate for an invariant set."""
    return EXACT if linear else RETURNING


def class_tail_order(linear: bool, order: Order, variables: int) -> Order:
    """Of a candidate for an invariant set of a class whose flow has degrees ``order``.

    As high as the flow's, within a size; a candidate set may have fewer variables, so no weights.
    """
    if linear:
        return EXACT
    degree = _fitting(order.degree, (1,) * variables, CLASS_TAIL_MONOMIALS, LEAST_CLASS_TAIL)
    return Order(degree, min(degree - 1, order.jacobian))


def _fitting(degree: int, weights: tuple[int, ...], most: int, least: int = 1) -> int:
    """The highest degree up to ``degree`` with at most so many monomials, at least ``least``."""
    while degree > least and monomial_count(weights, degree) > most:
        degree -= 1
    return degree
