"""NumPy's array functions on traced values (`__array_function__`)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from modegraph.errors import ModegraphError
from modegraph.expression import linear
from modegraph.expression.array import Objects, TracedArray, as_numbers, graph_of, is_traced, nested, wrap
from modegraph.expression.conditional import choose
from modegraph.expression.depth import paused
from modegraph.expression.protocol import RULES
from modegraph.expression.relation import Relation
from modegraph.expression.scalar import Expr
from modegraph.expression.ufuncs import clip, lift, unsupported


def _where(condition: Any, *branches: Any) -> Any:
    if len(branches) != 2:
        raise ModegraphError("np.where of a traced condition needs both branches: np.where(condition, a, b)")
    graph = graph_of([condition, *branches])
    assert graph is not None
    test, then, otherwise = np.broadcast_arrays(nested(condition), nested(branches[0]), nested(branches[1]))
    result = np.empty(test.shape, dtype=object)
    for index in np.ndindex(test.shape):
        decision = test[index]
        if isinstance(decision, Expr):
            raise ModegraphError(
                f"the condition of np.where is the number {decision.text(40)}; compare it, as in `> 0`"
            )
        if isinstance(decision, Relation):
            result[index] = choose(decision, lift(graph, then[index]), lift(graph, otherwise[index]))
        else:
            result[index] = then[index] if decision else otherwise[index]
    return wrap(result)


def _select(condlist: Any, choicelist: Any, default: Any = 0) -> Any:
    result = default
    for condition, choice in zip(reversed(condlist), reversed(choicelist), strict=True):
        result = _where(condition, choice, result)
    return result


def _clip(a: Any, a_min: Any = None, a_max: Any = None, out: Any = None, **bounds: Any) -> Any:
    if out is not None:
        raise ModegraphError("np.clip(..., out=) is not supported; assign the result")
    return wrap(clip(a, bounds.get("min", a_min), bounds.get("max", a_max)))


def _extreme(name: str) -> Callable[..., Any]:
    def reduce(a: Any, axis: Any = None, **kwargs: Any) -> Any:
        return getattr(np, name).reduce(wrap(nested(a)), axis=axis, **kwargs)

    return reduce


def _like(fill: float) -> Callable[..., Any]:
    def make(prototype: Any, dtype: Any = None, **kwargs: Any) -> Any:
        return filled(kwargs.get("shape") or nested(prototype).shape, fill)

    return make


def _full_like(prototype: Any, fill_value: Any, *_: Any, **__: Any) -> Any:
    result = filled(nested(prototype).shape, 0.0)
    result[...] = fill_value
    return result


def filled(shape: Any, value: float) -> TracedArray:
    """A traced array of one number, ready for the assignment of traced values."""
    result: Objects = np.empty(shape, dtype=object)
    result.fill(value)
    return result.view(TracedArray)


HANDLERS: dict[Callable[..., Any], Callable[..., Any]] = {
    np.where: _where,
    np.select: _select,
    np.clip: _clip,
    np.max: _extreme("maximum"),
    np.min: _extreme("minimum"),
    np.zeros_like: _like(0.0),
    np.ones_like: _like(1.0),
    np.empty_like: _like(0.0),
    np.full_like: _full_like,
    np.cross: linear.cross,
    np.linalg.solve: linear.solve,
    np.linalg.inv: linear.inv,
    np.linalg.det: linear.det,
    np.linalg.norm: linear.norm,
}
"""Functions with a rule of their own."""

_STRUCTURAL = (
    "append", "array_split", "atleast_1d", "atleast_2d", "atleast_3d", "average", "block",
    "broadcast_arrays", "broadcast_to", "column_stack", "concatenate", "copy", "cumprod", "cumsum",
    "delete", "diag", "diagflat", "diagonal", "diff", "dot", "dsplit", "dstack", "einsum",
    "expand_dims", "flip", "fliplr", "flipud", "hsplit", "hstack", "inner", "insert", "kron", "mean",
    "moveaxis", "ndim", "outer", "polyval", "prod", "ravel", "repeat", "reshape", "resize", "roll",
    "rot90", "rollaxis", "shape", "size", "split", "squeeze", "stack", "sum", "swapaxes", "take",
    "tensordot", "tile", "trace", "transpose", "trapezoid", "tril", "triu", "vdot", "vsplit", "vstack",
)  # fmt: skip

PASSED: frozenset[Callable[..., Any]] = frozenset(
    [
        *(getattr(np, name) for name in _STRUCTURAL if hasattr(np, name)),
        np.linalg.matrix_power,
        np.linalg.multi_dot,
    ]
)
"""Functions whose own implementation works on plain object arrays."""


def apply(func: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
    """`__array_function__` of `Expr`, `TracedArray` and `Relation`."""
    with paused():
        if func in HANDLERS and (is_traced([args, kwargs]) or func in _ALWAYS):
            return HANDLERS[func](*args, **kwargs)
        if not is_traced([args, kwargs]):
            numbers = {key: as_numbers(value) for key, value in kwargs.items()}
            return wrap(func(*(as_numbers(a) for a in args), **numbers))
        if func not in PASSED:
            unsupported(getattr(func, "__name__", str(func)))
        if kwargs.pop("out", None) is not None:
            raise ModegraphError(f"np.{func.__name__}(..., out=) is not supported; assign the result")
        implementation = getattr(func, "_implementation", func)
        try:
            exposed = {key: _exposed(value) for key, value in kwargs.items()}
            return wrap(implementation(*(_exposed(a) for a in args), **exposed))
        except ValueError as error:
            raise ModegraphError(f"np.{func.__name__}: {error}") from error


RULES.function = apply

_ALWAYS = frozenset((np.zeros_like, np.ones_like, np.empty_like, np.full_like))


def _exposed(value: Any) -> Any:
    """Traced arrays and scalars as plain object arrays, which the implementations do not dispatch on."""
    if isinstance(value, (TracedArray, Expr, Relation)):
        return nested(value)
    if isinstance(value, tuple):
        return tuple(_exposed(v) for v in value)
    return [_exposed(v) for v in value] if isinstance(value, list) else value
