"""Drawings of flowpipes: what is drawn holds the trajectories."""

from __future__ import annotations

from collections.abc import Iterator

import matplotlib.pyplot as plt
import numpy as np
import pytest

import modegraph as mg
from modegraph.reach.flowpipe import Flowpipe


@pytest.fixture(scope="module")
def pipe() -> Flowpipe:
    """x' = v, v' = -x: a rotation of the start."""
    plant = mg.System(lambda x: np.array([x[1], -x[0]]), states="x v", inputs=0)
    turn = mg.Mode(
        "turn",
        plant,
        controller=lambda x: np.zeros(0),
        reference=mg.setpoint([0.0]),
        start=mg.Box([1, -0.1], [1.1, 0.1]),
    )
    return mg.flowpipe(turn, horizon=2.0)


@pytest.fixture(autouse=True)
def closed() -> Iterator[None]:
    yield
    plt.close("all")


def test_states_over_time_hold_a_trajectory(pipe: Flowpipe) -> None:
    ax = pipe.plot(dims="x", target=mg.Box([-9, -9], [0.25, 9]))
    (stairs,) = ax.patches
    values, edges, baseline = stairs.get_data()
    middle = 0.5 * (edges[1:] + edges[:-1])
    assert (baseline <= np.cos(middle)).all()
    assert (np.cos(middle) <= values).all()
    assert edges[-1] == 2.0
    assert any(0.25 in line.get_segments()[1][:, 1] for line in ax.collections)


def test_the_phase_plane_holds_a_trajectory(pipe: Flowpipe) -> None:
    ax = pipe.plot(dims=("x", "v"))
    boxes = [path.get_extents() for path in ax.collections[0].get_paths()]
    for t in np.linspace(0.0, 2.0, 41):
        assert any(box.contains(np.cos(t), -np.sin(t)) for box in boxes)


def test_sections_are_labelled_and_belong_into_a_plane(pipe: Flowpipe) -> None:
    ax = pipe.plot(dims=(0, 1), sections=[0.0, 2.0])
    assert [patch.get_label() for patch in ax.patches] == ["t = 0", "t = 2"]
    with pytest.raises(mg.ModegraphError, match="plane of two states"):
        pipe.plot(dims="x", sections=[0.0])


def test_a_flowpipe_that_never_began_says_why() -> None:
    """The centre of the starts is in the domain of the function, an end of them is not."""
    plant = mg.System(lambda x: np.log(x), states="x", inputs=0)
    never = mg.Mode(
        "never", plant, controller=lambda x: np.zeros(0), reference=mg.setpoint([0.0]), start=mg.Box([-1], [2])
    )
    with pytest.raises(mg.ModegraphError, match="there is no flowpipe to draw: "):
        mg.flowpipe(never, horizon=1.0).plot()
