"""All time after some instant, or why it is not known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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

    @classmethod
    def together(cls, tails: Sequence[Tail]) -> Tail:
        """What holds for all trajectories of several tails, once the last of them has begun."""
        return cls(
            max(tail.start for tail in tails),
            np.max([tail.face_upper for tail in tails], axis=0),
            np.max([tail.tracking for tail in tails], axis=0),
            np.min([tail.lo for tail in tails], axis=0),
            np.max([tail.hi for tail in tails], axis=0),
            min(tail.decay for tail in tails),
        )

    @property
    def is_legal(self) -> bool:
        """Whether all constraints are proved for ever."""
        return bool((self.face_upper <= 0.0).all())


@dataclass(frozen=True)
class TailFailure:
    """Why no invariant set was found."""

    reason: str
