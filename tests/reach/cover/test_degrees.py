"""Degrees are as high as their numbers of monomials allow."""

from __future__ import annotations

import pytest

import modegraph as mg
from modegraph.enclosure.monomials import monomial_count
from modegraph.reach.compiled import compile_mode
from modegraph.reach.cover import degrees
from modegraph.reach.cover.degrees import (
    CURVED,
    EXACT,
    PART_LADDER,
    class_orders,
    class_tail_order,
    part_order,
    pipe_orders,
    restart_order,
    start_order,
    tail_order,
)
from modegraph.reach.flow.records import Order
from tests.reach.test_flowpipe import follower, van_der_pol


def test_degrees_rise_only_where_they_are_cheap() -> None:
    found = pipe_orders(compile_mode(van_der_pol(), None, observed=False), 2)
    assert found[0].degree == 8
    assert [o.degree for o in pipe_orders(compile_mode(van_der_pol(), None), 7)] == [3, 4, 6]
    assert [o.degree for o in pipe_orders(compile_mode(follower(mg.setpoint([0.0])), None), 1)] == [1, 4]


def test_a_single_start_needs_one_degree() -> None:
    assert pipe_orders(compile_mode(van_der_pol(), None), 0) == [EXACT]


@pytest.mark.parametrize("variables", range(1, 25))
@pytest.mark.parametrize("effort", range(len(PART_LADDER)))
def test_a_part_has_the_highest_degree_that_is_small(variables: int, effort: int) -> None:
    order = part_order(False, variables, effort)
    top, jacobian = PART_LADDER[effort]
    weights = (1,) * variables
    assert order.jacobian < order.degree <= top
    if order.degree > degrees.LEAST_PART_DEGREE:
        assert monomial_count(weights, order.degree) <= degrees.PART_MONOMIALS
    if order.degree < top:
        assert monomial_count(weights, order.degree + 1) > degrees.PART_MONOMIALS
    if order.jacobian > 1:
        assert monomial_count(weights, order.jacobian) <= degrees.MOST_GENERATOR_MONOMIALS
    if order.jacobian < min(jacobian, order.degree - 1):
        assert monomial_count(weights, order.jacobian + 1) > degrees.MOST_GENERATOR_MONOMIALS


def test_what_is_linear_needs_degree_one() -> None:
    assert part_order(True, 5, 0) == part_order(False, 0, 1) == start_order(True) == tail_order(True) == EXACT
    assert class_tail_order(True, Order(6, 3), 4) == EXACT
    assert min(start_order(False).degree, tail_order(False).degree, CURVED.degree) > 1


def test_a_restart_is_cheap_where_it_has_many_variables() -> None:
    assert [restart_order(m).degree for m in (4, 8, 9, 20)] == [4, 4, 3, 3]


def test_a_candidate_of_a_class_has_the_degree_of_its_flow() -> None:
    assert class_tail_order(False, Order(6, 3, (2, 1)), 2) == Order(6, 3)
    assert class_tail_order(False, Order(6, 4), 6) == Order(4, 3)
    assert class_tail_order(False, Order(6, 3), 40) == Order(3, 2)


def test_weights_leave_room_for_higher_degrees() -> None:
    plain, straight = (class_orders(weights, False, low=False) for weights in ((1,) * 6, (1, 1, 2, 2, 2, 2)))
    assert straight[-1].degree > plain[-1].degree
    assert all(monomial_count(o.weights, o.degree) <= degrees.CLASS_MONOMIALS for o in (*plain, *straight))
    assert class_orders((1, 1), True, low=True) == [Order(5, 3, (1, 1)), Order(6, 3, (1, 1))]
    assert len(class_orders((1,) * 40, False, low=True)) == 1
