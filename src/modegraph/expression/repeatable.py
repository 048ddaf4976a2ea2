"""A function that is traced once must do the same at every call: its trace is what the proof is about."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from modegraph.errors import ModegraphError
from modegraph.expression.evaluate import Evaluator
from modegraph.expression.scalar import Expr, Graph
from modegraph.expression.tape import compile_tape

Floats = NDArray[np.float64]
T = TypeVar("T")

RELATIVE = 1e-6
"""Disagreement of a trace and the function itself that may be rounding: of the value,"""
ABSOLUTE = 1e-9
"""and of the largest intermediate result. A trace is compared exactly with a second one; this is for the rest."""
NEARBY = 1e-7
"""How far off, relative to its size, a variable is moved to see whether a point lies on a jump."""


def impure(where: str, what: str) -> ModegraphError:
    """The error of a function that is no function of its arguments; ``what`` was seen of it."""
    return ModegraphError(
        f"{where} does not depend on its arguments alone: {what}. It is traced once and proved for what it was "
        "then, so it must not read random numbers, a clock or anything that changes between calls, and not tell "
        "traced values from numbers; draw such values once, outside of it, state what is not known as "
        "disturbance= or unknowns=, and what the controller remembers as memory=mg.Memory(...). A formula that "
        "cancels does the same: write it so that rounding changes only its last digits"
    )


def twice(read: Callable[[], T], exprs: Callable[[T], Sequence[Expr]], graph: Graph, where: str) -> T:
    """What ``read`` traces on ``graph``, if it traces the same again.

    Folding may know more about a node at the second time (that it is an absolute value), hence the third: two
    in a row that agree are enough.

    Raises
    ------
    ModegraphError
        Begins with ``where``.
    """

    def again() -> list[int]:
        kept = len(graph.dropped)
        try:
            return [e.index for e in exprs(read())]
        except ModegraphError as error:
            raise impure(where, f"called again with the same arguments, it fails ({error})") from error
        finally:
            del graph.dropped[kept:]

    first = read()
    before, after = [e.index for e in exprs(first)], again()
    if before != after and after != (last := again()):
        shown = next((a, b) for a, b in zip([*after, None], [*last, None], strict=False) if a != b)
        texts = ["nothing" if k is None else Expr(graph, k).text(40) for k in shown]
        raise impure(where, f"called twice with the same arguments, it gave {texts[0]} and then {texts[1]}")
    return first


class Comparison:
    """Traced expressions beside the numbers that the function itself returns.

    Parameters
    ----------
    exprs, variables : list[Expr]
    """

    def __init__(self, exprs: Sequence[Expr], variables: Sequence[Expr]) -> None:
        tape = compile_tape(list(exprs), list(variables))
        self._outputs = tape.outputs
        self._rows = Evaluator(replace(tape, outputs=np.arange(tape.size)))

    def values(self, point: Floats) -> tuple[Floats, Floats]:
        """Values (nout,) at a point (nvar,), and how much of a difference to them may be rounding."""
        rows = self._rows(np.asarray(point, float))
        there = rows[self._outputs]
        size = np.abs(rows[np.isfinite(rows)]).max(initial=1e-300)
        return there, RELATIVE * np.abs(there) + ABSOLUTE * size

    def values_or_jump(self, point: Floats) -> tuple[Floats, Floats]:
        """As ``values``; where the point lies on a jump, its height may be the difference, too."""
        there, slack = self.values(point)
        rng = np.random.default_rng(0)
        for _ in range(8):
            moved = point + NEARBY * (1.0 + np.abs(point)) * rng.choice([-1.0, 1.0], len(point))
            slack = slack + np.nan_to_num(np.abs(self.values(moved)[0] - there), nan=np.inf)
        return there, slack

    def first_wrong(self, point: Floats, called: Floats, part: slice = slice(None)) -> int | None:
        """Number of the first entry, of this part of the outputs, that differs; what is not defined does not."""
        wrong = np.zeros(0, dtype=np.int64)
        for values in (self.values, self.values_or_jump):
            there, slack = (value[part] for value in values(point))
            off = np.abs(there - called)
            wrong = np.flatnonzero(np.isfinite(off) & (off > slack))
            if not len(wrong):
                return None
        return int(wrong[0])
