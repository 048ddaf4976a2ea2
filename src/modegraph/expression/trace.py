"""Calling an engineer's function with traced arguments, and reading what it returns."""

from __future__ import annotations

import functools
import inspect
import math
import traceback
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from modegraph.errors import ModegraphError
from modegraph.expression.array import nested, plain
from modegraph.expression.namespace import tracing
from modegraph.expression.relation import Relation
from modegraph.expression.scalar import Expr, Graph, exact

Function = Callable[..., Any]

_LIBRARIES = tuple(
    str(folder)
    for folder in (
        Path(__file__).parents[1],
        Path(np.__file__).parents[1],
        Path(inspect.__file__).parent,
        "<",
    )
)
_REMEDIES = (
    (
        "not subscriptable",
        "a single number was indexed; x, u, r, w, z are arrays, t and their entries are not",
    ),
    ("setting an array element", "make the array inside the function with np.zeros (import numpy as np)"),
    ("unsupported operand", "check that every operand is a number or an array"),
    ("not iterable", "a single traced number has no entries"),
    ("could not be broadcast", "check the lengths of the arrays"),
    ("out of bounds", "the index exceeds the number of states, inputs or entries"),
    ("read-only", "arguments must not be changed in place, begin with x = x.copy()"),
)
"""What to do about messages of Python and NumPy, which have no other mark."""


def _signature(fn: Function, where: str) -> inspect.Signature:
    if not callable(fn):
        raise ModegraphError(f"{where} is {fn!r}; expected a function")
    try:
        return inspect.signature(fn)
    except (TypeError, ValueError):
        raise ModegraphError(f"{where}: the arguments of {fn!r} are unknown; wrap it in a lambda") from None


def required_arguments(fn: Function, *, role: str = "function", owner: str = "") -> list[str]:
    """Names of the parameters without a default, in order.

    Raises `ModegraphError` for ``*args`` and ``**kwargs``.
    """
    where = _place(owner, role)
    names = []
    for parameter in _signature(fn, where).parameters.values():
        if parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
            star = "*" if parameter.kind is parameter.VAR_POSITIONAL else "**"
            raise ModegraphError(f"{where} takes {star}{parameter.name}; name the arguments it reads")
        if parameter.default is parameter.empty:
            names.append(parameter.name)
    return names


def _place(owner: str, role: str) -> str:
    return f"{owner}, {role}" if owner else role


def _bound_names(fn: Function) -> set[str]:
    """Keywords that a partial has already decided."""
    names: set[str] = set()
    while isinstance(fn, functools.partial):
        names.update(fn.keywords)
        fn = fn.func
    return names


def arguments(fn: Function, available: Mapping[str, Any], *, role: str, owner: str) -> tuple[list[Any], dict[str, Any]]:
    """Choose from `available` what the function reads, by name.

    A parameter with a default keeps it unless its name is available; keywords bound by a partial stay.
    Raises `ModegraphError` listing the allowed names for anything else.
    """
    where = _place(owner, role)
    required_arguments(fn, role=role, owner=owner)
    bound = _bound_names(fn)
    positional: list[Any] = []
    keywords: dict[str, Any] = {}
    for parameter in _signature(fn, where).parameters.values():
        name = parameter.name
        if name in bound:
            continue
        if name in available:
            if parameter.kind is parameter.POSITIONAL_ONLY:
                positional.append(available[name])
            else:
                keywords[name] = available[name]
        elif parameter.default is parameter.empty:
            allowed = ", ".join(available)
            raise ModegraphError(
                f"{where} reads an unknown argument {name!r}; it may read {allowed}. "
                f"A constant of your own needs a default: {name}={name}"
            )
    return positional, keywords


def call(fn: Function, available: Mapping[str, Any], *, role: str, owner: str) -> Any:
    """Call a function with what it reads, under tracing.

    Every exception becomes a `ModegraphError` that names the owner (``"mode 'gentle'"``), the role
    (``"controller"``), the line and the remedy.
    """
    positional, keywords = arguments(fn, available, role=role, owner=owner)
    where = _place(owner, role)
    try:
        with tracing():
            return fn(*positional, **keywords)
    except ModegraphError as error:
        raise type(error)(f"{where}{_line(error)}: {error}") from error
    except Exception as error:
        text = str(error) or type(error).__name__
        remedy = next((f". Remedy: {r}" for key, r in _REMEDIES if key in text), "")
        raise ModegraphError(f"{where}{_line(error)}: {type(error).__name__}: {text}{remedy}") from error


def _line(error: BaseException) -> str:
    """The innermost line of the user's own code, as text."""
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        if not frame.filename.startswith(_LIBRARIES):
            return f" ({Path(frame.filename).name} line {frame.lineno})"
    return ""


def as_vector(value: Any, length: int | None, *, role: str, owner: str, graph: Graph) -> list[Expr]:
    """What a model function returned, as a list of traced scalars.

    Parameters
    ----------
    value : scalar, sequence or array
        A bare scalar is one entry.
    length : int or None
        The number of entries expected; None accepts any.

    Raises `ModegraphError` naming owner and role for a wrong shape or length, a NaN or an infinity,
    and anything that is not a number.
    """
    where = _place(owner, role)
    if value is None:
        raise ModegraphError(f"{where} returned None; is a `return` missing?")
    try:
        entries = nested(value)
    except ModegraphError as error:
        raise ModegraphError(f"{where}: {error}") from error
    if entries.ndim > 1:
        raise ModegraphError(
            f"{where} returned shape {entries.shape}, expected {_expected(length)}; use .ravel() or index it"
        )
    items = list(plain(entries).reshape(-1))
    if length is not None and len(items) != length:
        found = "1 entry" if len(items) == 1 else f"{len(items)} entries"
        raise ModegraphError(f"{where} returned {found}, expected {_expected(length)}")
    return [_entry(item, f"{where}, entry {k}", graph) for k, item in enumerate(items)]


def _expected(length: int | None) -> str:
    return "one vector" if length is None else f"{length} (shape ({length},))"


def _entry(item: Any, where: str, graph: Graph) -> Expr:
    if isinstance(item, Expr):
        if item.graph is not graph:
            raise ModegraphError(f"{where}: {item.text(40)} was traced in another call; keep no traced values")
        return item
    if isinstance(item, Relation):
        raise ModegraphError(f"{where} is the relation {item.text(40)}, not a number")
    if isinstance(item, np.ndarray):
        raise ModegraphError(f"{where} is an array of shape {item.shape}; concatenate instead of nesting")
    if isinstance(item, (float, np.floating)) and not math.isfinite(item):
        raise ModegraphError(f"{where} is {float(item)}; the function must return finite numbers")
    number = exact(item)
    if number is None:
        raise ModegraphError(f"{where} is {item!r} of type {type(item).__name__}, not a number")
    return graph.constant(number)
