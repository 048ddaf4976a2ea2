"""Changes of coordinates lose nothing."""

from __future__ import annotations

import numpy as np
import pytest

from modegraph.reach.field import Frame
from modegraph.reach.flow.framing import into_frame, out_of_frame
from modegraph.reach.generators import generator_box

N, Q = 3, 10


def reach_set(scale: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    return rng.normal(size=(N, 5)) * scale, rng.normal(size=(7, N, Q)) * 0.1 * scale


def frame() -> Frame:
    made = Frame.of(np.array([[1.0, 0.5, 0.0], [-0.3, 1.0, 0.2], [0.1, 0.0, -1.0]]))
    assert made is not None
    return made


@pytest.mark.parametrize("scale", [1e-150, 1.0, 1e150])
def test_the_box_of_the_start_comes_along(scale: float) -> None:
    p, _ = reach_set(scale)
    slack = np.array([0.1, 0.0, 0.02]) * scale
    q, box = into_frame(frame(), p, slack)
    rng = np.random.default_rng(1)
    for _ in range(100):
        powers, zeta = np.concatenate([[1.0], rng.uniform(-1, 1, 4)]), rng.choice([-1.0, 1.0], N)
        y = np.linalg.solve(frame().V, p @ powers + slack * zeta)
        assert (np.abs(y - q @ powers) <= box + 1e-13 * scale).all()


def test_back_in_the_coordinates_of_the_states() -> None:
    p, G = reach_set()
    x, out = out_of_frame(frame(), p, G)
    rng = np.random.default_rng(2)
    for _ in range(100):
        powers, d = np.concatenate([[1.0], rng.uniform(-1, 1, Q - 1)]), rng.normal(size=N)
        assert np.allclose(x, frame().V @ p)
        true = np.abs((frame().V @ (G @ powers).T).T @ d).sum()
        assert true <= np.abs(out @ powers @ d).sum() * (1 + 1e-12)
    assert (np.abs(out).sum(axis=(0, 2)) <= generator_box(out)).all()
