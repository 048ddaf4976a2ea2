"""Starts given by faces of any scale are never cut away by rounding."""

from __future__ import annotations

import numpy as np

import modegraph as mg


def test_faces_below_the_normal_range_cut_nothing() -> None:
    a = 1e-165
    start = mg.Polytope([[a, 0], [-a, 0], [0, 1], [0, -1]], [-1.5e-150 * a, 5.3e-150 * a, 1e-150, 1e-150])
    target = mg.Target("t", mg.Box([-1e-149, -1.0], [-1.500000003e-150, 1.0]))
    stays_outside = np.array([-1.500000000192854e-150, 0.0])
    assert start.contains(stays_outside)
    assert not target.set.contains(stays_outside)
    plant = mg.System(lambda x, u: np.array([0.0 * x[0], -x[1]]), states=2, inputs=1)
    mode = mg.Mode("m", plant, controller=lambda x: 0.0 * x[0], reference=mg.setpoint([0.0]), start=start)
    verdict = mg.build([mode, target], budget=10.0, horizon=2.0).verdict("m", "t")
    assert verdict.status is not mg.Status.CERTIFIED
