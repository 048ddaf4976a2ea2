"""What a flowpipe is made of: degrees and steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Order:
    """Degrees of the flowpipe: ``degree`` of p and ``jacobian`` of Psi and G in the set variables.

    A variable of weight 2 counts twice in the degree of a monomial; without ``weights`` all count once.
    """

    degree: int
    jacobian: int
    weights: tuple[int, ...] = ()


@dataclass
class Step:
    """One step, from ``start`` to ``end`` seconds.

    p (n, N), G (ng, n, Nq): the set at the end. ``tube`` (n,) bounds e over the step, ``bend`` (n,)
    the distance of p from its chord. ``face_upper``: proved upper bound of each constraint face over
    the whole closed step (inf: not proved). ``energy``: polynomial of int u'u since entry, and its
    radius. ``tracking``: upper bounds of |h(x) - r|.
    """

    start: float
    end: float
    p: Floats
    G: Floats
    tube: Floats
    bend: Floats
    face_upper: Floats
    energy: Floats
    energy_radius: float
    tracking: Floats
    segment: int
