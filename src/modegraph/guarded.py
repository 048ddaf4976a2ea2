"""An error of the engine costs the answer it was met in, and no other."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import TypeVar

from modegraph.errors import ModegraphError

Result = TypeVar("Result")

_LOG = logging.getLogger("modegraph")
_LOG.addHandler(logging.NullHandler())


def note(what: str, error: Exception) -> None:
    """Log an error of the engine that was met in ``what``, with its traceback."""
    if not isinstance(error, ModegraphError):
        _LOG.error("the proof engine stopped in %s", what, exc_info=error)


def guarded(what: str, work: Callable[[], Result], otherwise: Callable[[Exception], Result]) -> Result:
    """The result of ``work``, or of ``otherwise`` where the engine stops, which is logged; ``what`` it was doing."""
    try:
        return work()
    except Exception as error:
        note(what, error)
        return otherwise(error)
