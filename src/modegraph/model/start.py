"""The start set S_i(r) of a mode, evaluated and checked."""

from __future__ import annotations

from modegraph.errors import ModegraphError
from modegraph.model.mode import Mode
from modegraph.model.numeric import call_numeric
from modegraph.model.reference import Floats
from modegraph.model.sets import Set


def mode_start(mode: Mode, p: Floats | None = None) -> Set:
    """The start set under the reference named p.

    Returns
    -------
    Set
        Over the plant states (n) or over plant states and memory (n + k); not empty, bounded.

    Raises
    ------
    ModegraphError
        Names the mode, the reference and the remedy.
    """
    index = mode.match(p)
    known = mode.reference.parameters()[index]
    owner = f"mode {mode.label_of(known)!r}"
    if isinstance(mode.start, Set):
        start = mode.start
    else:
        start = call_numeric(mode.start, {"r": mode.reference.at(0.0, known)}, role="start", owner=owner)
    if not isinstance(start, Set):
        raise ModegraphError(
            f"{owner}: start must return a set (Box, Ball, Ellipsoid, Zonotope or Polytope), got {type(start).__name__}"
        )
    n, k = mode.system.n, mode.k
    if start.dim != n and not (k and start.dim == n + k):
        wanted = f"{n}" if not k else f"{n} (plant) or {n + k} (plant and memory)"
        raise ModegraphError(
            f"{owner}: the start set has {start.dim} coordinates, expected {wanted}: "
            f"one for each of {', '.join(mode.state_names)}"
        )
    if start.is_empty():
        raise ModegraphError(
            f"{owner}: the start set is empty, so everything would be true of it; correct the faces of its Polytope"
        )
    if not start.is_bounded():
        raise ModegraphError(f"{owner}: the start set is unbounded; add faces to its Polytope that bound every state")
    return start
