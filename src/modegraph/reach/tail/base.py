"""All time after some instant, or why it is not known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from modegraph.reach.failure import Failure

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Tail:
    """From ``start`` seconds on, every trajectory exists and stays in a set for ever.

    ``face_upper`` bounds each constraint face for all t >= start; ``tracking`` likewise |h(x) - r|.
    ``lo``, ``hi`` (n,): a box around everything after ``start`` (infinite in states nothing reads).
    ``decay``: rate of the slowest mode at the equilibrium, 1/s (a float estimate).
    """

    start: float
    face_upper: Floats
    tracking: Floats
    lo: Floats
    hi: Floats
    decay: float

    @property
    def is_legal(self) -> bool:
        """Whether all constraints are proved for ever."""
        return bool((self.face_upper <= 0.0).all())


class TailFailure(Failure):
    """Why no invariant set was found."""

    __slots__ = ()
