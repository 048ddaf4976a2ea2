"""Time-varying references: pieces, one-sided values, what is held afterwards."""

import math
from fractions import Fraction

import numpy as np
import pytest

import modegraph as mg
from modegraph.errors import ModegraphError
from modegraph.expression.scalar import Graph


def ramp(t):
    return np.array([np.where(t < 1.0, t, 2.0 * t - 1.0), np.sin(t)])


def test_keeps_what_it_was_given():
    reference = mg.trajectory(ramp, 2.0, breakpoints=(1.0,))
    assert reference.signal is ramp
    assert reference.duration == 2.0
    assert reference.breakpoints == (1.0,)
    assert reference.over is None
    assert reference.dim == 2
    assert not reference.is_constant
    assert reference.parameters() == [None]
    assert reference.match(()) == reference.match(None) == 0


def test_values_and_one_sided_derivatives():
    reference = mg.trajectory(ramp, 2.0, breakpoints=(1.0,))
    assert reference.value(0.5) == pytest.approx([0.5, math.sin(0.5)])
    assert reference.at(1.0).dot[0] == 2.0
    assert reference.at(1.0, side="left").dot[0] == 1.0
    assert reference.at(2.0, side="left").dot == pytest.approx([2.0, math.cos(2.0)])
    assert reference.at(2.0).dot.tolist() == [0.0, 0.0]
    assert reference.at(2.0).ddot.tolist() == [0.0, 0.0]
    assert reference.value(50.0) == pytest.approx([3.0, math.sin(2.0)])
    assert reference.at(0.3).ddot == pytest.approx([0.0, -math.sin(0.3)])
    with pytest.raises(ModegraphError, match="starts at t = 0"):
        reference.value(-0.1)


def test_a_jump_at_the_end_is_held_from_the_left():
    reference = mg.trajectory(lambda t: np.where(t < 1.0, 5.0, 7.0), 1.0)
    assert reference.value(1.0).tolist() == [5.0]
    assert reference.value(0.0).tolist() == [5.0]


def test_jump_inside():
    reference = mg.trajectory(lambda t: np.where(t <= 1.0, 5.0, 7.0), 2.0, breakpoints=[1.0])
    assert reference.value(1.0).tolist() == [7.0]
    assert reference.at(1.0, side="left").tolist() == [5.0]


def test_parameters():
    reference = mg.trajectory(lambda t, p: p[:1] + p[1] * t, 1.0, over=mg.Points([[0, 1], [2, 3]]))
    assert [p.tolist() for p in reference.parameters()] == [[0, 1], [2, 3]]
    assert reference.match([2, 3]) == 1
    assert reference.value(0.5, [2, 3]).tolist() == [3.5]
    assert reference.at(0.0, [0, 1]).p.tolist() == [0.0, 1.0]


def test_the_held_value_is_exact():
    graph = Graph()
    pieces = mg.trajectory(lambda t: t / 3.0, 0.1).pieces(graph, graph.variable("t"), None, "mode 'm'")
    assert pieces[-1].value[0].value == Fraction(0.1) / 3
    assert (pieces[0].start, pieces[0].end, pieces[1].end) == (0.0, 0.1, math.inf)


def test_pieces_of_a_continuous_where_are_polynomials():
    graph = Graph()
    signal = lambda t: np.where(t < 1.0, t**2, 2.0 * t - 1.0)
    pieces = mg.trajectory(signal, 2.0, breakpoints=[1.0]).pieces(graph, graph.variable("t"), None, "mode 'm'")
    assert [piece.value[0].text() for piece in pieces] == ["t**2", "2*t - 1", "3"]
    assert [piece.ddot[0].text() for piece in pieces] == ["2", "0", "0"]


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: mg.trajectory(3, 1.0), "must be a function"),
        (lambda: mg.trajectory(ramp, 0.0), "must be > 0"),
        (lambda: mg.trajectory(ramp, float("inf")), "finite"),
        (lambda: mg.trajectory(ramp, "soon"), "finite"),
        (lambda: mg.trajectory(ramp, 1.0, over=[[0]]), "Points"),
        (lambda: mg.trajectory(ramp, 1.0, breakpoints=[2.0]), "outside"),
        (lambda: mg.trajectory(ramp, 1.0, breakpoints=[float("nan")]), "outside"),
        (lambda: mg.trajectory(ramp, 1.0, breakpoints=0.5), "sequence"),
        (lambda: mg.trajectory(lambda t, q: t, 1.0).dim, "'q'"),
        (lambda: mg.trajectory(lambda t: [], 1.0).dim, "no value"),
        (lambda: mg.trajectory(lambda t: [float("nan")], 1.0).dim, "nan"),
        (lambda: mg.trajectory(lambda t: math.sin(t), 1.0).dim, "np.sin"),
    ],
)
def test_bad_trajectories(make, words):
    with pytest.raises(ModegraphError) as error:
        make()
    assert words in str(error.value)


def test_a_continuous_class():
    signal = lambda t, p: np.array([p[0] * t + p[1]])
    reference = mg.trajectory(signal, 2.0, over=mg.Box([0, 1], [1, 2]))
    listed = mg.trajectory(signal, 2.0, over=mg.Points([[0.3, 1.5]]))
    assert reference.dim == 1
    assert reference.region == mg.Box([0, 1], [1, 2])
    here, there = reference.at(0.7, [0.3, 1.5]), listed.at(0.7, [0.3, 1.5])
    assert (here.tolist(), here.dot.tolist(), here.p.tolist()) == (there.tolist(), there.dot.tolist(), there.p.tolist())
    with pytest.raises(ModegraphError, match="continuous class"):
        reference.at(0.0)
    with pytest.raises(ModegraphError, match="names no reference"):
        reference.at(0.0, [2.0, 1.0])
    for k in range(200):
        reference.at(1.0, [k / 200, 1.0])


def test_a_class_is_traced_with_its_parameters():
    graph = Graph()
    time, p = graph.variable("t"), graph.variables(["p[0]", "p[1]"])
    signal = lambda t, p: np.where(t < 1.0, p[0] * t**2, p[0] * (2.0 * t - 1.0)) + p[1]
    reference = mg.trajectory(signal, 2.0, over=mg.Box([0, 0], [1, 1]), breakpoints=[1.0])
    pieces = reference.pieces(graph, time, p, "mode 'm'")
    assert [piece.ddot[0].text() for piece in pieces] == ["2*p[0]", "0", "0"]
    assert pieces[-1].value[0].text() == "p[1] + 3*p[0]"
    assert [(piece.start, piece.end) for piece in pieces] == [(0.0, 1.0), (1.0, 2.0), (2.0, math.inf)]
