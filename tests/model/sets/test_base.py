"""What all sets share: equality, shapes of points, drawing."""

import matplotlib

matplotlib.use("Agg")

import numpy as np
import pytest

from modegraph.errors import ModegraphError
from modegraph.model.sets import Ball, Box, Ellipsoid, Polytope, Zonotope

SETS = [
    Box([-1, -2], [1, 2]),
    Ball([0.5, 0], 1),
    Ellipsoid([0, 0], [[1, 0.2], [0.2, 2]]),
    Zonotope([0, 0], [[1, 0.5, 0.2], [0, 1, 0.3]]),
    Polytope([[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1]], [1, 1, 1, 1, 1.5]),
]


@pytest.mark.parametrize("region", SETS, ids=lambda s: type(s).__name__)
def test_every_set(region):
    assert region.dim == 2
    assert region.contains(region.center)
    assert not region.is_empty()
    assert region.is_bounded()
    points = region.sample(30, seed=7)
    lo, hi = region.bounding_box()
    assert all(region.contains(x) for x in points)
    assert ((lo <= points) & (points <= hi)).all()
    assert not region.contains([np.nan, 0])
    assert not region.contains([np.inf, 0])
    assert type(region)(*(getattr(region, name) for name in region._fields)) == region
    assert hash(region) == hash(eval(repr(region)))
    assert len({region, *SETS}) == len(SETS)


@pytest.mark.parametrize("region", SETS, ids=lambda s: type(s).__name__)
def test_points_of_another_length_are_refused(region):
    with pytest.raises(ModegraphError, match="length 2"):
        region.contains([0.0])


@pytest.mark.parametrize("region", SETS, ids=lambda s: type(s).__name__)
def test_drawing(region):
    import matplotlib.pyplot as plt

    ax = region.plot(edgecolor="k")
    corners = ax.patches[0].get_xy()
    lo, hi = region.bounding_box()
    assert corners.min(axis=0) == pytest.approx(lo, abs=0.01)
    assert corners.max(axis=0) == pytest.approx(hi, abs=0.01)
    assert region.plot(ax) is ax
    with pytest.raises(ModegraphError, match="dims"):
        region.plot(ax, dims=(0, 2))
    plt.close("all")


def test_drawing_an_interval():
    import matplotlib.pyplot as plt

    assert len(Box(-1, 1).plot().lines) == 1
    plt.close("all")


def test_sets_of_different_kinds_differ():
    assert Box([0], [1]) != Ball([0.5], 0.5)
    assert Ball([0], 1) != Ball([0], 2)
    assert Box([0.0], [1]) == Box([-0.0], [1])
    assert hash(Box([0.0], [1])) == hash(Box([-0.0], [1]))
