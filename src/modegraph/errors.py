"""The errors a user meets. Each message says what is wrong, where, and what to do about it."""

from __future__ import annotations

from collections.abc import Iterable


class ModegraphError(Exception):
    """Base of every error raised by modegraph.

    The text names the mode, the function or set, and the remedy. Command-line programs print it
    and exit with code 2.
    """


class NotBuiltYet(ModegraphError):
    """An option of the public contract that this version does not implement.

    Ignoring such an option silently could make a certificate false, so asking for it is an error.
    """


class NoSuchAttribute(ModegraphError, AttributeError):
    """An attribute that an object of a model does not have, most likely misspelt."""


class ModegraphWarning(UserWarning):
    """A model that can be worked with, but hardly says what its author meant. The text says what to do about it."""


class Unreachable(ModegraphError):
    """No chain of certified switches leads to the goal (Theorem 4.1 has no path).

    Attributes
    ----------
    reachable : tuple[str, ...]
        Names of the modes and targets that can be reached from the start, in mode order.
    helpful : tuple[tuple[str, str], ...]
        Undecided pairs ``(i, j)`` which would open a chain if they were certified.
    """

    def __init__(
        self,
        message: str,
        *,
        reachable: Iterable[str] = (),
        helpful: Iterable[tuple[str, str]] = (),
    ) -> None:
        super().__init__(message)
        self.reachable = tuple(reachable)
        self.helpful = tuple(helpful)
