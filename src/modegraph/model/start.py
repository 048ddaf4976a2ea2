"""The start set S_i(r) of a mode, evaluated and checked."""

from __future__ import annotations

from typing import Any
from weakref import WeakKeyDictionary

from modegraph.errors import ModegraphError
from modegraph.model.mode import Mode
from modegraph.model.numeric import call_numeric
from modegraph.model.reference import Floats
from modegraph.model.sets import Set, Sublevel

_SUBLEVELS: WeakKeyDictionary[Mode, dict[bytes, tuple[object, Sublevel]]] = WeakKeyDictionary()
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
    known = mode.find(p)
    owner = f"mode {mode.label_of(known)!r}"
    name = b"" if known is None else known.tobytes()
    recalled = _SUBLEVELS.get(mode, {}).get(name)
    if recalled is not None and recalled[0] is mode.start:
        return recalled[1]
    if isinstance(mode.start, Set):
        start = mode.start
    else:
        start = call_numeric(mode.start, {"r": mode.reference.at(0.0, known)}, role="start", owner=owner)
    start = checked_start(mode, start, owner)
    if isinstance(start, Sublevel):
        _SUBLEVELS.setdefault(mode, {})[name] = mode.start, start
    return start


def checked_start(mode: Mode, start: Any, owner: str) -> Set:
    """The start set, if it is one for this mode: of the right dimension, not empty, bounded.

    Raises
    ------
    ModegraphError
        Begins with ``owner``.
    """
    if not isinstance(start, Set):
        raise ModegraphError(
            f"{owner}: start must return a set (Box, Ball, Ellipsoid, Zonotope, Polytope or Sublevel), "
            f"got {type(start).__name__}"
        )
    try:
        start.settle(mode.system.n, mode.dim)
    except ModegraphError as error:
        raise ModegraphError(f"{owner}, start: {error}") from None
    require_dimension(mode, start.dim, owner)
    if start.is_empty():
        remedy = "raise its level" if isinstance(start, Sublevel) else "correct the faces of its Polytope"
        raise ModegraphError(f"{owner}: the start set is empty, so everything would be true of it; {remedy}")
    if not start.is_bounded():
        if isinstance(start, Sublevel):
            raise ModegraphError(f"{owner}: the start set is not proved to be bounded; {start.remedy}")
        raise ModegraphError(f"{owner}: the start set is unbounded; add faces to its Polytope that bound every state")
    return start


def require_dimension(mode: Mode, dim: int, owner: str) -> None:
    """An error, which begins with ``owner``, where a start set does not fit the states of the mode."""
    n, k = mode.system.n, mode.k
    if dim != n and not (k and dim == n + k):
        wanted = f"{n}" if not k else f"{n} (plant) or {n + k} (plant and memory)"
        raise ModegraphError(
            f"{owner}: the start set has {dim} coordinates, expected {wanted}: "
            f"one for each of {', '.join(mode.state_names)}"
        )
