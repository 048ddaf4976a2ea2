"""A loop times a constant of each start, against the loop."""

from __future__ import annotations

from typing import Any

import numpy as np

import modegraph as mg
from modegraph.expression.evaluate import Evaluator
from modegraph.reach.compiled import compile_mode
from modegraph.reach.field import Field
from modegraph.reach.flow.own_time import in_own_time


def field(reference: Any = None, **more: Any) -> Field:
    plant = mg.System(
        lambda x, u, w, d: np.array([x[1], d["gain"] * u[0] - np.sin(x[0]) + w[0] * x[1]]),
        states="x v",
        inputs="u",
        disturbance=mg.Box([-0.1], [0.1]),
        unknowns={"gain": (0.9, 1.1)},
    )
    mode = mg.Mode(
        "m",
        plant,
        controller=lambda x, r: np.clip(-3.0 * (x[:1] - getattr(r, "r", r)) - x[1:], -1.0, 1.0),
        reference=mg.setpoint([0.0]) if reference is None else reference,
        start=mg.Box([-1.0, -1.0], [1.0, 1.0]),
        constraints=lambda x, u: {"speed": x[1] <= 2.0},
        **more,
    )
    return compile_mode(mode, None).fields[0]


def test_rates_matrices_and_energy_gain_the_factor() -> None:
    fld = field()
    own = in_own_time(fld)
    assert own is not None
    assert own.variables == fld.variables + 1
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (fld.variables, 40))
    factor = np.random.default_rng(2).uniform(0.1, 2.0, 40)
    scaled = np.vstack([points, factor])
    n, q, faces = fld.states, fld.disturbances, len(fld.faces)
    for plain, timed, first, last in (
        (fld.rates, own.rates, 0, n),
        (fld.jacobian, own.jacobian, 0, n * (n + q)),
        (fld.observed, own.observed, faces, faces + 1),
    ):
        expected = Evaluator(plain)(points)
        expected[first:last] *= factor
        np.testing.assert_allclose(Evaluator(timed)(scaled), expected, rtol=1e-15)


def test_there_is_none_where_anything_reads_the_time() -> None:
    assert in_own_time(field(mg.trajectory(lambda t: np.sin(t), 3.0))) is None
