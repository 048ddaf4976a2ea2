"""The reference as model functions see it while they are traced."""

from __future__ import annotations

from typing import Any

from modegraph.expression.array import TracedArray


def fixed(values: Any) -> TracedArray:
    """A traced vector that the function it is handed to cannot change in place."""
    array = TracedArray(values)
    array.flags.writeable = False
    return array


class TracedReference(TracedArray):
    """r while tracing: (m,) with ``.dot`` and ``.ddot``; a slice keeps the derivatives of what is left.

    ``.p``: the parameters of its class, where the function may read them (``start``).
    """

    dot: Any
    ddot: Any
    p: Any

    @classmethod
    def of(cls, value: Any, dot: Any, ddot: Any, p: Any = None) -> TracedReference:
        """From vectors of traced scalars."""
        self = fixed(value).view(cls)
        self.dot = fixed(dot)
        self.ddot = fixed(ddot)
        if p is not None:
            self.p = fixed(p)
        return self

    def __getitem__(self, key: Any) -> Any:
        part = self.view(TracedArray)[key]
        if isinstance(part, TracedArray) and "ddot" in self.__dict__:
            return TracedReference.of(part, self.dot[key], self.ddot[key], self.__dict__.get("p"))
        return part
