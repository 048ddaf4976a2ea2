"""Goals that are sets of states."""

from __future__ import annotations

from modegraph.errors import ModegraphError
from modegraph.model.names import require_name
from modegraph.model.sets import Set


class Target:
    """A goal set: it can be entered, never left.

    Parameters
    ----------
    name : str
    set : Box, Ball, Ellipsoid, Zonotope or Polytope
        Over the plant states; it must have a point.
    """

    def __init__(self, name: str, set: Set) -> None:
        self.name = require_name(name, "Target: name")
        if not isinstance(set, Set):
            raise ModegraphError(
                f"target {name!r}: set must be a Box, Ball, Ellipsoid, Zonotope or Polytope, got {type(set).__name__}"
            )
        if set.is_empty():
            raise ModegraphError(f"target {name!r}: the set is empty, so nothing can reach it; widen it")
        self.set = set

    def __repr__(self) -> str:
        return f"Target({self.name!r}, {self.set!r})"
