"""The closed loop of one mode under one reference, or a continuous class of them, traced to expressions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from modegraph.errors import ModegraphError
from modegraph.expression.ops import LOG, RECIP, VAR, WHERE
from modegraph.expression.piecewise import resolve
from modegraph.expression.repeatable import twice
from modegraph.expression.scalar import Expr, Graph
from modegraph.expression.trace import as_vector, call, required_arguments
from modegraph.expression.watched import WatchedArray, WatchedConstants
from modegraph.model.constraints import Face, faces_of
from modegraph.model.mode import Mode
from modegraph.model.numeric import require_finite_values, typical_values
from modegraph.model.reference import Floats, Piece
from modegraph.model.start import mode_start
from modegraph.model.switching_times import jumps, switching_times
from modegraph.model.traced_reference import TracedReference, fixed
from modegraph.model.trajectory import at_instant
from modegraph.model.validation import validate_modes

__all__ = ["ClosedLoop", "Face", "Segment", "close_loop", "mode_start", "validate_modes"]


@dataclass(frozen=True)
class Segment:
    """The closed loop between two instants at which it may be discontinuous in time.

    Attributes
    ----------
    start, end : float
        Seconds after entering the mode; ``end`` is ``inf`` for the last segment.
    rhs : list[Expr]
        x' (n,), then z' (k,).
    inputs : list[Expr]
        u (p,).
    constraints : list[Face]
        Satisfied where expr <= 0, on the closed segment.
    tracking : list[Expr]
        output - r (m,); empty without an output.
    """

    start: float
    end: float
    rhs: list[Expr]
    inputs: list[Expr]
    constraints: list[Face]
    tracking: list[Expr]


@dataclass(frozen=True)
class ClosedLoop:
    """All expressions of a mode under one reference, or under all of a continuous class, on one graph.

    Attributes
    ----------
    states : list[Expr]
        Variables: n plant states, then k memory states; ``names`` in the same order.
    time : Expr
        Seconds since the mode was entered.
    disturbance : list[Expr]
        Variables w (q,).
    unknowns : dict[str, Expr]
        One variable for each unknown constant.
    parameters : list[Expr]
        Variables: the parameters of the references; empty for one reference.
    segments : list[Segment]
        Contiguous from t = 0 to ``inf``.
    typical : (nvar, B) array
        Values of states, time, disturbance, unknowns and parameters around the centre of the start set.
    reset : list[Expr]
        Memory on entry (k,) as a function of the plant states and the parameters.
    """

    graph: Graph
    names: list[str]
    states: list[Expr]
    time: Expr
    disturbance: list[Expr]
    unknowns: dict[str, Expr]
    parameters: list[Expr]
    segments: list[Segment]
    typical: Floats
    reset: list[Expr]
    has_constraints: bool
    unread: tuple[str, ...] = ()
    """What is uncertain and neither the dynamics nor the constraints read: "w[1]", "d['mass']"."""
    idle: tuple[str, ...] = ()
    """Names of the inputs that the dynamics do not read."""


def close_loop(mode: Mode, p: Floats | None = None) -> ClosedLoop:
    """Trace plant, controller, memory, constraints and output under the reference named p.

    For a continuous class, p = None stands for all of it: the parameters are variables then.
    Segments end at the breakpoints of the reference, at its duration, and where the controller
    itself switches in time.

    Raises
    ------
    ModegraphError
        If a function of the mode is wrong. Names mode, function and remedy.
    """
    p = mode.find(p, whole=True)
    some = mode.reference.region.center if p is None and mode.reference.region is not None else p
    start = mode_start(mode, some)
    trace = _Trace(mode, p)
    segments = [segment for piece in trace.pieces for segment in trace.segments(piece)]
    loop = ClosedLoop(
        graph=trace.graph,
        names=list(mode.state_names),
        states=[*trace.x, *trace.z],
        time=trace.time,
        disturbance=trace.w,
        unknowns=dict(trace.d),
        parameters=trace.p,
        segments=segments,
        typical=typical_values(mode, start, None if p is not None else mode.reference.region),
        reset=trace.reset(),
        has_constraints=mode.constraints is not None,
        unread=trace.unread(),
        idle=tuple(name for k, name in enumerate(mode.system.inputs) if k not in trace.read_inputs),
    )
    require_finite_values(mode, some, start)
    return loop


def _undeclared(names: Sequence[str], name: object) -> ModegraphError:
    return ModegraphError(
        f"d[{name!r}] is not an unknown constant of the plant; it has {', '.join(map(repr, names)) or 'none'}: "
        "declare it in System(..., unknowns={name: (lo, hi)})"
    )


class _Trace:
    """Variables and calls of one tracing."""

    def __init__(self, mode: Mode, p: Floats | None) -> None:
        self.mode = mode
        self.owner = f"mode {mode.label_of(p)!r}"
        self.graph = Graph()
        taken: set[str] = set()
        self.x = [self._variable(name, taken) for name in mode.system.states]
        self.z = [self._variable(name, taken) for name in mode.state_names[mode.system.n :]]
        self.time = self._variable("t", taken)
        self.w = [self._variable(f"w[{k}]", taken) for k in range(mode.system.q)]
        self.d = {name: self._variable(f"d[{name!r}]", taken) for name in mode.system.unknowns}
        self.constants = WatchedConstants(self.d, lambda name: _undeclared(list(self.d), name))
        self.read_inputs: set[int] = set()
        self.read_disturbances: set[int] = set()
        region = mode.reference.region
        whole = p is None and region is not None
        self.p = [self._variable(f"p[{k}]", taken) for k in range(region.dim)] if region and whole else []
        self.pieces = mode.reference.pieces(self.graph, self.time, self.p if whole else p, self.owner)

    def _variable(self, name: str, taken: set[str]) -> Expr:
        """A variable of its own, also where the user's names coincide ("t" may be a temperature)."""
        while name in taken:
            name += "'"
        taken.add(name)
        return self.graph.variable(name)

    def segments(self, piece: Piece) -> list[Segment]:
        """Trace one piece of the reference and cut it where the functions themselves switch in time."""
        mode = self.mode
        r = TracedReference.of(piece.value, piece.dot, piece.ddot)
        x = fixed(self.x)
        seen: dict[str, Any] = {"x": x, "r": r, "t": self.time}
        if mode.memory is not None:
            seen["z"] = fixed(self.z)
        inputs = [] if mode.controller is None else self._vector(mode.controller, "controller", seen, mode.system.p)
        u = fixed(inputs)
        plant = {"x": x, "u": WatchedArray.of(inputs, self.read_inputs), **self._uncertain()}
        rhs = self._vector(mode.system.dynamics, "dynamics", plant, mode.system.n)
        if mode.memory is not None:
            rhs += self._vector(mode.memory.dynamics, "memory dynamics", {**seen, "u": u}, mode.memory.k)
        faces: list[Face] = []
        if mode.constraints is not None:
            faces = self._faces(mode.constraints, {**seen, "u": u, **self._uncertain()})
        tracking: list[Expr] = []
        if mode.output is not None:
            output = self._vector(mode.output, "output", {"x": x}, len(piece.value))
            tracking = [y - value for y, value in zip(output, piece.value, strict=True)]
        exprs = [*rhs, *inputs, *(face.expr for face in faces), *tracking]
        instants = switching_times(exprs, self.time, piece.start, piece.end)
        result = []
        for start, end in pairwise([piece.start, *instants, piece.end]):
            here = resolve(exprs, self.time, start, end)
            self._require_resolved(here, start, end)
            self._keep_obligations(exprs[: len(rhs) + len(inputs)], here[: len(rhs) + len(inputs)])
            parts = iter(here)
            result.append(
                Segment(
                    start=start,
                    end=end,
                    rhs=[next(parts) for _ in rhs],
                    inputs=[next(parts) for _ in inputs],
                    constraints=[Face(face.name, next(parts)) for face in faces],
                    tracking=list(parts),
                )
            )
        return result

    def reset(self) -> list[Expr]:
        """Memory on entry, with the reference at t = 0."""
        memory, piece = self.mode.memory, self.pieces[0]
        if memory is None:
            return []
        now = [at_instant(part, self.time, 0.0) for part in (piece.value, piece.dot, piece.ddot)]
        available = {"x": fixed(self.x), "r": TracedReference.of(*now)}
        return self._vector(memory.reset, "memory reset", available, memory.k)

    def _uncertain(self) -> dict[str, Any]:
        available: dict[str, Any] = {}
        if self.w:
            available["w"] = WatchedArray.of(self.w, self.read_disturbances)
        if self.d:
            available["d"] = self.constants
        return available

    def unread(self) -> tuple[str, ...]:
        """Disturbances and unknowns that no function has touched, whether or not they left a trace."""
        graph, mask = self.graph, 0
        for index, node in enumerate(graph.nodes):
            mask |= 0 if node.op == VAR else graph.masks[index]
        seen = {f"w[{k}]" for k in self.read_disturbances} | {f"d[{name!r}]" for name in self.constants.touched}
        uncertain = {**{f"w[{k}]": e for k, e in enumerate(self.w)}, **{f"d[{n!r}]": e for n, e in self.d.items()}}
        return tuple(n for n, e in uncertain.items() if n not in seen and not graph.masks[e.index] & mask)

    def _vector(self, function: Any, role: str, available: Mapping[str, Any], length: int) -> list[Expr]:
        def read() -> list[Expr]:
            value = self._call(function, role, available)
            return as_vector(value, length, role=role, owner=self.owner, graph=self.graph)

        return twice(read, list, self.graph, f"{self.owner}, {role}")

    def _faces(self, function: Any, available: Mapping[str, Any]) -> list[Face]:
        where = f"{self.owner}, constraints"
        return twice(
            lambda: faces_of(self._call(function, "constraints", available), where),
            lambda faces: [face.expr for face in faces],
            self.graph,
            where,
        )

    def _call(self, function: Any, role: str, available: Mapping[str, Any]) -> Any:
        missing = [
            name
            for name in required_arguments(function, role=role, owner=self.owner)
            if name in _HINTS and name not in available
        ]
        if missing:
            raise ModegraphError(f"{self.owner}, {role} reads {missing[0]!r}, but {_hint(missing[0], role)}")
        return call(function, available, role=role, owner=self.owner)

    def _keep_obligations(self, written: Sequence[Expr], resolved: Sequence[Expr]) -> None:
        """``maximum(t - 1, 0) / x[0]`` is 0 before t = 1, but only where x[0] is not."""
        if not all(a.same(b) for a, b in zip(written, resolved, strict=True)):
            lost = _obligations(self.graph, written) - _obligations(self.graph, resolved)
            self.graph.dropped.extend(sorted(lost))

    def _require_resolved(self, exprs: Sequence[Expr], start: float, end: float) -> None:
        left = jumps(exprs, self.time)
        if left:
            until = "" if math.isinf(end) else f" and before t = {end:g}"
            raise ModegraphError(
                f"{self.owner}: {left[0].text(60)} may switch at an instant after t = {start:g}{until} that "
                "cannot be determined; write it as np.where(t < b, ...) with a number b, and add the "
                "switching instant to breakpoints= of the trajectory"
            )


