"""Set-points and finite classes."""

import numpy as np
import pytest

import modegraph as mg
from modegraph.errors import ModegraphError
from modegraph.model.reference import ReferenceValue, text_of


def test_one_setpoint():
    reference = mg.setpoint([1.0, 2.0])
    assert reference.dim == 2
    assert reference.is_constant
    assert reference.duration == 0.0
    assert reference.breakpoints == ()
    (p,) = reference.parameters()
    assert p.tolist() == [1.0, 2.0]
    for name in (None, (), [], [1.0, 2.0], (1, 2), np.array([1.0, 2.0])):
        assert reference.match(name) == 0
    assert reference.value(7.0).tolist() == [1.0, 2.0]
    r = reference.at(3.0)
    assert r.dot.tolist() == [0.0, 0.0]
    assert r.ddot.tolist() == [0.0, 0.0]
    assert r.p.tolist() == [1.0, 2.0]


def test_scalar_setpoint():
    reference = mg.setpoint(0.5)
    assert reference.dim == 1
    assert reference.match(0.5) == 0


def test_points():
    reference = mg.setpoint(mg.Points([[0, 0], [1, 0], [0.1, 0.2]]))
    assert [p.tolist() for p in reference.parameters()] == [[0, 0], [1, 0], [0.1, 0.2]]
    assert reference.match([0.1, 0.2]) == 2
    assert reference.value(0.0, [1, 0]).tolist() == [1.0, 0.0]
    with pytest.raises(ModegraphError, match="3 references; name one of them"):
        reference.match(None)
    with pytest.raises(ModegraphError, match=r"\(0.1, 0.3\) names no reference; there is: \(0, 0\), \(1, 0\)"):
        reference.match([0.1, 0.3])
    with pytest.raises(ModegraphError, match="names no reference"):
        reference.match([np.nextafter(0.1, 1), 0.2])
    with pytest.raises(ModegraphError, match="names no reference"):
        reference.match("left")


def test_points_of_one_value():
    assert mg.setpoint(mg.Points([0.0, 1.0])).match(1.0) == 1


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: mg.Points([]), "empty"),
        (lambda: mg.Points(np.zeros((0, 2))), "empty"),
        (lambda: mg.Points([[0, 0], [1]]), "same length"),
        (lambda: mg.Points([[0], [0.0]]), "the same"),
        (lambda: mg.Points([[float("nan")]]), "nan"),
        (lambda: mg.Points(3), "list of points"),
        (lambda: mg.setpoint([]), "empty"),
        (lambda: mg.setpoint([[0, 1]]), "Points"),
        (lambda: mg.setpoint([float("inf")]), "inf"),
        (lambda: mg.setpoint(lambda t: t), "trajectory"),
        (lambda: mg.setpoint(mg.Ball([0], 1)), "not a Ball"),
    ],
)
def test_bad_references(make, words):
    with pytest.raises(ModegraphError) as error:
        make()
    assert words in str(error.value)


def test_a_continuous_class():
    reference = mg.setpoint(mg.Box([0, -1], [1, 1]))
    assert reference.dim == 2
    assert reference.is_constant
    assert reference.region == mg.Box([0, -1], [1, 1])
    p = reference.find([0.25, 1])
    assert p.tolist() == [0.25, 1.0]
    assert not p.flags.writeable
    r = reference.at(3.0, [0.25, 1])
    assert r.tolist() == r.p.tolist() == [0.25, 1.0]
    assert r.dot.tolist() == [0.0, 0.0]
    with pytest.raises(ModegraphError, match="cannot be listed"):
        reference.parameters()


@pytest.mark.parametrize(
    "name, words",
    [
        (None, r"continuous class, \(0, -1\) to \(1, 1\); name one"),
        ((), "name one"),
        ([0.5], "give 2 numbers"),
        (0.5, "give 2 numbers"),
        ([0.5, np.nextafter(1.0, 2.0)], "names no reference; the class is"),
        ([float("nan"), 0.0], "names no reference"),
        ("left", "names no reference"),
    ],
)
def test_what_names_no_reference_of_a_class(name, words):
    with pytest.raises(ModegraphError, match=words):
        mg.setpoint(mg.Box([0, -1], [1, 1])).find(name)


def test_a_finite_class_finds_its_own_points():
    assert mg.setpoint(mg.Points([[0.0], [1.0]])).find(1).tolist() == [1.0]
    assert mg.trajectory(lambda t: t, 1.0).find() is None


def test_too_many_parameters():
    box = mg.Box([0] * 7, [1] * 7)
    with pytest.raises(ModegraphError, match="at most 6 parameters, this Box has 7"):
        mg.setpoint(box)
    with pytest.raises(ModegraphError, match="trajectory: over: a continuous class"):
        mg.trajectory(lambda t, p: p[0] * t, 1.0, over=box)


def test_a_value_keeps_its_derivatives_when_sliced():
    r = ReferenceValue([1, 2, 3], [4, 5, 6], [7, 8, 9], None)
    assert r[1:].dot.tolist() == [5, 6]
    assert r[:2].ddot.tolist() == [7, 8]
    assert r[0] == 1.0
    assert type(r * 2) is np.ndarray
    assert np.concatenate([r, [0.0]]).tolist() == [1, 2, 3, 0]
    assert (r - r.dot).tolist() == [-3, -3, -3]


def test_text():
    assert text_of(None) == ""
    assert text_of([0.5, 1.0]) == "(0.5, 1)"
