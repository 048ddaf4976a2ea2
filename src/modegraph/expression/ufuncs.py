"""NumPy's universal functions on traced values (`__array_ufunc__`)."""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Callable
from typing import Any, NoReturn

import numpy as np

from modegraph.errors import ModegraphError
from modegraph.expression import functions
from modegraph.expression.array import Objects, as_numbers, graph_of, is_traced, nested, plain, wrap
from modegraph.expression.protocol import RULES
from modegraph.expression.relation import Relation
from modegraph.expression.scalar import Expr, Graph

UNARY: dict[str, Callable[[Expr], Expr]] = {
    "sin": functions.sin, "cos": functions.cos, "tan": functions.tan, "exp": functions.exp,
    "expm1": functions.expm1, "log": functions.log, "log1p": functions.log1p,
    "log2": functions.log2, "log10": functions.log10,
    "sqrt": functions.sqrt, "cbrt": functions.cbrt, "tanh": functions.tanh, "sinh": functions.sinh,
    "cosh": functions.cosh, "arctan": functions.arctan, "arcsin": functions.arcsin,
    "arccos": functions.arccos,
    "absolute": functions.absolute, "fabs": functions.absolute, "sign": functions.sign,
    "negative": operator.neg, "positive": operator.pos, "conjugate": operator.pos,
    "square": lambda a: a * a, "reciprocal": lambda a: 1 / a,
    "deg2rad": lambda a: a * (math.pi / 180), "radians": lambda a: a * (math.pi / 180),
    "rad2deg": lambda a: a * (180 / math.pi), "degrees": lambda a: a * (180 / math.pi),
}  # fmt: skip

BINARY: dict[str, Callable[[Any, Any], Any]] = {
    "add": operator.add, "subtract": operator.sub, "multiply": operator.mul, "divide": operator.truediv,
    "true_divide": operator.truediv, "power": functions.power, "float_power": functions.power,
    "maximum": functions.maximum, "fmax": functions.maximum, "minimum": functions.minimum,
    "fmin": functions.minimum,
    "arctan2": functions.arctan2, "hypot": functions.hypot,
    "less": operator.lt, "less_equal": operator.le, "greater": operator.gt, "greater_equal": operator.ge,
    "equal": operator.eq, "not_equal": operator.ne,
}  # fmt: skip

_PRODUCTS = frozenset(("matmul", "vecdot", "matvec", "vecmat"))
_SUMS = frozenset(("add", "multiply"))
_APART = "state the constraints separately"
_JUMPS = "it is discontinuous, and angles do not wrap"
_REMEDIES = {
    "logical_and": _APART, "bitwise_and": _APART, "all": _APART,
    "logical_or": "use np.maximum or np.minimum of the two sides",
    "bitwise_or": "use np.maximum or np.minimum of the two sides",
    "any": "use np.maximum or np.minimum of the two sides",
    "logical_not": "turn the inequality round", "invert": "turn the inequality round",
    "floor": _JUMPS, "ceil": _JUMPS, "rint": _JUMPS, "round": _JUMPS, "around": _JUMPS,
    "trunc": _JUMPS, "fix": _JUMPS,
    "remainder": _JUMPS, "fmod": _JUMPS, "floor_divide": _JUMPS,
    "isnan": "a traced value is never NaN", "isfinite": "a traced value is always finite",
    "arccosh": "write it with np.log", "arcsinh": "write it with np.log", "arctanh": "write it with np.log",
}  # fmt: skip


def supported() -> str:
    """The names a user may call, for messages."""
    return ", ".join(sorted({*UNARY, *BINARY} - {"equal", "not_equal", "arccos", "conjugate"}))


def unsupported(name: str) -> NoReturn:
    """Refuse a NumPy function with the remedy."""
    remedy = _REMEDIES.get(name, f"supported are {supported()}, and the usual array functions")
    raise ModegraphError(f"np.{name} of traced values is not supported: {remedy}")


def lift(graph: Graph, value: Any) -> Expr:
    """A traced scalar from a traced scalar or a number."""
    if isinstance(value, Expr):
        return value
    if isinstance(value, Relation):
        raise ModegraphError(f"the relation {value.text()} is used as a number; use np.where(condition, 1, 0)")
    return graph.constant(value)