def _obligations(graph: Graph, exprs: Sequence[Expr]) -> set[int]:
    """Reciprocals and logarithms that are evaluated whatever branch a case distinction takes."""
    seen: set[int] = set()
    stack = [e.index for e in exprs]
    while stack:
        index = stack.pop()
        if index in seen or not graph.partial[index]:
            continue
        seen.add(index)
        node = graph.nodes[index]
        stack.extend(k for k in ((node.c,) if node.op == WHERE else (node.a, node.b)) if k >= 0)
    return {index for index in seen if graph.nodes[index].op in (RECIP, LOG)}


_HINTS = ("w", "d", "z", "t", "u", "r")


def _hint(name: str, role: str) -> str:
    if name == "w" and role in ("dynamics", "constraints"):
        return "the plant has no disturbance; declare it with System(..., disturbance=Box(...))"
    if name == "d" and role in ("dynamics", "constraints"):
        return "the plant has no unknown constants; declare them with System(..., unknowns={name: (lo, hi)})"
    if name == "z" and role in ("controller", "memory dynamics", "constraints"):
        return "the mode has no memory; declare it with Mode(..., memory=Memory(...))"
    allowed = {
        "dynamics": "x, u, w, d",
        "controller": "x, r, t, z",
        "memory dynamics": "x, u, r, t, z",
        "memory reset": "x, r",
        "constraints": "x, u, r, t, z, w, d",
        "output": "x",
    }[role]
    return f"a function in this role may read only {allowed}"
