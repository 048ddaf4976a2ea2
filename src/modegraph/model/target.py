"""Goals that are sets of states."""

from __future__ import annotations

from modegraph.errors import ModegraphError
from modegraph.model.immutable import Replaceable
from modegraph.model.names import require_name
from modegraph.model.sets import Set, Sublevel


class Target(Replaceable):
    """A goal set: it can be entered, never left.

    Parameters
    ----------
    name : str
    set : Box, Ball, Ellipsoid, Zonotope, Polytope or Sublevel
        Over the plant states; it must have a point.
    """

    def __init__(self, name: str, set: Set) -> None:
        self.name = require_name(name, "Target: name")
        if not isinstance(set, Set):
            raise ModegraphError(
                f"target {name!r}: set must be a Box, Ball, Ellipsoid, Zonotope, Polytope or Sublevel, "
                f"got {type(set).__name__}"
            )
        self.set = set
        if not isinstance(set, Sublevel):
            self._require_a_point()

    def settle(self, n: int) -> None:
        """Fix the dimension of a Sublevel that was given without one, and look for a point of it.

        Raises
        ------
        ModegraphError
            If its function does not fit n states, or no point is found.
        """
        if isinstance(self.set, Sublevel):
            try:
                self.set.settle(n)
            except ModegraphError as error:
                raise ModegraphError(f"target {self.name!r}: {error}") from None
            self._require_a_point()

    def _require_a_point(self) -> None:
        if self.set.is_empty():
            raise ModegraphError(f"target {self.name!r}: the set is empty, so nothing can reach it; widen it")

    def __repr__(self) -> str:
        return f"Target({self.name!r}, {self.set!r})"
