"""Float evaluation of a tape."""

import numpy as np
import pytest

from modegraph.expression import Evaluator, Graph, compile_tape


def test_shapes() -> None:
    x, y = Graph().variables("xy")
    f = Evaluator(compile_tape([x + y, x * y, x.graph.constant(2)], [x, y]))
    assert f(np.array([[1.0, 2.0], [3.0, 4.0]])).tolist() == [[4, 6], [3, 8], [2, 2]]
    assert f(np.array([1.0, 3.0])).tolist() == [4, 3, 2]
    assert f(np.empty((2, 0))).shape == (3, 0)
    with pytest.raises(ValueError, match="2 variables"):
        f(np.zeros((3, 1)))


def test_undefined_is_nan() -> None:
    x, y = Graph().variables("xy")
    f = Evaluator(compile_tape([1 / x, np.log(x), np.sqrt(x), np.arctan2(y, x), np.tanh(1e3 * x)], [x, y]))
    got = f(np.array([[0.0, -1.0, 1.0], [0.0, 0.0, 0.0]]))
    assert np.isnan(got[:4, 0]).all()
    assert np.isnan(got[1:4, 1]).all()
    assert got[:, 2].tolist() == [1, 0, 1, 0, 1]
    assert got[4].tolist() == [0, -1, 1]


def test_nan_does_not_choose_a_branch() -> None:
    x = Graph().variable("x")
    f = Evaluator(compile_tape([np.where(np.log(x) > 0, 1.0, 2.0), np.sign(x), np.maximum(1 / x, 0.0)], [x]))
    assert np.isnan(f(np.array([-1.0]))[0])
    assert np.isnan(f(np.array([0.0]))[2])
    assert f(np.array([[-3.0, 0.0, 3.0]]))[1].tolist() == [-1, 0, 1]


def test_without_variables() -> None:
    g = Graph()
    f = Evaluator(compile_tape([g.constant(2)], []))
    assert f(np.empty((0, 1))).tolist() == [[2.0]]
