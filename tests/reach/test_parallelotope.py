"""Parallelotopes around reach sets."""

from __future__ import annotations

import numpy as np
import pytest

import modegraph as mg
from modegraph.enclosure.monomials import monomials
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.parallelotope import (
    half_widths,
    modal_axes,
    principal_axes,
    slow_and_fast_axes,
    tightest,
)
from modegraph.reach.reach_set import ReachSet
from modegraph.reach.start.piece import whole

TABLE = monomials((1, 1), 2)
BOUNDS = PolynomialBounds(whole(mg.Box([0, 0], [1, 1]), []), TABLE, TABLE.size)


def reach_set(seed: int, scale: float = 1.0, box: float = 0.0) -> tuple[ReachSet, np.ndarray]:
    """A set and points of it."""
    rng = np.random.default_rng(seed)
    p, G = rng.normal(size=(3, TABLE.size)) * scale, rng.normal(size=(4, 3, 3)) * 0.1 * scale
    xi = np.sign(rng.uniform(-1, 1, (200, 2))) * rng.choice([1.0, 0.4], (200, 2))
    powers = np.prod(xi[:, None, :] ** TABLE.exponents, axis=2)
    zeta = rng.choice([-1.0, 1.0], (200, 4))
    radius = np.full(3, box * scale)
    e = rng.choice([-1.0, 1.0], (200, 3)) * radius
    points = powers @ p.T + np.einsum("sg,gik,sk->si", zeta, G, powers[:, :3]) + e
    return ReachSet.of(BOUNDS, p, G).plus_box(radius), points


@pytest.mark.parametrize("box", [0.0, 5.0])
@pytest.mark.parametrize("scale", [1e-150, 1.0, 1e150])
def test_all_points_are_within_the_half_widths(scale: float, box: float) -> None:
    reach, points = reach_set(1, scale, box)
    rng = np.random.default_rng(2)
    frames = [np.eye(3), rng.normal(size=(3, 3)), principal_axes(reach)]
    centre = reach.p[:, 0]
    for axes in frames:
        widths = half_widths(reach, axes, centre)
        assert (widths * (1 + 1e-9) >= np.abs(np.linalg.solve(axes, (points - centre).T)).T).all()
    found = tightest([reach], frames, centre)
    assert found is not None
    assert np.isfinite(found[1]).all()


@pytest.mark.parametrize("axes", [np.zeros((3, 3)), np.ones((3, 3)), np.full((3, 3), np.nan)])
def test_singular_frames_hold_nothing(axes: np.ndarray) -> None:
    reach, _ = reach_set(3)
    assert np.isinf(half_widths(reach, axes, reach.p[:, 0])).all()
    assert tightest([reach], [axes], reach.p[:, 0]) is None


def test_modal_frames() -> None:
    slope = np.array([[-1.0, 5.0, 0.0], [0.0, -20.0, 0.0], [0.0, 0.0, -30.0]])
    axes = modal_axes(slope)
    assert np.allclose(np.linalg.norm(axes, axis=0), 1.0)
    assert np.allclose(slope @ axes[:, 0], -axes[:, 0])
    split = slow_and_fast_axes(slope)
    assert np.allclose(np.abs(split[:, 0]), [1.0, 0.0, 0.0])
    assert (slow_and_fast_axes(-np.eye(2)) == np.eye(2)).all()
    assert (modal_axes(np.array([[0.0, 1.0], [0.0, 0.0]])) == np.eye(2)).all()
