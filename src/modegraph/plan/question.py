"""What a plan is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from modegraph.model.sets import Box
from modegraph.plan.objectives import Objective

if TYPE_CHECKING:
    from modegraph.graph.modegraph import Node

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class End:
    """Where a plan begins or ends: a mode, and what is known of its reference.

    Attributes
    ----------
    stop : Node
        (mode, member of a finite class; 0 for a continuous one)
    p : (k,) array or None
        The reference, where the class is continuous and it is given.
    within : Box or None
        Where it may be.
    """

    stop: Node
    p: Floats | None = None
    within: Box | None = None

    def allows(self, p: Floats) -> bool:
        return (self.p is None or np.array_equal(self.p, p)) and (self.within is None or self.within.contains(p))


@dataclass(frozen=True)
class Question:
    """Where a plan may begin and end, and what it minimises.

    Attributes
    ----------
    starts, goals : sequences of End
    state : (n,) array or None
        The state at the beginning.
    avoid : names of modes that are never entered
    """

    starts: Sequence[End]
    goals: Sequence[End]
    state: Floats | None
    avoid: frozenset[str]
    wanted: Objective
