"""Drawings of sets."""

from __future__ import annotations

from collections.abc import Iterator

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.axes import Axes

import modegraph as mg


@pytest.fixture
def axes() -> Iterator[Axes]:
    yield plt.subplots()[1]
    plt.close("all")


@pytest.mark.parametrize(
    "region",
    [
        mg.Box([-2, -9, -1], [2, 9, 1]),
        mg.Ball([0, 0, 0], 2),
        mg.Ellipsoid([0, 0, 0], np.diag([4, 9, 1])),
        mg.Zonotope([0, 0, 0], [[1, 1], [0, 3], [1, 0]]),
        mg.Polytope(np.vstack([np.eye(3), -np.eye(3)]), [2, 9, 1, 2, 9, 1]),
    ],
    ids=lambda region: type(region).__name__,
)
def test_the_outline_is_that_of_the_projection(region: mg.Set, axes: Axes) -> None:
    assert region.plot(axes, dims=(2, 0), label="S") is axes
    (patch,) = axes.patches
    lo, hi = region.bounding_box()
    corners = patch.get_path().vertices
    assert corners.min(axis=0) == pytest.approx(lo[[2, 0]], abs=0.02)
    assert corners.max(axis=0) == pytest.approx(hi[[2, 0]], abs=0.02)
    assert patch.get_label() == "S"


def test_a_sublevel_is_a_contour_at_its_level(axes: Axes) -> None:
    ring = mg.Sublevel(lambda x: x[0] ** 2 + 4.0 * x[1] ** 2, 1.0)
    ring.plot(axes, edgecolor="red", label="S")
    (contour,) = axes.collections
    x, y = contour.get_paths()[0].vertices.T
    assert x**2 + 4.0 * y**2 == pytest.approx(np.ones(len(x)), abs=0.01)
    (legend,) = axes.lines
    assert (legend.get_label(), legend.get_color()) == ("S", "red")


def test_one_coordinate_is_an_interval(axes: Axes) -> None:
    for region in (mg.Box([-1], [2]), mg.Sublevel(lambda x: (x[0] - 0.5) ** 2, 2.25)):
        region.plot(axes)
        assert axes.lines[-1].get_xdata() == pytest.approx([-1.0, 2.0], abs=1e-6)


def test_what_cannot_be_drawn(axes: Axes) -> None:
    for region in (mg.Box([0, 0], [1, 1]), mg.Sublevel(lambda x: x[0] ** 2 + x[1] ** 2, 1.0, 2)):
        for dims in ((0, 2), (0, -1), (0,)):
            with pytest.raises(mg.ModegraphError, match=r"two coordinates out of 0\.\.1"):
                region.plot(axes, dims=dims)
    with pytest.raises(mg.ModegraphError, match="bound"):
        mg.Polytope([[1.0]], [1.0]).plot(axes)
