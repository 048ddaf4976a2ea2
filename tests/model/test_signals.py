"""Ready-made trajectories."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import modegraph as mg
from modegraph.errors import ModegraphError
from modegraph.expression.scalar import Graph
from modegraph.model.trajectory import at_instant

A, B = [0.0, 1.6], [1.0, 0.8]
MAKERS = {
    "quintic": lambda: mg.quintic(A, B, 3.0),
    "minimum_energy": lambda: mg.minimum_energy(A, B, 6.0),
    "minimum_time": lambda: mg.minimum_time(A, B, speed=1.25, acceleration=5.0),
    "triangle": lambda: mg.minimum_time(A, B, speed=10.0, acceleration=5.0),
}


@pytest.mark.parametrize("name", MAKERS)
def test_rest_to_rest(name):
    reference = MAKERS[name]()
    end = reference.duration
    assert reference.value(0.0).tolist() == A
    assert reference.value(end).tolist() == B
    assert reference.at(0.0).dot.tolist() == [0.0, 0.0]
    assert reference.at(end, side="left").dot == pytest.approx([0.0, 0.0], abs=1e-12)
    assert reference.value(end / 2) == pytest.approx([0.5, 1.2])


@pytest.mark.parametrize("name", MAKERS)
def test_ends_are_exact_and_joints_continuous(name):
    graph = Graph()
    time = graph.variable("t")
    pieces = MAKERS[name]().pieces(graph, time, None, "mode 'm'")
    assert [e.value for e in pieces[-1].value] == [Fraction(v) for v in B]
    for left, right in pairwise(pieces):
        at = left.end
        assert [e.value for e in at_instant(left.value, time, at)] == [
            e.value for e in at_instant(right.value, time, at)
        ]


def test_quintic_accelerations_vanish_at_the_ends():
    reference = MAKERS["quintic"]()
    assert reference.at(0.0).ddot.tolist() == [0.0, 0.0]
    assert reference.at(3.0, side="left").ddot == pytest.approx([0.0, 0.0], abs=1e-12)


def test_minimum_energy_is_the_cubic():
    reference = mg.minimum_energy([0.0], [1.0], 2.0)
    assert reference.value(0.5) == pytest.approx([3 * 0.25**2 - 2 * 0.25**3])
    assert reference.at(0.0).ddot == pytest.approx([6 / 4])


def test_minimum_time_of_the_arm():
    reference = MAKERS["minimum_time"]()
    assert reference.duration == pytest.approx(1.05, abs=1e-14)
    assert reference.breakpoints == pytest.approx((0.25, 0.8), abs=1e-14)
    assert reference.at(0.5).dot == pytest.approx([1.25, -1.0])
    assert reference.at(0.1).ddot == pytest.approx([5.0, -4.0])
    assert reference.at(0.25, side="left").ddot == pytest.approx([5.0, -4.0])
    assert reference.at(0.25).ddot.tolist() == [0.0, 0.0]


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.floats(-3, 3), min_size=2, max_size=2),
    st.lists(st.floats(0.1, 5), min_size=2, max_size=2),
    st.floats(0.1, 50),
)
def test_limits_hold_exactly(b, speed, acceleration):
    if max(map(abs, b)) < 1e-6:
        return
    reference = mg.minimum_time([0.0, 0.0], b, speed=speed, acceleration=acceleration)
    graph = Graph()
    time = graph.variable("t")
    for piece in reference.pieces(graph, time, None, "mode 'm'"):
        for k in range(2):
            assert abs(piece.ddot[k].value) <= Fraction(acceleration)
            ends = [piece.start] + ([piece.end] if piece.end < np.inf else [])
        for at in ends:
            for rate, limit in zip(at_instant(piece.dot, time, at), speed, strict=True):
                assert abs(rate.value) <= Fraction(limit)


def test_a_coordinate_that_rests_has_no_say():
    reference = mg.minimum_time([0, 1], [1, 1], speed=[1, 1e-9], acceleration=[1, 1e-9])
    assert reference.duration == pytest.approx(2.0)


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: mg.minimum_time([0], [0], speed=1, acceleration=1), "same point"),
        (lambda: mg.minimum_time([0], [1], speed=0, acceleration=1), "speed must be > 0"),
        (lambda: mg.minimum_time([0, 0], [1, 1], speed=[1, 1, 1], acceleration=1), "one number or 2"),
        (lambda: mg.quintic([0, 0], [1], 1.0), "same number"),
        (lambda: mg.quintic([0], [1], -1.0), "duration must be > 0"),
        (lambda: mg.minimum_energy([float("nan")], [1], 1.0), "nan"),
    ],
)
def test_bad_signals(make, words):
    with pytest.raises(ModegraphError) as error:
        make()
    assert words in str(error.value)
