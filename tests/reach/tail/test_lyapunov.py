"""Ellipsoids proposed by the semidefinite program."""

import numpy as np

from modegraph.reach.tail.lyapunov import shrinking_ellipsoid


def test_it_shrinks_along_every_slope_and_holds_the_points() -> None:
    slopes = np.array([[[0.0, 1.0], [-1.0, -1.2]], [[0.0, 1.0], [-0.8, -1.0]]])
    push = np.array([[0.0, 0.05]])
    points = np.array([[1.0, 0.0], [0.0, 1.0], [-0.7, 0.7]])
    P = shrinking_ellipsoid(slopes, push, 0.4, 0.5, points, None, np.eye(2))
    assert P is not None
    assert (np.einsum("ki,ij,kj->k", points, P, points) <= 1.0 + 1e-6).all()
    for J in slopes:
        S = P @ J + J.T @ P + 0.4 * P
        g = P @ push[0]
        # For some weight m <= .2: S + g g' / m <= 0.
        assert np.linalg.eigvalsh(S + np.outer(g, g) / 0.2).max() < 1e-6


def test_there_is_none_for_an_unstable_slope() -> None:
    assert shrinking_ellipsoid(np.eye(2)[None], np.zeros((0, 2)), 0.1, 0.5, np.zeros((0, 2)), None, np.eye(2)) is None


def test_it_lies_around_the_ellipsoid_it_is_to_hold() -> None:
    inside = np.diag([4.0, 9.0])
    P = shrinking_ellipsoid(-np.eye(2)[None], np.zeros((0, 2)), 0.5, 0.5, np.zeros((0, 2)), inside, np.eye(2))
    assert P is not None
    assert np.linalg.eigvalsh(inside - P).min() > -1e-6
