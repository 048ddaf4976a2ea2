"""NumPy's namespace as a traced function sees it.

`np.zeros(2)` makes a float array that cannot hold traced values, and `np.array([x[0], 1.0])` does not
take part in NumPy's protocols. While a function is traced, those names of `numpy` and `numpy.linalg`
therefore resolve to wrappers: only in the tracing thread, only for callers outside the numerical
libraries, and only until the trace ends. The modules' dictionaries are never written to, so other
threads (a compiler, a simulation) see NumPy as it is.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

import numpy as np
import numpy.linalg

from modegraph.expression.array import TracedArray, is_traced, nested, wrap
from modegraph.expression.arrayfunctions import HANDLERS, PASSED, filled
from modegraph.expression.depth import STATE
from modegraph.expression.ufuncs import BINARY, UNARY

_LIBRARIES = frozenset(("numpy", "scipy", "numba", "modegraph", "flint", "matplotlib", "sympy", "pandas", "llvmlite"))
_FLOATS = (None, float, np.float64, object, "float", "float64", "d")


_lock = threading.Lock()
_tracers = 0


class _Lifting:
    """A NumPy function that also takes sequences and plain object arrays of traced values."""

    def __init__(self, original: Callable[..., Any]) -> None:
        self._original = original

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        return self._original(*(_lift(a) for a in args), **{k: _lift(v) for k, v in kwargs.items()})

    def __getattr__(self, name: str) -> Any:
        return getattr(self._original, name)


def _lift(value: Any) -> Any:
    sequence = isinstance(value, (list, tuple))
    if not (sequence or (type(value) is np.ndarray and value.dtype == object)) or not is_traced([value]):
        return value
    if sequence and _holds_arrays(value):
        return type(value)(_lift(v) for v in value)
    return wrap(nested(value))


def _holds_arrays(value: Any) -> bool:
    """Whether a sequence (np.concatenate, np.block) has arrays inside, and need not be one itself."""
    if isinstance(value, (list, tuple)):
        return any(_holds_arrays(v) for v in value)
    return isinstance(value, np.ndarray) and value.ndim > 0


def _creating(original: Callable[..., Any], value: float) -> Callable[..., Any]:
    def create(shape: Any, dtype: Any = None, *args: Any, **kwargs: Any) -> Any:
        if any(dtype is kind or (isinstance(kind, str) and dtype == kind) for kind in _FLOATS) or dtype == np.float64:
            return filled(shape, value)
        return original(shape, dtype, *args, **kwargs)

    return create


def _full(shape: Any, fill_value: Any, dtype: Any = None, **kwargs: Any) -> Any:
    if dtype is None and not is_traced([fill_value]) and np.asarray(fill_value).dtype.kind != "f":
        return _full_original(shape, fill_value, **kwargs)
    if dtype not in _FLOATS:
        return _full_original(shape, fill_value, dtype, **kwargs)
    result = filled(shape, 0.0)
    result[...] = fill_value
    return result


_full_original = np.full


def _converting(original: Callable[..., Any], copies: bool) -> Callable[..., Any]:
    def convert(values: Any, dtype: Any = None, **kwargs: Any) -> Any:
        if is_traced([values]):
            array = nested(values).view(TracedArray)
            return array.copy() if copies and kwargs.get("copy", True) else array
        if isinstance(values, TracedArray) and dtype in _FLOATS:
            return values.copy() if copies else values
        result = original(values, **kwargs) if dtype is None else original(values, dtype, **kwargs)
        owned = copies and isinstance(result, np.ndarray) and result.dtype == np.float64 and result.ndim > 0
        return wrap(result) if owned else result

    return convert


def _wrapping(original: Callable[..., Any]) -> Callable[..., Any]:
    def make(*args: Any, **kwargs: Any) -> Any:
        return wrap(original(*args, **kwargs))

    return make


def _tables() -> dict[str, dict[str, Any]]:
    table: dict[str, Any] = {
        name: _Lifting(getattr(np, name)) for name in (*UNARY, *BINARY, "abs", "pow", "atan2", "atan")
    }
    linalg: dict[str, Any] = {}
    for function in (*HANDLERS, *PASSED):
        name = function.__name__
        if getattr(numpy.linalg, name, None) is function:
            linalg[name] = _Lifting(function)
        else:
            table[name] = _Lifting(function)
    for alias, name in (("amax", "max"), ("amin", "min")):
        table[alias] = table[name]
    for name, value in (("zeros", 0.0), ("ones", 1.0), ("empty", 0.0)):
        table[name] = _creating(getattr(np, name), value)
    for name in ("zeros_like", "ones_like", "empty_like", "full_like", "eye", "identity"):
        table[name] = _wrapping(getattr(np, name))
    for name in ("array", "asarray", "asanyarray", "ascontiguousarray"):
        table[name] = _converting(getattr(np, name), copies=name == "array")
    table["full"] = _full
    return {"numpy": table, "numpy.linalg": linalg}


_TABLES = _tables()


class _TracedModule(ModuleType):
    """A module whose attributes depend on who asks."""

    def __getattribute__(self, name: str) -> Any:
        # Not by super(): another thread may have ended the last trace, and the module is a plain one again.
        original = ModuleType.__getattribute__(self, name)
        if not STATE.depth:
            return original
        replacement = _TABLES[ModuleType.__getattribute__(self, "__name__")].get(name)
        if replacement is None:
            return original
        caller = sys._getframe(1).f_globals.get("__name__", "")
        return original if caller.partition(".")[0] in _LIBRARIES else replacement


@contextmanager
def tracing() -> Iterator[None]:
    """Trace NumPy code of this thread until the block ends; may be nested."""
    global _tracers
    with _lock:
        _tracers += 1
        for module in (np, numpy.linalg):
            module.__class__ = _TracedModule
    STATE.depth += 1
    try:
        yield
    finally:
        STATE.depth -= 1
        with _lock:
            _tracers -= 1
            if not _tracers:
                for module in (np, numpy.linalg):
                    module.__class__ = ModuleType
