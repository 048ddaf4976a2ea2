"""`TracedArray`: a NumPy array of traced scalars and numbers that goes through ordinary NumPy code."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from modegraph.errors import ModegraphError
from modegraph.expression.protocol import RULES
from modegraph.expression.relation import Relation
from modegraph.expression.scalar import Expr, Graph

Objects = NDArray[Any]


class TracedArray(np.ndarray[Any, Any]):
    """Object array whose elements are `Expr`s, numbers, or (from a comparison) `Relation`s."""

    def __new__(cls, values: Any) -> TracedArray:
        return nested(values).view(cls)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **kwargs: Any) -> Any:
        return RULES.ufunc(ufunc, method, inputs, kwargs)

    def __array_function__(self, func: Callable[..., Any], types: Any, args: Any, kwargs: Any) -> Any:
        return RULES.function(func, args, kwargs)

    def used(self) -> None:
        """Called where the array is taken as a whole; one that is watched notes it."""

    def __setitem__(self, key: Any, value: Any) -> None:
        if isinstance(value, (list, tuple, np.ndarray)):
            value = nested(value)
            target = plain(self)[key]
            if not isinstance(target, np.ndarray):
                if value.size != 1:
                    raise ModegraphError(f"an array of shape {value.shape} is assigned to one element")
                value = value.reshape(-1)[0]
        plain(self)[key] = value

    def __bool__(self) -> bool:
        if self.size == 1:
            return bool(self.reshape(-1)[0])
        raise ModegraphError(
            "a branch on an array of traced values: `if`, `and`, `or` cannot be traced; use np.where(condition, a, b)"
        )


def plain(array: Objects) -> Objects:
    """The same data without the subclass, out of reach of the NumPy protocols."""
    return array.view(np.ndarray)


def nested(values: Any) -> Objects:
    """A plain object array from scalars, arrays and nested sequences of them.

    Raises `ModegraphError` where the shapes of a sequence's entries differ.
    """
    if isinstance(values, np.ndarray):
        if isinstance(values, TracedArray):
            values.used()
        return plain(values) if values.dtype == object else values.astype(object)
    if isinstance(values, (list, tuple)):
        entries = [nested(v) for v in values]
        shapes = {e.shape for e in entries}
        if len(shapes) > 1:
            found = ", ".join(str(e.shape) for e in entries)
            raise ModegraphError(f"an array is built from entries of shapes {found}; index or flatten them")
        if not entries:
            return np.empty(0, dtype=object)
        result = np.empty((len(entries), *entries[0].shape), dtype=object)
        for k, entry in enumerate(entries):
            result[k] = entry if entry.ndim else entry[()]
        return result
    result = np.empty((), dtype=object)
    result[()] = values
    return result


def wrap(result: Any) -> Any:
    """What a user sees: object and float arrays as `TracedArray`, zero-dimensional ones as scalars."""
    if isinstance(result, np.ndarray):
        if result.dtype == object:
            return result[()] if result.ndim == 0 else result.view(TracedArray)
        return result.astype(object).view(TracedArray) if result.dtype.kind == "f" and result.ndim else result
    if isinstance(result, tuple):
        return tuple(wrap(r) for r in result)
    return [wrap(r) for r in result] if isinstance(result, list) else result


def leaves(value: Any) -> Iterator[Any]:
    """Scalars inside nested sequences, dictionaries and object arrays."""
    if isinstance(value, np.ndarray):
        if value.dtype == object:
            yield from (leaf for item in plain(value).flat for leaf in leaves(item))
    elif isinstance(value, (list, tuple)):
        for item in value:
            yield from leaves(item)
    elif isinstance(value, dict):
        for item in value.values():
            yield from leaves(item)
    else:
        yield value


def is_traced(values: Iterable[Any]) -> bool:
    """Whether any traced scalar or relation is inside."""
    return any(isinstance(leaf, (Expr, Relation)) for value in values for leaf in leaves(value))


def graph_of(values: Iterable[Any]) -> Graph | None:
    """The graph of the first traced scalar inside."""
    for value in values:
        for leaf in leaves(value):
            if isinstance(leaf, Expr):
                return leaf.graph
            if isinstance(leaf, Relation):
                return leaf.lhs.graph
    return None


def as_numbers(value: Any) -> Any:
    """Traced arrays that hold numbers only, as float arrays; everything else unchanged."""
    if isinstance(value, TracedArray):
        return plain(value).astype(float)
    if isinstance(value, tuple):
        return tuple(as_numbers(v) for v in value)
    return [as_numbers(v) for v in value] if isinstance(value, list) else value
