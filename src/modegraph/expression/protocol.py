"""Where NumPy's protocols of traced values lead: the rules are written with the classes whose methods ask for them.

The classes import this file, the files of the rules import the classes and fill in their ``apply``. Whoever
imports any file of this folder has run the folder's ``__init__`` and with it both.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


class _Rules:
    """``apply`` of ufuncs.py and of arrayfunctions.py."""

    ufunc: Callable[[Any, str, tuple[Any, ...], dict[str, Any]], Any]
    function: Callable[[Callable[..., Any], tuple[Any, ...], dict[str, Any]], Any]


RULES = _Rules()
