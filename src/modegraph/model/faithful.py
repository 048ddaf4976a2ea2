"""What is proved is what was written: the trace of a mode held against its own functions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from modegraph.errors import ModegraphError
from modegraph.expression.repeatable import Comparison, impure
from modegraph.expression.trace import arguments
from modegraph.model.closed_loop import ClosedLoop, Segment, close_loop
from modegraph.model.constraints import relations
from modegraph.model.mode import Mode
from modegraph.model.reference import Floats
from modegraph.model.trajectory import Trajectory

INSTANTS = (0.31, 0.77, 0.52)
"""Of a segment, where it is looked at; of one without an end, of its first seconds."""


def require_faithful(mode: Mode, p: Floats | None = None) -> ClosedLoop:
    """Trace a mode as :func:`close_loop` does, and look whether the trace is what its author wrote.

    Whatever is uncertain must be read by the dynamics or by the constraints of this mode. At some states
    around the starts, every function is called with plain numbers and must return what its trace gives there;
    where one of them is not defined, that state is passed over.

    Raises
    ------
    ModegraphError
        Names mode, function and remedy.
    """
    loop = close_loop(mode, p)
    _require_read(mode, loop)
    if p is not None or mode.reference.region is None:
        p = mode.find(p)
    if isinstance(mode.reference, Trajectory):
        region = mode.reference.region
        mode.reference.require_faithful(region.center if p is None and region is not None else p, mode.label)
    probe = _Probe(mode, p, loop)
    for k, segment in enumerate(loop.segments):
        probe.look(segment, first=len(INSTANTS) * k)
    if mode.memory is not None:
        probe.look_at_reset()
    return loop


def _require_read(mode: Mode, loop: ClosedLoop) -> None:
    """All that is uncertain must be touched: a forgotten ``w`` would be certified against no disturbance at all."""
    if not loop.unread:
        return
    name = loop.unread[0]
    argument = name[0]
    kind, keyword = ("disturbance", "disturbance") if argument == "w" else ("unknown constant", "unknowns")
    what, term = name, f"0 * {name}"
    if argument == "w" and sum(other[0] == "w" for other in loop.unread) == mode.system.q:
        what = "w"
    raise ModegraphError(
        f"{mode.label}: neither the dynamics of {mode.system.label} nor the constraints of this mode read the {kind} "
        f"{what}, so nothing would be proved against it. Name {argument} among the arguments of the dynamics and use "
        f"it where it acts, or leave it out of {keyword}=; where it is meant to have no effect, add {term}"
    )


class _Probe:
    """Calls of one mode's functions with plain numbers, beside the trace."""

    def __init__(self, mode: Mode, p: Floats | None, loop: ClosedLoop) -> None:
        self.mode, self.p, self.loop = mode, p, loop
        self.owner = f"mode {mode.label_of(p)!r}"
        self.variables = [
            *loop.states, loop.time, *loop.disturbance, *loop.unknowns.values(), *loop.parameters
        ]  # fmt: skip

    def look(self, segment: Segment, first: int) -> None:
        """Compare at some states and instants of a segment; ``first``: number of the first state."""
        n, k = self.mode.system.n, len(segment.rhs)
        roots = [*segment.inputs, *segment.rhs, *(face.expr for face in segment.constraints), *segment.tracking]
        compare = Comparison(roots, self.variables)
        p = len(segment.inputs)
        parts = {
            "controller": slice(0, p),
            "dynamics": slice(p, p + n),
            "memory dynamics": slice(p + n, p + k),
            "output": slice(len(roots) - len(segment.tracking), len(roots)),
        }
        length = segment.end - segment.start
        length = length if math.isfinite(length) else 1.0 + segment.start
        for j, fraction in enumerate(INSTANTS):
            point = self.loop.typical[:, (first + j) % self.loop.typical.shape[1]].copy()
            point[k] = segment.start + fraction * length
            self._at(point, segment, compare, parts)

    def look_at_reset(self) -> None:
        """Compare the memory on entry at some states."""
        memory = self.mode.memory
        assert memory is not None
        compare = Comparison(self.loop.reset, self.variables)
        where = f"{self.owner}, memory reset"
        for point in self.loop.typical.T[: len(INSTANTS)]:
            available = {"x": point[: self.mode.system.n], "r": self.mode.reference.at(0.0, self._reference(point))}
            returned = _numbers(_called(memory.reset, available, where), where)
            if returned is None or returned.shape != (memory.k,):
                continue
            wrong = compare.first_wrong(point, returned)
            if wrong is not None:
                text = f"entry {wrong} is {returned[wrong]:.9g}"
                raise impure(where, self._seen(point, text, compare.values(point)[0][wrong]))

    def _reference(self, point: Floats) -> Floats | None:
        """The parameters of the reference at a point; for one reference, always its own."""
        return point[len(point) - len(self.loop.parameters) :] if self.loop.parameters else self.p

    def _at(self, point: Floats, segment: Segment, compare: Comparison, parts: Mapping[str, slice]) -> None:
        mode, k = self.mode, len(segment.rhs)
        n, q, d = mode.system.n, mode.system.q, len(self.loop.unknowns)
        x, t = point[:n], float(point[k])
        r = mode.reference.at(t, self._reference(point))
        seen: dict[str, Any] = {"x": x, "r": r, "t": t} | ({"z": point[n:k]} if mode.memory is not None else {})
        uncertain: dict[str, Any] = {"w": point[k + 1 : k + 1 + q]} if q else {}
        if d:
            uncertain["d"] = dict(zip(self.loop.unknowns, point[k + 1 + q :].tolist(), strict=False))

        def same(function: Any, role: str, available: dict[str, Any], less: Floats | float = 0.0) -> Floats | None:
            """What the function returns, where that is defined, if it is what its trace gives."""
            where = f"{self.owner}, {role}"
            returned = _numbers(_called(function, available, where), where)
            if returned is None or returned.shape != (parts[role].stop - parts[role].start,):
                return None
            wrong = compare.first_wrong(point, returned - less, parts[role])
            if wrong is not None:
                traced = compare.values(point)[0][parts[role]][wrong]
                raise impure(where, self._seen(point, f"entry {wrong} is {(returned - less)[wrong]:.9g}", traced))
            return returned if np.isfinite(returned).all() else None

        u = np.zeros(0) if mode.controller is None else same(mode.controller, "controller", seen)
        if u is None:
            return
        same(mode.system.dynamics, "dynamics", {"x": x, "u": u, **uncertain})
        if mode.memory is not None:
            same(mode.memory.dynamics, "memory dynamics", {**seen, "u": u})
        if mode.output is not None:
            same(mode.output, "output", {"x": x}, np.array(r))
        if mode.constraints is not None:
            self._constraints(point, {**seen, "u": u, **uncertain}, segment, compare)

    def _constraints(self, point: Floats, available: dict[str, Any], segment: Segment, compare: Comparison) -> None:
        """The truth of every constraint, away from its boundary."""
        where = f"{self.owner}, constraints"
        returned = _called(self.mode.constraints, available, where)
        if not isinstance(returned, Mapping):
            return
        found = {name + suffix: value for name, own in returned.items() for suffix, value in relations(own)}
        at = len(segment.inputs) + len(segment.rhs)

        def is_wrong(name: str, values: Floats, slack: Floats) -> bool:
            mine = [at + j for j, face in enumerate(segment.constraints) if face.name == name]
            return bool((values[mine] > slack[mine]).any() if found[name] else (values[mine] < -slack[mine]).all())

        for name in dict.fromkeys(face.name for face in segment.constraints):
            if name not in found:
                raise impure(where, f"{name!r} is missing among what it returns for plain numbers")
            if is_wrong(name, *compare.values(point)) and is_wrong(name, *compare.values_or_jump(point)):
                raise impure(where, self._seen(point, f"{name!r} is {bool(found[name])}", not found[name]))

    def _seen(self, point: Floats, returned: str, traced: object) -> str:
        place = ", ".join(f"{value:.6g}" for value in point[: self.mode.system.n])
        shown = f"{traced:.9g}" if isinstance(traced, float) else str(traced)
        return f"at x = ({place}), t = {point[len(self.loop.states)]:.6g} {returned}, but its trace gives {shown}"


def _called(function: Any, available: dict[str, Any], where: str) -> Any:
    """What a function returns for plain numbers; None where it fails."""
    positional, keywords = arguments(function, available, role=where, owner="")
    # A function may write into what it is given.
    own = {name: value.copy() if type(value) is np.ndarray else value for name, value in keywords.items()}
    try:
        with np.errstate(all="ignore"):
            return function(*positional, **own)
    except Exception:
        return None


def _numbers(returned: Any, where: str) -> Floats | None:
    """As a vector; None where it is no vector of numbers."""
    if returned is None:
        return None
    try:
        return np.atleast_1d(np.asarray(returned, dtype=float))
    except ModegraphError as error:
        raise impure(where, "it returns a value that it kept from an earlier call") from error
    except (TypeError, ValueError):
        return None
