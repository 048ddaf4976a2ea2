"""How long steps may be, beyond what their time error allows."""

from __future__ import annotations

from typing import Any

from .framing import generator_box
from .start import Piece

SLOW_RATE = 0.25
"""Largest spectral radius of h A0, A0 the Jacobian at the centre, at which nothing is gained by shorter steps."""
FEEDING = 0.05
"""Rate at which the remainder may feed itself, relative to the spectral radius of the Jacobian."""
LONGER = 1.6
"""A step is at most this much longer than the one before."""


def feeding_cap(piece: Piece, outcome: Any) -> float:
    """How much longer the next step may be before truncated products feed the remainder as fast as it decays.

    For classes of references: their polynomials stay wide for all time, while one reference's set shrinks.
    ``outcome`` is what ``flow_step`` returned.
    """
    _, _, _, G, _, _, rest, control = outcome
    if not piece.chart.parameters or control[4] < 0.5 or control[3] <= SLOW_RATE:
        return LONGER
    z = generator_box(G)
    if not (z > 0.0).all():
        return LONGER
    feeding = float((rest / z).max()) * float(control[4])
    # What a step adds to the rate grows with the square of its length, or faster; the rest stays.
    return max(SLOW_RATE / float(control[3]), float((FEEDING * control[3] / feeding) ** 0.5))
