"""Sets in and out of the coordinates of a frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.rounding import UNIT
from modegraph.reach.field import Frame
from modegraph.reach.generators import generator_box, with_box

Floats = NDArray[np.float64]


def into_frame(frame: Frame, p: Floats, slack: Floats) -> tuple[Floats, Floats]:
    """Polynomials V^-1 p and a box (n,) for V^-1 of the old box and what rounding loses."""
    size = np.abs(frame.inverse) @ (np.abs(p).sum(axis=1) + slack)
    count = p.shape[0] + p.shape[1] + 8
    return frame.inverse @ p, np.abs(frame.inverse) @ slack * (1.0 + 1e-12) + 4.0 * count * UNIT * size


def out_of_frame(frame: Frame, p: Floats, G: Floats) -> tuple[Floats, Floats]:
    """V p and V G; what rounding loses is appended as axis generators."""
    size = np.abs(frame.V) @ (np.abs(p).sum(axis=1) + generator_box(G))
    lost = 4.0 * (p.shape[1] + G.shape[0] * G.shape[2] + len(p) + 8) * UNIT * size
    return frame.V @ p, with_box(np.einsum("ij,gjk->gik", frame.V, G), lost)
