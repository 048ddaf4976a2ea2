"""How far start sets reach beyond a target: bounds from both sides that hold, and meet."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.switching.fit import Never, farthest_corner, farthest_of_ellipsoid, fit_of, lengths
from modegraph.certify.switching.start_family import start_family

PLANE = mg.System(lambda x, u: u, states="x y", inputs="u v")


def family(start: Any) -> Any:
    found = start_family(
        mg.Mode(
            "m", PLANE, controller=lambda x, r: r - x, start=start,
            reference=mg.setpoint(mg.Box([-1.0, -1.0], [1.0, 1.0])),
        ),
        None,
    )  # fmt: skip
    assert found is not None
    return found


def test_lengths_of_tiny_vectors() -> None:
    assert lengths(np.array([[3e-200, 4e-200], [0.0, 0.0]])) == pytest.approx([5e-200, 0.0], rel=1e-15, abs=0.0)


@pytest.mark.parametrize(
    ("inner", "outer"),
    [
        (lambda r: mg.Box(r - 0.5, r + 0.5), lambda r: mg.Box(r - 0.25, r + 1.0 / 8)),
        (lambda r: mg.Ball(r, 0.5), lambda r: mg.Ball(2.0 * r, 0.25)),
        (lambda r: mg.Box([r[0], 0.0], [r[0] + 0.5, 1.0]), lambda r: mg.Box([r[0] - 1.0, -1.0], [r[0] + 1.0, 0.75])),
        (lambda r: mg.Zonotope(r, [[1.0, 1.0], [1.0, -1.0]]), lambda r: mg.Ellipsoid(r, [[2.0, 1.0], [1.0, 2.0]])),
    ],
)
def test_what_is_larger_fits_nowhere(inner: Any, outer: Any) -> None:
    with pytest.raises(Never):
        fit_of(family(inner), family(outer))


@pytest.mark.parametrize(
    "outer", [lambda r: mg.Box(r - 1.0, r + 1.0), lambda r: mg.Ball([np.sin(r[0]), r[1]], 1.0), lambda r: mg.Ball(r, 1)]
)
def test_single_pairs_are_boxes_without_width(outer: Any) -> None:
    fit = fit_of(family(lambda r: mg.Ball(r, 0.5)), family(outer))
    rng = np.random.default_rng(0)
    p, q = rng.uniform(-1.0, 1.0, (2, 500, 2))
    low, high = fit.excess_of_pairs(p, q)
    least, most = fit.excess((p, p), (q, q))
    assert np.array_equal(low > 0.0, least > 0.0)
    assert np.array_equal(high <= 0.0, most <= 0.0)
    assert (low > 0.0).any()
    assert (high <= 0.0).any()


@pytest.mark.parametrize("outer", [lambda r: mg.Ball(r, 1.0), lambda r: mg.Ball([np.sin(r[0]), r[1]], 1.0)])
def test_no_pairs_have_no_answers(outer: Any) -> None:
    fit = fit_of(family(lambda r: mg.Box(r - 0.5, r + 0.5)), family(outer))
    nothing = np.zeros((0, 2))
    assert len(fit.gauges(nothing, nothing)) == 0
    assert len(fit.excess_of_pairs(nothing, nothing)[0]) == 0


def test_bounds_of_the_farthest_point_of_an_ellipsoid() -> None:
    rng = np.random.default_rng(2)
    values = np.array([0.01, 0.3, 2.0])
    y = rng.normal(size=(50, 3)) * rng.choice([0.0, 1.0, 10.0], (50, 3))
    size = rng.uniform(0.5, 2.0, 50)
    low, high = farthest_of_ellipsoid(y, values, 0.0, size)
    way = rng.normal(size=(200_000, 3))
    way *= np.sqrt(values) / np.linalg.norm(way, axis=1)[:, None]
    sampled = np.array([np.linalg.norm(a + s * way, axis=1).max() for a, s in zip(y, size, strict=True)])
    assert (sampled <= high * (1.0 + 1e-12)).all()
    assert (sampled >= low * (1.0 - 1e-3)).all()
    assert (low <= high * (1.0 + 1e-12)).all()
    generic = (y != 0.0).all(axis=1)
    assert generic.any()
    assert (high[generic] <= low[generic] * (1.0 + 1e-9)).all()


def test_bounds_of_the_farthest_corner() -> None:
    rng = np.random.default_rng(4)
    y, axes = rng.normal(size=(20, 2)), rng.normal(size=(20, 2, 10))
    low, high = farthest_corner(y, axes)
    exact_low, exact_high = farthest_corner(y[:, :], axes[:, :, :8])
    assert (low <= high).all()
    assert np.array_equal(exact_low, exact_high)
