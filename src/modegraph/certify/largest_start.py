"""How large may a start set of a given shape be? (method, Assumption 1 and section 6.)"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from modegraph.certify.decision import decide
from modegraph.certify.question import Question
from modegraph.deadline import Deadline
from modegraph.errors import ModegraphError
from modegraph.model.faithful import require_faithful
from modegraph.model.mode import Mode
from modegraph.model.sets import Set, Sublevel
from modegraph.model.sets.scaled import scaled
from modegraph.reach.compiled import CompiledMode, compile_mode

LARGEST, SMALLEST = 2.0**20, 2.0**-20
"""Scales beyond which no larger, or smaller, one is tried."""
PRECISION = 1.004
"""The search ends when the least scale that is not proved is this near to the largest that is."""
SECONDS, SECONDS_EACH = 120.0, 20.0
"""Work on one call, and on one scale; a scale that is not decided by then counts as not proved."""


def largest_start(mode: Mode, shape: Set, r: Any = None) -> float:
    """The largest proved scale of a start set.

    Every start in ``shape``, scaled by the result about its centre, satisfies Assumption 1: from it the
    constraints of the mode hold for all t >= 0, under every disturbance and unknown. The start set of the
    mode itself plays no part.

    Parameters
    ----------
    mode : Mode
    shape : Set
        Over the plant states (n,), or plant states and memory (n + k,), in their units; bounded, with a
        point. The centre is that of the set (of a Polytope the Chebyshev centre, of a Sublevel the
        point of least fn found).
    r : optional
        The reference, as the user names it; None where the class has only one.

    Returns
    -------
    float
        A scale > 0 that was itself proved; 0.0 if none was. Not always the largest that is true: a proof
        may fail where the claim holds. Never above 2**20, where the search ends.

    Raises
    ------
    ModegraphError
        If the mode is wrong, or the shape is no bounded set of its states; names the mode.
    """
    if not isinstance(mode, Mode):
        raise ModegraphError(f"largest_start: mode must be a Mode, got {type(mode).__name__}")
    p = mode.find(r)
    owner = f"largest_start of mode {mode.label_of(p)!r}"
    _require_shape(mode, shape, owner)
    require_faithful(mode, p)
    return _Search(mode, compile_mode(mode, p, shape), shape).run()


def _require_shape(mode: Mode, shape: Set, owner: str) -> None:
    n, k = mode.system.n, mode.k
    if not isinstance(shape, Set):
        raise ModegraphError(f"{owner}: shape must be a set, got {type(shape).__name__}")
    shape.settle(n, n + k)
    if shape.dim not in (n, n + k):
        raise ModegraphError(
            f"{owner}: shape has {shape.dim} coordinates, expected one for each of {', '.join(mode.state_names[:n])}"
            + (" (and of the memory)" if k else "")
        )
    if shape.is_empty():
        raise ModegraphError(f"{owner}: shape is empty; there is nothing to scale")
    if not shape.is_bounded():
        remedy = shape.remedy if isinstance(shape, Sublevel) else "add faces that bound every state"
        raise ModegraphError(f"{owner}: shape is not bounded; {remedy}")


class _Search:
    """Bracketing and bisection; what is returned was proved, whether or not proofs are monotone."""

    def __init__(self, mode: Mode, compiled: CompiledMode, shape: Set) -> None:
        self.mode, self.compiled, self.shape = mode, compiled, shape
        self.end = Deadline(SECONDS)

    def run(self) -> float:
        proved, missed = 0.0, 1.0
        if self._holds(1.0):
            proved, missed = 1.0, 2.0
            while missed <= LARGEST and self._holds(missed):
                proved, missed = missed, 2.0 * missed
            if missed > LARGEST:
                return proved
        while proved == 0.0:
            half = 0.5 * missed
            if half < SMALLEST or self.end.is_over:
                return 0.0
            if self._holds(half):
                proved = half
            else:
                missed = half
        while missed > PRECISION * proved and not self.end.is_over:
            middle = 0.5 * (proved + missed)
            if self._holds(middle):
                proved = middle
            else:
                missed = middle
        return proved

    def _holds(self, scale: float) -> bool:
        """Whether Assumption 1 is proved for the shape at this scale."""
        deadline = Deadline(SECONDS_EACH, self.end)
        try:
            compiled = replace(self.compiled, start=scaled(self.shape, scale))
            question = Question(compiled, {}, self.mode.horizon, deadline)
            return decide(question, compiled.whole(), []).safety is not None
        except ModegraphError:
            # A limit of the engine: the model itself was checked when it was compiled.
            return False
