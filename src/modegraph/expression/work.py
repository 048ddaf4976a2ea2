"""Work counted, not timed: the same model gets the same tape on a slow machine, a fast one and a busy one.

One unit is about a microsecond of a core of 2020 or later. What an operation costs is estimated from the sizes
of what it is given: terms, bits of coefficients, nodes.
"""

from __future__ import annotations


class TooBig(Exception):
    """The form would exceed the term limit, or the work is used up."""


class Work:
    """Work that may still be done.

    Attributes
    ----------
    limit, spent : units
    whole : the work this is a share of; what is done here counts there as well
    """

    def __init__(self, limit: float, whole: Work | None = None) -> None:
        self.limit = limit
        self.spent = 0.0
        self.whole = whole

    @property
    def left(self) -> float:
        """Units; 0 once it is used up."""
        own = max(0.0, self.limit - self.spent)
        return own if self.whole is None else min(own, self.whole.left)

    @property
    def over(self) -> bool:
        """Nothing is left."""
        return self.left <= 0.0

    def require(self, units: float) -> None:
        """Count work before it is done; raises `TooBig`, and counts nothing, where so much is not left."""
        if units > self.left:
            raise TooBig
        self.add(units)

    def add(self, units: float) -> None:
        """Count work that is done in any case."""
        self.spent += units
        if self.whole is not None:
            self.whole.add(units)

    def share(self, part: float) -> Work:
        """Such a part of what is left, to be counted on its own too."""
        return Work(part * self.left, self)