def elementwise(function: Callable[..., Any], *arrays: Any) -> Any:
    """Apply a function of scalars with NumPy's broadcasting; all scalars are traced first."""
    graph = graph_of(arrays)
    assert graph is not None
    objects = [nested(a) for a in arrays]
    try:
        spread = np.broadcast_arrays(*objects)
    except ValueError:
        shapes = " and ".join(str(a.shape) for a in objects)
        raise ModegraphError(f"arrays of shapes {shapes} do not fit together") from None
    result = np.empty(spread[0].shape, dtype=object)
    for index in np.ndindex(result.shape):
        result[index] = function(*(lift(graph, a[index]) for a in spread))
    return wrap(result)


def clip(a: Any, low: Any, high: Any) -> Any:
    """minimum(maximum(a, low), high); None and infinite bounds are no bounds."""
    for name, bound in (("maximum", low), ("minimum", high)):
        if _unbounded(bound):
            continue
        if is_traced((a, bound)):
            a = elementwise(BINARY[name], a, bound)
        else:
            a = getattr(np, name)(as_numbers(a), as_numbers(bound))
    return a


def _unbounded(bound: Any) -> bool:
    return bound is None or (isinstance(bound, (float, np.floating)) and math.isinf(bound))


def apply(ufunc: np.ufunc, method: str, inputs: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
    """`__array_ufunc__` of `Expr` and `TracedArray`."""
    out = kwargs.pop("out", None)
    if not is_traced(inputs):
        result = wrap(getattr(ufunc, method)(*(as_numbers(i) for i in inputs), **kwargs))
    else:
        if kwargs.pop("where", True) is not True:
            raise ModegraphError(f"np.{ufunc.__name__}(..., where=) is not supported; use np.where")
        kwargs.pop("dtype", None)
        result = _traced(ufunc, method, inputs, kwargs)
    return result if out is None else _store(out[0] if isinstance(out, tuple) else out, result)


RULES.ufunc = apply


def _store(target: Any, result: Any) -> Any:
    if not isinstance(target, np.ndarray) or target.dtype != object:
        raise ModegraphError(
            "a traced value is written into an ordinary float array; make the array inside the function with "
            "np.zeros or np.array (import numpy as np), or build a new one"
        )
    plain(target)[...] = result
    return target


def _traced(ufunc: np.ufunc, method: str, inputs: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
    name = ufunc.__name__
    if method == "__call__":
        if name in UNARY:
            return elementwise(UNARY[name], *inputs)
        if name in BINARY:
            return elementwise(BINARY[name], *inputs)
        if name in _PRODUCTS:
            return wrap(product(ufunc, *inputs))
        if name == "clip":
            return wrap(clip(*inputs))
    elif method == "outer" and name in BINARY:
        a, b = nested(inputs[0]), nested(inputs[1])
        return elementwise(BINARY[name], a.reshape(a.shape + (1,) * b.ndim), b)
    elif method in ("reduce", "accumulate") and name in _SUMS:
        return wrap(getattr(ufunc, method)(_lifted(inputs[0]), *inputs[1:], **kwargs))
    elif method == "reduce" and name in ("maximum", "minimum", "fmax", "fmin"):
        return _extreme(BINARY[name], *inputs, **kwargs)
    unsupported(name)


def _lifted(value: Any) -> Objects:
    """Every number of an object array as a traced scalar, so that folding is exact."""
    graph = graph_of([value])
    assert graph is not None
    array = nested(value)
    result = np.empty(array.shape, dtype=object)
    for index in np.ndindex(array.shape):
        result[index] = lift(graph, array[index])
    return result


def product(ufunc: Callable[..., Any], a: Any, b: Any) -> Any:
    """A matrix product of object arrays."""
    left, right = nested(a), nested(b)
    try:
        return ufunc(left, right)
    except ValueError:
        raise ModegraphError(f"shapes {left.shape} and {right.shape} cannot be multiplied with @") from None


def _extreme(function: Callable[[Any, Any], Any], array: Any, axis: Any = 0, **kwargs: Any) -> Any:
    objects = _lifted(array)
    if axis is None:
        return functools.reduce(function, objects.flat)
    if not isinstance(axis, int) or kwargs.get("keepdims"):
        raise ModegraphError("a maximum or minimum of traced values takes one axis, without keepdims")
    moved = np.moveaxis(objects, axis, 0)
    result = np.empty(moved.shape[1:], dtype=object)
    for index in np.ndindex(result.shape):
        result[index] = functools.reduce(function, moved[(slice(None), *index)])
    return wrap(result)
