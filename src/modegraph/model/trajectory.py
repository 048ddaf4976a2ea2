"""Time-varying references: a signal, its duration and its breakpoints."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from modegraph.errors import ModegraphError
from modegraph.model.names import require_callable
from modegraph.model.reference import Floats, Piece, Points, Reference, ReferenceValue, Side, parameter_box
from modegraph.model.sets import Box

if TYPE_CHECKING:
    from modegraph.expression.evaluate import Evaluator
    from modegraph.expression.scalar import Expr, Graph


KEPT = 64
"""References of a continuous class whose evaluators are kept."""


class Trajectory(Reference):
    """r(t) = signal(t) or signal(t, p) up to ``duration``, then held. Made by :func:`trajectory`."""

    def __init__(
        self,
        signal: Callable[..., Any],
        duration: float,
        over: Points | Box | None,
        breakpoints: tuple[float, ...],
    ) -> None:
        self.signal = signal
        self.duration = duration
        self.over = over
        self.region = over if isinstance(over, Box) else None
        self.breakpoints = breakpoints
        self._tables: dict[bytes, list[tuple[Piece, Evaluator]]] = {}

    @cached_property
    def dim(self) -> int:
        some = self.parameters()[0] if self.region is None else self.region.center
        return len(self._table(some)[0][0].value)

    @property
    def is_constant(self) -> bool:
        return False

    def parameters(self) -> list[Floats | None]:
        if isinstance(self.over, Box):
            raise ModegraphError("a continuous class of references cannot be listed; name one by its parameters")
        return [None] if self.over is None else list(self.over)

    def pieces(self, graph: Graph, time: Expr, p: Floats | list[Expr] | None, owner: str) -> list[Piece]:
        """Trace the signal once and resolve it between breakpoints.

        The held value is the last piece at t = duration exactly, a constant expression.
        """
        from modegraph.expression.array import TracedArray
        from modegraph.expression.derivative import derivative
        from modegraph.expression.piecewise import resolve
        from modegraph.expression.repeatable import twice
        from modegraph.expression.simplify import simplify
        from modegraph.expression.trace import as_vector, call

        available: dict[str, object] = {"t": time}
        if isinstance(p, list):
            available["p"] = TracedArray(p)
        elif (own := self.find(p)) is not None:
            available["p"] = np.array(own)

        def read() -> list[Expr]:
            value = call(self.signal, available, role="signal", owner=owner)
            return as_vector(value, None, role="signal", owner=owner, graph=graph)

        traced = twice(read, list, graph, f"{owner}, signal")
        if not traced:
            raise ModegraphError(f"{owner}: the signal returns no value; return at least one number")

        def rates(exprs: list[Expr]) -> list[Expr]:
            return [row[0] for row in derivative(exprs, [time])]

        pieces = []
        instants = [0.0, *self.breakpoints, self.duration]
        for start, end in pairwise(instants):
            here = resolve(traced, time, start, end)
            if not all(new.same(old) for new, old in zip(here, traced, strict=True)):
                simple = simplify(here)
                here = simple.exprs
                graph.dropped.extend(guard.index for guard in simple.guards)
            dot = resolve(rates(here), time, start, end)
            pieces.append(Piece(start, end, here, dot, resolve(rates(dot), time, start, end)))
        held = at_instant(pieces[-1].value, time, self.duration)
        zero = [graph.constant(0)] * len(held)
        return [*pieces, Piece(self.duration, math.inf, held, zero, zero)]

    def at(self, t: float, p: ArrayLike | None = None, side: Side = "right") -> ReferenceValue:
        if not t >= 0:
            raise ModegraphError(f"a reference starts at t = 0, there is no value at t = {t}")
        own = self.find(p)
        for piece, evaluate in self._table(own):
            if t < piece.end or (side == "left" and t == piece.end):
                value, dot, ddot = evaluate(np.array([float(t)])).reshape(3, -1)
                return ReferenceValue(value, dot, ddot, own)
        raise AssertionError("the last piece has no end")

    def _table(self, p: Floats | None) -> list[tuple[Piece, Evaluator]]:
        """Pieces of one reference with float evaluators, traced on a graph of their own."""
        name = b"" if p is None else p.tobytes()
        if name not in self._tables:
            from modegraph.expression.evaluate import Evaluator
            from modegraph.expression.scalar import Graph
            from modegraph.expression.tape import compile_tape

            graph = Graph()
            time = graph.variable("t")
            pieces = self.pieces(graph, time, p, "trajectory")
            while self.region is not None and len(self._tables) >= KEPT:
                self._tables.pop(next(iter(self._tables)), None)
            self._tables[name] = [
                (piece, Evaluator(compile_tape([*piece.value, *piece.dot, *piece.ddot], [time]))) for piece in pieces
            ]
        return self._tables[name]

    def require_faithful(self, p: Floats | None, owner: str) -> None:
        """Call the signal with plain numbers: it must return what its trace gives.

        Raises
        ------
        ModegraphError
            Begins with ``owner``.
        """
        from modegraph.expression.repeatable import Comparison, impure
        from modegraph.expression.scalar import Graph
        from modegraph.model.plain_call import call_numeric

        graph = Graph()
        time = graph.variable("t")
        for piece in self.pieces(graph, time, p, owner)[:-1]:
            compare = Comparison(piece.value, [time])
            for fraction in (0.29, 0.74):
                t = piece.start + fraction * (piece.end - piece.start)
                available: dict[str, object] = {"t": t} if p is None else {"t": t, "p": np.array(p)}
                with np.errstate(all="ignore"):
                    returned = call_numeric(self.signal, available, role="signal", owner=owner)
                called = np.atleast_1d(np.asarray(returned, float))
                wrong = None if called.shape != (len(piece.value),) else compare.first_wrong(np.array([t]), called)
                if wrong is not None:
                    traced = compare.values(np.array([t]))[0][wrong]
                    what = f"at t = {t:.6g} entry {wrong} is {called[wrong]:.9g}, but its trace gives {traced:.9g}"
                    raise impure(f"{owner}, signal", what)

    def __repr__(self) -> str:
        name = getattr(self.signal, "__name__", type(self.signal).__name__)
        return f"trajectory({name}, duration={self.duration:g})"


def at_instant(exprs: list[Expr], time: Expr, instant: float) -> list[Expr]:
    """The expressions with time replaced by an exact constant."""
    graph = time.graph
    known = {time.index: graph.constant(instant).index}
    return [type(time)(graph, index) for index in graph.rewrite([e.index for e in exprs], known=known)]


def trajectory(
    signal: Callable[..., Any],
    duration: float,
    over: Points | Box | None = None,
    breakpoints: Sequence[float] = (),
) -> Trajectory:
    """A reference that moves for ``duration`` and is held afterwards.

    Parameters
    ----------
    signal : callable
        signal(t) or signal(t, p), plain NumPy, returns (m,). A piecewise signal is written
        ``np.where(t < b, ...)`` with b among the breakpoints.
    duration : float
        Seconds, > 0; the same for all p.
    over : Points or Box, optional
        Values of the parameter vector p: finitely many, or all of a box (at most six parameters).
    breakpoints : sequence of float
        Instants in [0, duration] where the signal has a kink or a jump.

    Raises
    ------
    ModegraphError
        If an argument is wrong; names the remedy.
    """
    require_callable(signal, "trajectory: signal")
    length = positive(duration, "trajectory: duration")
    if isinstance(over, Box):
        over = parameter_box(over, "trajectory: over")
    if over is not None and not isinstance(over, Points | Box):
        raise ModegraphError(f"trajectory: over must be Points([...]) or a Box, got {type(over).__name__}")
    try:
        instants = [float(b) for b in breakpoints]
    except (TypeError, ValueError):
        raise ModegraphError(
            f"trajectory: breakpoints must be a sequence of instants in seconds, got {breakpoints!r}"
        ) from None
    for instant in instants:
        if not 0.0 <= instant <= length:
            raise ModegraphError(
                f"trajectory: breakpoint {instant} lies outside [0, duration] = [0, {length}]; drop it or correct it"
            )
    inside = tuple(sorted({instant for instant in instants if 0.0 < instant < length}))
    return Trajectory(signal, length, over, inside)


def positive(value: float, what: str) -> float:
    """A finite number > 0, or an error that starts with ``what``."""
    try:
        number = float(value)
        exact = Fraction(number)
    except (TypeError, ValueError, OverflowError):
        raise ModegraphError(f"{what} must be a finite number > 0, got {value!r}") from None
    if exact <= 0:
        raise ModegraphError(f"{what} must be > 0, got {number}")
    return number
