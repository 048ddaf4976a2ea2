"""How long steps may be, beyond what their time error allows, and which error box is tried first."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from modegraph.reach.field import Field
from modegraph.reach.generators import generator_box
from modegraph.reach.start.piece import Piece

Floats = NDArray[np.float64]

SLOW_RATE = 0.25
"""Largest spectral radius of h A0, A0 the Jacobian at the centre, at which nothing is gained by shorter steps."""
FEEDING = 0.05
"""Rate at which the remainder may feed itself, relative to the spectral radius of the Jacobian."""
LONGER = 1.6
"""A step is at most this much longer than the one before."""
MOST_TIME_DEGREE, LEAST_TIME_DEGREE = 8, 4
"""Degrees of the Taylor polynomials in time."""
ENOUGH, TOO_MUCH = 0.1, 0.3
"""Shares of the time error in what is allowed, at which a lower and a higher degree in time are tried."""

ROOM, REST_ROOM = 1.2, 1.3
"""The first guesses of the tube of the error and of its rest, relative to those of the step before."""
NARROW_ROOM, NARROW_REST_ROOM, LEAST_ROOM = 1.03, 1.1, 1.01
"""The same, relative to what is foreseen, where a disturbance makes the remainder grow evenly."""


GROWTH_CAP = 0.1
"""Largest spectral radius of h M, M the bound of how far the Jacobian strays from its centre."""
RATE_CAP = 1.0
"""Largest spectral radius of h A0, A0 the Jacobian at the centre."""
DISTURBED_RATE_CAP = 0.4
"""The same with a disturbance: the boxes of what strays within a step grow with h A0, faster than the steps save."""
MANY_STATES, CAREFUL_RATE_CAP = 4, 0.2
"""The same for loops of more states than that. Measured on the quadrotor (six states): a cruise takes 345 steps at 0.2
(2.4 s), 448 at 0.25 (14 s), 559 at 0.3 (26 s), and breaks down at 0.4: what strays feeds itself, and steps shrink."""
FINE_RATE_CAP = 0.05
"""The same where steps are cheap: linear loops and up to three states."""


def rate_cap(fld: Field, disturbed: bool) -> float:
    """Largest spectral radius of h A0 for the steps of a field."""
    if not disturbed:
        return RATE_CAP
    if fld.states <= 3 or fld.steady:
        return FINE_RATE_CAP
    return DISTURBED_RATE_CAP if fld.states <= MANY_STATES else CAREFUL_RATE_CAP


def error_guess(
    tube: Floats, rest: Floats, remainder: Floats, growth: Floats | None, longer: float
) -> tuple[Floats, Floats, float]:
    """What ``flow_step`` tries first: the tube of the error (n,), its rest (n,), and the least tube relative to
    the remainder and the defect.

    The Jacobian is evaluated over all of it: what is guessed too wide feeds the remainder, what is guessed too
    narrow costs a second try.

    tube, rest : (n,) of the last step; zero at the beginning
    remainder : (n,) box of the generators now
    growth : (n,) the last tube relative to the remainder before it; None without a disturbance
    longer : length of the next step relative to the last
    """
    if growth is None:
        return ROOM * tube, REST_ROOM * rest, ROOM
    foreseen = NARROW_ROOM * remainder * (1.0 + (growth - 1.0) * max(1.0, longer))
    # Early in a flow, and where a state has no remainder yet, nothing can be foreseen.
    widest = ROOM * np.maximum(tube, remainder)
    return np.fmin(widest, foreseen), min(REST_ROOM, NARROW_REST_ROOM * max(1.0, longer)) * rest, LEAST_ROOM


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


def time_degree(degree: int, share: float, hA: float) -> int:
    """The degree of the next Taylor polynomial in time, where a disturbance keeps steps short.

    share : time error of the last step, relative to what is allowed
    hA : spectral radius of h A0; each degree less costs about (degree + 1) / hA of accuracy.
    """
    if share > TOO_MUCH:
        return min(degree + 1, MOST_TIME_DEGREE)
    if degree > LEAST_TIME_DEGREE and 4.0 * share * (degree + 1) < ENOUGH * hA:
        return degree - 1
    return degree
