"""Names of states, inputs and modes as users give them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from modegraph.errors import ModegraphError


def names_of(given: str | int | Iterable[str], symbol: str, what: str) -> tuple[str, ...]:
    """Normalise a count, one spaced string or a list of names to a tuple of distinct names.

    Parameters
    ----------
    given : a count gives ``symbol[0]``, ``symbol[1]``, ...
    what : str
        Opens the error message, such as "System: states".
    """
    if isinstance(given, bool):
        raise ModegraphError(f"{what} must be names or a count, got {given}")
    if isinstance(given, int | np.integer):
        if given < 0:
            raise ModegraphError(f"{what} must be a count >= 0 or names, got {given}")
        return tuple(f"{symbol}[{k}]" for k in range(int(given)))
    names: Sequence[object]
    if isinstance(given, str):
        names = given.replace(",", " ").split()
    else:
        try:
            names = list(given)
        except TypeError:
            raise ModegraphError(
                f"{what} must be a list of names, one spaced string or a count, got {given!r}"
            ) from None
    result = tuple(require_name(name, f"{what}: a name") for name in names)
    for k, name in enumerate(result):
        if name in result[:k]:
            raise ModegraphError(f"{what}: the name {name!r} appears twice; names must differ")
    return result


def require_name(name: object, what: str) -> str:
    """A non-empty string without surrounding blanks, or an error that starts with ``what``."""
    if not isinstance(name, str) or not name.strip():
        raise ModegraphError(f"{what} must be a non-empty string, got {name!r}")
    if name != name.strip():
        raise ModegraphError(f"{what} must not begin or end with a blank, got {name!r}")
    return str(name)


def require_callable(value: object, what: str) -> None:
    """An error unless the value can be called."""
    if not callable(value):
        raise ModegraphError(f"{what} must be a function, got {type(value).__name__}")
