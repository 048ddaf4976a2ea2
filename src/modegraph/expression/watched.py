"""Arguments that remember whether the function they were handed to used them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from modegraph.expression.array import TracedArray
from modegraph.expression.scalar import Expr


class WatchedArray(TracedArray):
    """A traced vector that notes which of its entries were read; used as a whole, all of them were.

    ``0 * w[0]`` reads w[0] although nothing of it is left in the trace.
    """

    touched: set[int] | None = None

    @classmethod
    def of(cls, values: Any, touched: set[int]) -> WatchedArray:
        """A read-only vector; the numbers of the entries that are read are added to ``touched``."""
        self = TracedArray(values).view(cls)
        self.touched = touched
        self.flags.writeable = False
        return self

    def __array_finalize__(self, other: Any) -> None:
        touched = getattr(other, "touched", None)
        if touched is None:
            return
        if self.shape == other.shape:
            self.touched = touched
        else:
            touched.update(range(other.size))

    def __getitem__(self, key: Any) -> Any:
        if self.touched is not None:
            self.touched.update(np.atleast_1d(np.arange(self.size)[key]).ravel().tolist())
        return self.view(np.ndarray).view(TracedArray)[key]

    def used(self) -> None:
        if self.touched is not None:
            self.touched.update(range(self.size))

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **kwargs: Any) -> Any:
        _note([*inputs, *kwargs.values()])
        return super().__array_ufunc__(ufunc, method, *inputs, **kwargs)

    def __array_function__(self, func: Callable[..., Any], types: Any, args: Any, kwargs: Any) -> Any:
        _note([*args, *kwargs.values()])
        return super().__array_function__(func, types, args, kwargs)


def _note(values: Any) -> None:
    for value in values:
        if isinstance(value, WatchedArray):
            value.used()
        elif isinstance(value, list | tuple):
            _note(value)


class WatchedConstants(Mapping[str, Expr]):
    """``d`` while tracing: d["name"], noted; a name that was not declared raises what ``missing(name)`` makes."""

    def __init__(self, values: Mapping[str, Expr], missing: Callable[[object], Exception]) -> None:
        self._values = dict(values)
        self._missing = missing
        self.touched: set[str] = set()

    def __getitem__(self, name: str) -> Expr:
        if name not in self._values:
            raise self._missing(name)
        self.touched.add(name)
        return self._values[name]

    def __contains__(self, name: object) -> bool:
        return name in self._values

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)
