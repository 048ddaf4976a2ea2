"""One flowpipe for a class of references, asked for all of them and for one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.reach.compiled import compile_mode
from modegraph.reach.flow.flow import Flow, Order
from tests.soundness.families import follower, oscillator, pushed

LOOP = mg.System(lambda x, u: np.array([x[1], u[0]]), states="x v", inputs="u")


def linear(start: Any = None, region: mg.Box | None = None) -> mg.Mode:
    return mg.Mode(
        "hold", LOOP, controller=lambda x, r: -2.0 * (x[0] - r[0]) - 3.0 * x[1],
        reference=mg.setpoint(region or mg.Box([-1.0], [3.0])),
        start=start or (lambda r: mg.Box(np.array([r[0] - 0.5, -0.2]), np.array([r[0] + 0.5, 0.2]))),
    )  # fmt: skip


def closed_form(t: float) -> np.ndarray:
    """e^(At) for rates -1 and -2."""
    a, b = np.exp(-t), np.exp(-2.0 * t)
    return np.array([[2 * a - b, a - b], [2 * b - 2 * a, 2 * b - a]])


def test_a_linear_class_is_exact() -> None:
    """x(t) = (r, 0) + e^(At) (x0 - (r, 0)): the width does not depend on r, the class adds its own."""
    pipe = mg.flowpipe(linear(), horizon=3.0)
    assert pipe.complete
    for t in pipe.times[[0, len(pipe.times) // 2, -1]]:
        half = np.abs(closed_form(t)) @ [0.5, 0.2]
        every = pipe.at(t)
        np.testing.assert_allclose(every.lo, [-1.0 - half[0], -half[1]], atol=2e-5)
        np.testing.assert_allclose(every.hi, [3.0 + half[0], half[1]], atol=2e-5)
        for r in (-1.0, 0.123, 3.0):
            box = pipe.at(t, r=[r])
            assert (box.lo <= np.array([r, 0.0]) - half).all()
            assert (box.hi >= np.array([r, 0.0]) + half).all()
            np.testing.assert_allclose(box.hi - box.lo, 2.0 * half, atol=4e-5)


def test_starts_that_do_not_move() -> None:
    """From one fixed box to any r: at the end the sets are around their own r."""
    pipe = mg.flowpipe(linear(mg.Box([0.0, 0.0], [0.1, 0.0])), horizon=8.0)
    for r in (-1.0, 2.0):
        box = pipe.at(8.0, r=r)
        np.testing.assert_allclose(box.center, [r, 0.0], atol=5e-3)
        assert (box.hi - box.lo < 1e-3).all()


def test_one_reference_has_its_own_flowpipe() -> None:
    mode = oscillator().mode
    own = mg.flowpipe(mode, r=[0.7, 0.1], horizon=1.0)
    fixed = mg.Mode(
        "alone", mode.system, controller=mode.controller, reference=mg.setpoint([0.7, 0.1]), start=mode.start
    )
    alone = mg.flowpipe(fixed, horizon=1.0)
    assert own.at(1.0) == alone.at(1.0)
    with pytest.raises(mg.ModegraphError, match="this flowpipe is that of one reference; leave r out"):
        own.at(1.0, r=[0.7, 0.1])


def test_references_outside_the_class() -> None:
    mode = oscillator().mode
    with pytest.raises(mg.ModegraphError, match=r"mode 'oscillator'.*\(2, 0\) names no reference"):
        mg.flowpipe(mode, r=[2.0, 0.0])
    pipe = mg.flowpipe(mode, horizon=0.2)
    for r in ([2.0, 0.0], [0.7], "left"):
        with pytest.raises(mg.ModegraphError, match="names no reference"):
            pipe.at(0.1, r=r)  # type: ignore[arg-type]


def test_a_disturbed_class() -> None:
    family = pushed()
    pipe = mg.flowpipe(family.mode, horizon=6.0)
    low, high, every = pipe.at(6.0, r=[0.0]), pipe.at(6.0, r=[0.5]), pipe.at(6.0)
    own = mg.flowpipe(family.mode, r=[0.5], horizon=6.0).at(6.0)
    assert (high.hi - high.lo)[0] < 1.1 * (own.hi - own.lo)[0]
    assert high.lo[0] > low.hi[0]
    assert every.hi[0] - every.lo[0] > 1.5 * (high.hi - high.lo)[0]


def test_a_moving_class_over_its_breakpoints() -> None:
    family = follower()
    pipe = mg.flowpipe(family.mode, horizon=2.0)
    assert pipe.states == ("s", "v", "y", "i")
    assert {0.5, 1.0, 2.0} <= set(pipe.times.tolist())
    box = pipe.hull(0.4, 0.6, r=[0.5, 0.7])
    for t in (0.4, 0.5, 0.6):
        inner = pipe.at(t, r=[0.5, 0.7])
        assert (box.lo <= inner.lo).all()
        assert (inner.hi <= box.hi).all()


def test_a_start_of_the_callers_own() -> None:
    pipe = mg.flowpipe(linear(), start=mg.Box([0.0, 0.0], [0.0, 0.0]), horizon=1.0)
    np.testing.assert_allclose(pipe.at(0.0, r=[2.0]).center, [0.0, 0.0], atol=1e-12)


def test_it_is_drawn_as_a_whole() -> None:
    import matplotlib.pyplot as plt

    axes = mg.flowpipe(linear(), horizon=1.0).plot()
    assert axes is not None
    plt.close("all")


def test_constraints_are_proved_for_every_reference_of_a_class() -> None:
    """|x - r| <= .75 holds from starts within .5 of r; with .4 it does not, for any r."""
    for limit, holds in ((0.75, True), (0.4, False)):
        mode = linear().replace(constraints=lambda x, r, c=limit: {"near": abs(x[0] - r[0]) <= c})
        compiled = compile_mode(mode, None)
        flow = Flow(
            compiled.fields, compiled.whole(), compiled.w_centre, compiled.w_radius, Order(1, 0),
            names=compiled.loop.names,
        )  # fmt: skip
        assert flow.run(2.0)
        assert bool(all((step.face_upper <= 0.0).all() for step in flow.steps)) == holds
        assert (flow.faces_at(0.0, flow.set_at(0), 0) >= 0.5 - limit - 1e-9).all()
