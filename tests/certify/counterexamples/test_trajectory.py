"""Counterexamples are proved, not sampled."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.counterexamples.trajectory import (
    PointRun,
    Scene,
    candidate_starts,
    enclose_equilibrium,
    trapped_in,
)
from modegraph.certify.targets.region import Region
from modegraph.reach.compiled import compile_mode


def scene(dynamics: Any, start: mg.Box, w: mg.Box | None = None, **more: Any) -> Scene:
    plant = mg.System(dynamics, states=start.dim, inputs=1, disturbance=w)
    mode = mg.Mode("m", plant, controller=lambda x: 0.0 * x[0], reference=mg.setpoint([0.0]), start=start, **more)
    c = compile_mode(mode, None)
    none = np.zeros(0)
    lo, hi = (none, none) if w is None else (w.lo, w.hi)
    return Scene(c.fields, c.start, c.plant, lo, hi, c.unknowns, c.loop.names, c.own_reset)


NONE = np.zeros(0)


def test_an_equilibrium_is_enclosed_and_traps() -> None:
    made = scene(lambda x, u: np.array([x[1], -np.sin(x[0]) + 0.5 - x[1]]), mg.Box([0.0, -0.1], [1.0, 0.1]))
    found = enclose_equilibrium(made, np.array([0.4, 0.0]), NONE, NONE)
    assert found is not None
    true = np.array([np.arcsin(0.5), 0.0])
    assert (found.lo <= true).all()
    assert (true <= found.hi).all()
    assert (found.hi - found.lo < 1e-7).all()
    assert trapped_in(made, found, Region(mg.Box([-1.0, -1.0], [0.5, 1.0])))
    assert not trapped_in(made, found, Region(mg.Box([-1.0, -1.0], [0.6, 1.0])))
    small = scene(lambda x, u: np.array([x[1], -np.sin(x[0]) + 0.5 - x[1]]), mg.Box([0.0, -0.1], [0.5, 0.1]))
    assert not trapped_in(small, found, Region(mg.Box([-1.0, -1.0], [0.2, 1.0])))


@pytest.mark.parametrize(
    "dynamics",
    [
        lambda x, u: np.array([1.0 + x[0] ** 2]),
        lambda x, u: np.array([x[0] ** 2]),
        lambda x, u: np.array([np.log(x[0] ** 2) ** 2 + 1e-9]),
    ],
    ids=["none", "double", "nearly"],
)
def test_no_equilibrium_is_invented(dynamics: Any) -> None:
    made = scene(dynamics, mg.Box([0.1], [1.0]))
    assert enclose_equilibrium(made, np.array([0.5]), NONE, NONE) is None


def test_a_violation_needs_a_proof() -> None:
    def constraints(x: Any) -> dict[str, Any]:
        return {"top": x[0] <= 2.0}

    made = scene(lambda x, u: x, mg.Box([1.0], [2.0]), constraints=constraints)
    run = PointRun(made, np.array([1.0]), NONE, NONE)
    run.extend(0.69, 100)
    assert run.violation is None
    run.extend(2.0, 100)
    assert run.violation is not None
    assert np.log(2.0) < run.violation <= 2.0
    assert run.apart_until(Region(mg.Box([3.0], [4.0]))) <= np.log(3.0)
    edge = PointRun(made, np.array([2.0]), NONE, NONE)
    edge.extend(0.0, 1)
    assert edge.violation is None
    beyond = PointRun(made, np.array([np.nextafter(2.0, 3.0) + 1e-12]), NONE, NONE)
    beyond.extend(0.0, 1)
    assert beyond.violation == 0.0


def test_candidates_are_starts_and_disturbances_are_allowed() -> None:
    made = scene(lambda x, u, w: w - x, mg.Box([0.1], [0.3]), mg.Box([-0.1], [0.7]))
    starts = candidate_starts(made, [np.array([5.0]), np.array([0.30000000000000004]), np.array([0.2])])
    assert starts
    assert all(made.start.contains(x) for x in starts)
    for w in made.disturbances():
        assert (made.w_lo <= w).all()
        assert (w <= made.w_hi).all()
