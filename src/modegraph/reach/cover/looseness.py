"""How much of the width of a flowpipe is its remainder."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from modegraph.reach.cover.chain import Chain
from modegraph.reach.start.class_chart import parameters_of

Floats = NDArray[np.float64]

LOOSE = 5e-3
"""Share of the remainder in the width of the last set above which a higher degree is tried."""
LOOSE_CLASS = 0.07
"""The same for a class of references, where a higher degree costs much more."""
GIVE_UP = 0.02
"""The same share, above which a run of low degree is given up for the next one: it seldom falls again."""
VERY_LOOSE = 0.25
"""The same share, above which even a degree with many monomials is tried."""


def remainder(chain: Chain) -> tuple[Floats, Floats]:
    """Radii (n,) of the last set: of its remainder, and of its polynomial part.

    Of a class of references, the polynomial part is that of the middle one.
    """
    flow = chain.flows[-1]
    last = flow.last_set
    exponents = flow.bounds.exponents
    fixed = [variable for variable, _ in parameters_of(flow.piece)]
    own = (exponents[:, fixed] == 0).all(axis=1) & exponents.any(axis=1)
    return last.spread, np.abs(last.p[:, own]).sum(axis=1)


def looseness(chain: Chain) -> float:
    """The largest share of the remainder in the width of a state; inf where the flowpipe failed."""
    if chain.failure:
        return np.inf
    z, own = remainder(chain)
    return float((z / np.maximum(own, 1e-300)).max())


def is_loose(chain: Chain, share: float | None = None) -> bool:
    """Whether the remainder counts in the width of the last set, beyond what time steps leave."""
    if share is None:
        share = LOOSE_CLASS if chain.piece.chart.parameters else LOOSE
    z, own = remainder(chain)
    size = float(np.abs(chain.flows[-1].set_at(0).p).sum(axis=1).max())
    return bool((z > share * own + 1e-6 * size).any())


is_very_loose = partial(is_loose, share=VERY_LOOSE)


def is_given_up(chain: Chain) -> bool:
    """Whether a run of low degree need not be carried to its end. (For a class of references the next one is dear.)"""
    return is_loose(chain, VERY_LOOSE if chain.piece.chart.parameters else GIVE_UP)
