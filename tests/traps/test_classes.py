"""Continuous classes of references with something wrong for a part of them, each with a sound twin."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.model.class_start import class_start

PLANT = mg.System(lambda x, u: np.array([u[0]]), states="x", inputs="u")


def mode(
    controller: Any = lambda x, r: r - x, *, reference: Any = None, region: mg.Box | None = None, start: Any = None
) -> mg.Mode:
    reference = reference or mg.setpoint(region or mg.Box([-1.0], [1.0]))
    return mg.Mode("hold", PLANT, controller=controller, reference=reference, start=start or mg.Box([0.0], [0.1]))


@pytest.mark.parametrize("edge, empty", [(1.0, False), (np.nextafter(1.0, 0.0), True), (0.999, True)])
def test_a_start_set_that_is_empty_at_the_edge_of_the_class(edge: float, empty: bool) -> None:
    """The box [r, edge] is inverted for r above the edge: at the corner r = 1 only."""
    trap = mode(start=lambda r: mg.Box(r, np.array([edge])))
    if not empty:
        assert class_start(trap).dim == 1
        return
    with pytest.raises(mg.ModegraphError, match=r"mode 'hold', start: coordinate 0 of the Box is inverted .*\(1\)"):
        mg.flowpipe(trap, horizon=1.0)


def test_a_start_set_that_is_empty_in_a_narrow_gap() -> None:
    """radius = (r - .37)^2 - 1e-7 is negative within 3e-4 of .37: no grid of the class would meet it."""
    with pytest.raises(mg.ModegraphError, match=r"the radius of the Ball is negative for the reference \(0\.3[67]"):
        mg.flowpipe(mode(start=lambda r: mg.Ball(r, (r[0] - 0.37) ** 2 - 1e-7)), horizon=1.0)
    twin = mode(start=lambda r: mg.Ball(r, (r[0] - 0.37) ** 2 + 1e-3))
    assert mg.flowpipe(twin, horizon=1.0).complete


def test_a_start_set_that_touches_emptiness_is_undecided_not_accepted() -> None:
    with pytest.raises(mg.ModegraphError, match="undecided whether the radius of the Ball is negative"):
        mg.flowpipe(mode(start=lambda r: mg.Ball(r, r[0] ** 2 - 0.74 * r[0] + 0.1369)), horizon=1.0)


@pytest.mark.parametrize(
    "controller",
    [
        lambda x, r: (r - x) / r,
        lambda x, r: (r - x) / (r - 0.99),
        lambda x, r: (r - x) / (x + r),
        lambda x, r: np.log(r + 0.5) * (r - x),
        lambda x, r: np.sqrt(r + 0.5) - x,
    ],
)
def test_a_controller_with_a_pole_for_a_part_of_the_class(controller: Any) -> None:
    """At the middle reference all is well, or nearly so; no time at all may be claimed for the class."""
    pipe = mg.flowpipe(mode(controller, region=mg.Box([-1.0], [1.2])), horizon=1.0)
    assert not pipe.complete
    assert not len(pipe.times) or pipe.times[-1] == 0.0
    with pytest.raises(mg.ModegraphError):
        pipe.at(0.5, r=[0.6])
    with pytest.raises(mg.ModegraphError):
        pipe.at(0.5)


def test_the_twin_without_the_pole() -> None:
    pipe = mg.flowpipe(mode(lambda x, r: (r - x) / r, region=mg.Box([0.5], [1.2])), horizon=1.0)
    assert pipe.complete
    for r in (0.5, 0.77, 1.2):
        exact = r + (np.array([0.0, 0.1]) - r) * np.exp(-1.0 / r)
        box = pipe.at(1.0, r=[r])
        assert box.lo[0] <= exact[0] <= box.lo[0] + 1e-3
        assert box.hi[0] - 1e-3 <= exact[1] <= box.hi[0]


def jump(t: Any, p: Any) -> Any:
    return np.where(t < 0.5, p, -2.0 * p)


def test_a_jump_at_a_breakpoint_for_every_reference() -> None:
    """x' = r: up with slope p until .5, then down with slope 2 p."""
    reference = mg.trajectory(jump, 1.0, over=mg.Box([0.5], [1.0]), breakpoints=[0.5])
    pipe = mg.flowpipe(mode(lambda x, r: r, reference=reference), horizon=1.0)
    for p in (0.5, 0.8, 1.0):
        top, end = pipe.at(0.5, r=[p]), pipe.at(1.0, r=[p])
        np.testing.assert_allclose([top.lo[0], top.hi[0]], [0.5 * p, 0.5 * p + 0.1], atol=1e-9)
        np.testing.assert_allclose([end.lo[0], end.hi[0]], [-0.5 * p, 0.1 - 0.5 * p], atol=1e-9)
        assert pipe.hull(0.3, 0.7, r=[p]).hi[0] >= 0.5 * p + 0.1


def test_a_jump_whose_instant_depends_on_the_reference_is_refused() -> None:
    """np.where(t < p) jumps at another time for each reference; the twin is a kink, which is fine."""
    reference = mg.trajectory(lambda t, p: np.where(t < p, 1.0, -1.0), 1.0, over=mg.Box([0.3], [0.7]))
    pipe = mg.flowpipe(mode(lambda x, r: r, reference=reference), horizon=1.0)
    assert not pipe.complete
    assert not len(pipe.times) or pipe.times[-1] <= 0.3
    twin = mg.trajectory(lambda t, p: np.abs(t - p), 1.0, over=mg.Box([0.3], [0.7]))
    pipe = mg.flowpipe(mode(lambda x, r: r, reference=twin), horizon=1.0)
    assert pipe.complete
    for p in (0.3, 0.5, 0.7):
        travelled = 0.5 * p**2 + 0.5 * (1.0 - p) ** 2
        box = pipe.at(1.0, r=[p])
        assert box.lo[0] <= travelled
        assert travelled + 0.1 <= box.hi[0]


def test_a_jump_in_the_parameters() -> None:
    """The sign of r decides where to go: no flowpipe goes to both sides, a class on one side is fine."""
    controller = lambda x, r: np.where(r > 0.0, 1.0, -1.0) - x
    pipe = mg.flowpipe(mode(controller), horizon=1.0)
    assert not pipe.complete or (pipe.at(1.0).lo[0] < -0.6 and pipe.at(1.0).hi[0] > 0.6)
    assert mg.flowpipe(mode(controller, region=mg.Box([0.1], [1.0])), horizon=1.0).complete


def test_finite_escape_of_some_references() -> None:
    """x' = r x^2 from about 1 escapes at t = 1/r: the class lasts as long as its fastest reference."""
    plant = mg.System(lambda x, u: u, states="x", inputs="u")
    trap = mg.Mode(
        "grow", plant, controller=lambda x, r: r * x**2, reference=mg.setpoint(mg.Box([0.2], [2.0])),
        start=mg.Box([1.0], [1.0]),
    )  # fmt: skip
    pipe = mg.flowpipe(trap, horizon=2.0)
    assert not pipe.complete
    assert pipe.times[-1] < 0.5
    t = float(pipe.times[-1])
    for r in (0.2, 1.0, 2.0):
        assert pipe.at(t, r=[r]).contains([1.0 / (1.0 - r * t)])
    assert mg.flowpipe(trap, r=[0.2], horizon=2.0).complete
