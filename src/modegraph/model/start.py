"""The start set S_i(r) of a mode, evaluated and checked."""

from __future__ import annotations

from weakref import WeakKeyDictionary

from modegraph.errors import ModegraphError
from modegraph.model.mode import Mode
from modegraph.model.numeric import call_numeric
from modegraph.model.reference import Floats
from modegraph.model.sets import Set, Sublevel

_SUBLEVELS: WeakKeyDictionary[Mode, dict[int, tuple[object, Sublevel]]] = WeakKeyDictionary()
"""Sublevel starts by mode and reference, with the function they came from: searching one is costly."""


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
    recalled = _SUBLEVELS.get(mode, {}).get(index)
    if recalled is not None and recalled[0] is mode.start:
        return recalled[1]
    if isinstance(mode.start, Set):
        start = mode.start
    else:
        start = call_numeric(mode.start, {"r": mode.reference.at(0.0, known)}, role="start", owner=owner)
    if not isinstance(start, Set):
        raise ModegraphError(
            f"{owner}: start must return a set (Box, Ball, Ellipsoid, Zonotope, Polytope or Sublevel), "
            f"got {type(start).__name__}"
        )
    n, k = mode.system.n, mode.k
    try:
        start.settle(n, n + k)
    except ModegraphError as error:
        raise ModegraphError(f"{owner}, start: {error}") from None
    if start.dim != n and not (k and start.dim == n + k):
        wanted = f"{n}" if not k else f"{n} (plant) or {n + k} (plant and memory)"
        raise ModegraphError(
            f"{owner}: the start set has {start.dim} coordinates, expected {wanted}: "
            f"one for each of {', '.join(mode.state_names)}"
        )
    if start.is_empty():
        remedy = "raise its level" if isinstance(start, Sublevel) else "correct the faces of its Polytope"
        raise ModegraphError(f"{owner}: the start set is empty, so everything would be true of it; {remedy}")
    if isinstance(start, Sublevel):
        if not start.is_bounded():
            raise ModegraphError(f"{owner}: the start set is not proved to be bounded; {start.remedy}")
        _SUBLEVELS.setdefault(mode, {})[index] = mode.start, start
    elif not start.is_bounded():
        raise ModegraphError(f"{owner}: the start set is unbounded; add faces to its Polytope that bound every state")
    return start
