"""Slices of a flow hold its runs at and between instants; hulls of slices hold the slices."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import modegraph as mg
from modegraph.reach.compiled import compile_mode
from modegraph.reach.flow.flow import Flow, Order
from modegraph.reach.flow.slices import Slicer, hull, outline
from modegraph.reach.reach_set import ReachSet

MU = 1.0


def rate(t: float, x: np.ndarray) -> list[float]:
    return [x[1], MU * (1.0 - x[0] ** 2) * x[1] - x[0]]


@pytest.fixture(scope="module", params=["box", "ball"])
def slicer(request: pytest.FixtureRequest) -> Slicer:
    plant = mg.System(lambda x: np.array([x[1], MU * (1.0 - x[0] ** 2) * x[1] - x[0]]), states="x y", inputs="none")
    start = mg.Box([1.1, 1.9], [1.3, 2.1]) if request.param == "box" else mg.Ball([1.2, 2.0], 0.1)
    loop = mg.Mode("loop", plant, controller=lambda x: 0.0, reference=mg.setpoint([0.0]), start=start)
    compiled = compile_mode(loop, None, observed=False)
    flow: Flow = compiled.flow(compiled.whole(), Order(4, 2))
    assert flow.run(1.0)
    return Slicer(flow)


def runs(slicer: Slicer, times: np.ndarray) -> np.ndarray:
    """States (runs, times, 2) from extreme starts."""
    start = slicer.flow.piece.chart
    angles = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    xi = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    if not start.round:
        xi = xi / np.abs(xi).max(axis=1)[:, None]
    found = [solve_ivp(rate, (0.0, 1.0), start.centre + start.axes @ v, "DOP853", t_eval=times, rtol=1e-11, atol=1e-12)
             for v in xi]  # fmt: skip
    return np.stack([run.y.T for run in found])


def test_slices_hold_the_runs(slicer: Slicer) -> None:
    times = np.unique(np.concatenate([slicer.times[::3], np.linspace(0.0, 1.0, 23)]))
    for t, x in zip(times, np.moveaxis(runs(slicer, times), 1, 0), strict=True):
        for lo, hi in (hull([slicer.at(float(t))]), slicer.at(float(t)).ranges()):
            assert (lo - 1e-9 <= x).all()
            assert (x <= hi + 1e-9).all()


def test_slices_over_an_interval_hold_what_is_passed(slicer: Slicer) -> None:
    for a, b in pairwise([0.0, 0.05, 0.31, 0.6, 1.0]):
        lo, hi = hull(slicer.over(a, b))
        x = runs(slicer, np.linspace(a, b, 9))
        assert (lo - 1e-9 <= x).all()
        assert (x <= hi + 1e-9).all()


def test_quick_boxes_hold_the_steps(slicer: Slicer) -> None:
    lo, hi = slicer.steps()
    assert len(lo) == len(slicer.flow.steps)
    for k, (a, b) in enumerate(pairwise(slicer.times)):
        x = runs(slicer, np.linspace(a, b, 5))
        assert (lo[k] - 1e-9 <= x).all()
        assert (x <= hi[k] + 1e-9).all()


def test_outlines_hold_the_runs(slicer: Slicer) -> None:
    from scipy.spatial import ConvexHull

    k = len(slicer.flow.steps)
    shape = ConvexHull(outline(slicer, k, (0, 1)))
    x = runs(slicer, np.array([1.0]))[:, 0]
    assert (shape.equations[:, :2] @ x.T + shape.equations[:, 2:] <= 1e-9).all()


def test_a_hull_is_bisected_only_where_that_decides(slicer: Slicer) -> None:
    """It is inside the quick box, and holds each of the slices' own hulls."""
    slices = slicer.over(0.2, 0.7)
    lo, hi = hull(slices)
    below, above = zip(*(s.ranges() for s in slices), strict=True)
    assert (lo >= np.min(below, axis=0) - 1e-12).all()
    assert (hi <= np.max(above, axis=0) + 1e-12).all()
    for s in slices:
        own = hull([s])
        assert (lo <= own[0] + 1e-3 * (hi - lo)).all()
        assert (own[1] <= hi + 1e-3 * (hi - lo)).all()


def test_the_box_of_a_slice_counts(slicer: Slicer) -> None:
    s = slicer.instant(0)
    lo, hi = hull([ReachSet.of(s.bounds, s.p).plus_box(s.box + 0.25)])
    plain = hull([s])
    assert np.allclose(plain[0] - lo, 0.25)
    assert np.allclose(hi - plain[1], 0.25)
