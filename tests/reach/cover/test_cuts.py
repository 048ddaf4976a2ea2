"""Cuts: across what is nonlinear, and as often as it takes."""

import numpy as np
import pytest

import modegraph as mg
from modegraph.reach.compiled import compile_mode
from modegraph.reach.cover.cuts import MOST_CUTS, nonlinear_variable, parts_of_refused
from modegraph.reach.flow.flow import RESTART_SHARE, Flow, Order


@pytest.fixture
def flow() -> Flow:
    """x' = y^2, y' = 2 x^2 from a square, one step."""
    plant = mg.System(lambda x, u: np.array([x[1] ** 2, 2.0 * x[0] ** 2 + 0.0 * u[0]]), states=2, inputs=1)
    mode = mg.Mode(
        "grow",
        plant,
        controller=lambda x: 0.0 * x[0],
        reference=mg.setpoint([0.0]),
        start=mg.Box([-0.2, -0.2], [0.2, 0.2]),
        output=lambda x: x[:1],
    )
    compiled = compile_mode(mode, None, observed=False)
    flow = Flow(compiled.fields, compiled.whole(), compiled.w_centre, compiled.w_radius, Order(4, 3), names=("x", "y"))
    assert flow.advance(0.2)
    return flow


def test_a_cut_is_across_what_those_before_left_nonlinear(flow: Flow) -> None:
    """x first, then y, for the squares of half an x are a quarter; then x again."""
    assert nonlinear_variable(flow) == 0
    assert nonlinear_variable(flow, [0]) == 1
    assert nonlinear_variable(flow, [0, 1]) == 0
    assert nonlinear_variable(flow, [0, 0]) == 1


@pytest.mark.parametrize(("doublings", "parts"), [(-1.0, 2), (0.5, 2), (1.5, 2), (2.5, 4), (3.5, 8), (40.0, 8)])
def test_as_many_cuts_as_doublings_are_wanted(flow: Flow, doublings: float, parts: int) -> None:
    step = flow.steps[-1]
    step.p, step.G = np.zeros_like(step.p), np.zeros((2, 2, step.G.shape[2]))
    step.p[:, 1] = 1.0
    step.G[0, :, 0] = RESTART_SHARE / 2.0**doublings
    made = parts_of_refused(flow, 7)
    assert len(made) == parts
    # Together they are the whole piece.
    assert sum(np.prod(part.hi - part.lo) for part in made) == pytest.approx(4.0)
    assert all((part.lo >= -1.0).all() and (part.hi <= 1.0).all() for part in made)
    assert len({(*part.lo, *part.hi) for part in made}) == parts


def test_cuts_end_at_the_deepest(flow: Flow) -> None:
    flow.steps[-1].G[:] = 0.0
    assert len(parts_of_refused(flow, 7)) == 2**MOST_CUTS
    assert len(parts_of_refused(flow, 2)) == 4
