"""The start set S_i(r) of a mode, evaluated and checked."""

from __future__ import annotations

from typing import Any
from weakref import WeakKeyDictionary

from modegraph.errors import ModegraphError
from modegraph.model.mode import Mode
from modegraph.model.plain_call import call_numeric
from modegraph.model.reference import Floats
from modegraph.model.sets import Set, Sublevel

_STARTS: WeakKeyDictionary[Mode, dict[bytes, Set]] = WeakKeyDictionary()
"""Starts by mode and reference: of finite classes, and Sublevels, which are costly to search."""


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
    name = b"" if known is None else known.tobytes()
    recalled = _STARTS.get(mode, {}).get(name)
    if recalled is not None:
        return recalled
    owner = f"mode {mode.label_of(known)!r}"
    finite = mode.reference.region is None
    if isinstance(mode.start, Set):
        start = checked_start(mode, mode.start, owner)
    else:
        start = checked_start(mode, _returned(mode, known, owner), owner)
        if finite:
            require_same(start, checked_start(mode, _returned(mode, known, owner), owner), owner)
    if finite or isinstance(start, Sublevel):
        _STARTS.setdefault(mode, {})[name] = start
    return start


def _returned(mode: Mode, p: Floats | None, owner: str) -> Any:
    """What ``start`` returns for the reference p."""
    try:
        r = mode.reference.at(0.0, p)
    except ModegraphError as error:
        raise ModegraphError(f"{owner}, {error}") from error
    return call_numeric(mode.start, {"r": r}, role="start", owner=owner)  # type: ignore[arg-type]


def require_same(start: Set, again: Set, owner: str) -> None:
    """An error, which begins with ``owner``, where ``start`` returned another set when it was called again."""
    from modegraph.expression.repeatable import impure

    same = start == again
    if isinstance(start, Sublevel) and isinstance(again, Sublevel):
        same = start.level == again.level and start.is_lower_level_of(again)
    if not same:
        raise impure(f"{owner}, start", f"called twice with the same reference, it gave {start!r} and then {again!r}")


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
