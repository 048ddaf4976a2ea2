"""Set-points and finite classes."""

import numpy as np
import pytest

import modegraph as mg
from modegraph.errors import ModegraphError, NotBuiltYet
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


def test_continuous_classes_are_not_built_yet():
    with pytest.raises(NotBuiltYet, match="continuous reference classes"):
        mg.setpoint(mg.Box([0], [1]))


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
