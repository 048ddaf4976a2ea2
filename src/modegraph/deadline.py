"""When work has to end, on the clock of the wall. Never a time of the flow: those are ``horizon``, ``t_end``."""

from __future__ import annotations

import math
import time


class Deadline:
    """An instant of the wall clock at which work ends, and whether anybody has met it.

    What was decided before it does not depend on it: an answer that nobody cut short is that of the model.
    """

    def __init__(self, seconds: float = math.inf, within: Deadline | None = None) -> None:
        """``seconds`` from now on, at most until the end of another deadline ``within``."""
        self._within = within
        self._end = time.monotonic() + seconds if seconds < math.inf else math.inf
        self.met = False
        """Somebody was told that it is over: what they did then depends on the clock."""

    @property
    def is_over(self) -> bool:
        """Whether work has to end; who asks takes note of the answer."""
        if self.left > 0.0:
            return False
        self.met = True
        if self._within is not None and self._within.left <= 0.0:
            self._within.met = True
        return True

    @property
    def left(self) -> float:
        """Seconds until then, negative behind it."""
        own = self._end - time.monotonic() if self._end < math.inf else math.inf
        return own if self._within is None else min(own, self._within.left)


NEVER = Deadline()
"""Work that nobody ends."""
