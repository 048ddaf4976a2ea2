"""Whether this thread traces a function now, and a pause from that."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager


class _State(threading.local):
    depth = 0


STATE = _State()
"""``depth``: how many traces this thread is inside of."""


@contextmanager
def paused() -> Iterator[None]:
    """NumPy as it is, for the library's own use inside a trace."""
    depth, STATE.depth = STATE.depth, 0
    try:
        yield
    finally:
        STATE.depth = depth
