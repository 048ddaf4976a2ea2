"""Calling a user's function with plain numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from modegraph.errors import ModegraphError


def call_numeric(function: Callable[..., Any], available: Mapping[str, object], *, role: str, owner: str) -> Any:
    """Call a function with what it reads by name, untraced.

    Parameters
    ----------
    available : {name: value}
        What this role may read. A parameter with a default keeps it unless its name is listed here.
    role, owner : str
        For error messages, such as "controller" and "mode 'gentle'".

    Raises
    ------
    ModegraphError
        If the function asks for something else, or fails.
    """
    from modegraph.expression.trace import arguments

    positional, keywords = arguments(function, available, role=role, owner=owner)
    try:
        return function(*positional, **keywords)
    except ModegraphError as error:
        raise type(error)(f"{owner}, {role}: {error}") from error
    except Exception as error:
        raise ModegraphError(f"{owner}, {role}: {type(error).__name__}: {error}") from error
