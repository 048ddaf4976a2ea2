"""Plain float evaluation of a tape at a batch of points."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from modegraph.expression.tape import (
    ADD,
    ADDC,
    ATAN,
    CONST,
    COS,
    EXP,
    LOG,
    MUL,
    MULC,
    RECIP,
    RELU,
    SIN,
    SQR,
    STEP,
    SUB,
    VAR,
    WHERE,
    Tape,
)  # fmt: skip

Floats = NDArray[np.float64]
Step = Callable[[list[Floats]], None]


class Evaluator:
    """Evaluates a tape in double precision: not validated, NaN where an operation is undefined."""

    def __init__(self, tape: Tape) -> None:
        self._tape = tape
        self._steps = [
            _step(k, int(op), int(a), int(b), int(c), float(tape.const[k]))
            for k, (op, a, b, c) in enumerate(tape.ops)
            if op != VAR
        ]
        self._variables = [(int(row), k) for k, row in enumerate(tape.variables)]
        self._outputs = [int(k) for k in tape.outputs]

    def __call__(self, values: Floats) -> Floats:
        """Values (nvar, batch) -> results (nout, batch); (nvar,) -> (nout,)."""
        points = np.asarray(values, dtype=float)
        if points.ndim not in (1, 2) or len(points) != len(self._variables):
            raise ValueError(f"expected values of {len(self._variables)} variables, got shape {points.shape}")
        batch = points[:, None] if points.ndim == 1 else points
        slots: list[Floats] = [np.empty(0)] * self._tape.size
        for row, k in self._variables:
            slots[row] = batch[k]
        with np.errstate(all="ignore"):
            for step in self._steps:
                step(slots)
        result = np.empty((len(self._outputs), batch.shape[1]))
        for k, row in enumerate(self._outputs):
            result[k] = slots[row]
        return result[:, 0] if points.ndim == 1 else result


def _reciprocal(a: Floats) -> Floats:
    return np.where(a == 0.0, np.nan, 1.0 / a)


def _logarithm(a: Floats) -> Floats:
    return np.log(np.where(a == 0.0, np.nan, a))


def _choose(then: Floats, otherwise: Floats, condition: Floats) -> Floats:
    return np.where(condition > 0.0, then, np.where(condition <= 0.0, otherwise, np.nan))


_UNARY: dict[int, Callable[[Floats], Floats]] = {
    SQR: np.square,
    SIN: np.sin,
    COS: np.cos,
    RECIP: _reciprocal,
    EXP: np.exp,
    LOG: _logarithm,
    ATAN: np.arctan,
    RELU: lambda a: np.maximum(a, 0.0),
    STEP: lambda a: np.heaviside(a, 0.0),
}
_BINARY: dict[int, Callable[[Floats, Floats], Floats]] = {ADD: np.add, SUB: np.subtract, MUL: np.multiply}


def _step(row: int, op: int, a: int, b: int, c: int, const: float) -> Step:
    """One operation as a closure on the list of slots."""
    if op == CONST:
        value = np.array([const])

        def run(s: list[Floats]) -> None:
            s[row] = value
    elif op in _BINARY:
        binary = _BINARY[op]

        def run(s: list[Floats]) -> None:
            s[row] = binary(s[a], s[b])
    elif op == MULC:

        def run(s: list[Floats]) -> None:
            s[row] = s[a] * const
    elif op == ADDC:

        def run(s: list[Floats]) -> None:
            s[row] = s[a] + const
    elif op == WHERE:

        def run(s: list[Floats]) -> None:
            s[row] = _choose(s[a], s[b], s[c])
    else:
        unary = _UNARY[op]

        def run(s: list[Floats]) -> None:
            s[row] = unary(s[a])

    return run
