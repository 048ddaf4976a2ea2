"""A mode under one reference, traced and compiled for the engine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..expression.evaluate import Evaluator
from ..expression.tape import Tape, compile_tape
from ..model.closed_loop import ClosedLoop, close_loop, mode_start
from ..model.mode import Mode
from ..model.sets import Set
from .field import Field, Frame, compile_field, disturbance_box
from .parallelotope import slow_and_fast_axes
from .start import Piece, whole

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class CompiledMode:
    """A mode under one reference, ready for the engine."""

    loop: ClosedLoop
    fields: list[Field]
    start: Set
    reset: Tape | None
    w_centre: Floats
    w_radius: Floats
    unknowns: dict[str, tuple[float, float]]
    stops: Sequence[float]

    @property
    def plant(self) -> int:
        return len(self.loop.states) - len(self.loop.reset)

    @property
    def linear(self) -> bool:
        """Jacobian and disturbance matrix are constant on every segment."""
        return all(f.linear for f in self.fields)

    def framed_fields(self) -> list[Field]:
        """The fields in the modes of the loop, where a disturbance meets a nonlinear loop."""
        if self.linear or not self.w_radius.any():
            return self.fields
        axes = slow_and_fast_axes(self._slope())
        frame = None if (axes == np.eye(len(axes))).all() else Frame.of(axes)
        if frame is None:
            return self.fields
        return [compile_field(self.loop, segment, frame) for segment in self.loop.segments]

    def _slope(self) -> Floats:
        """Float Jacobian (n, n) of the last segment at the centre of the starts."""
        fld = self.fields[-1]
        n = fld.states
        x = np.zeros(n)
        centre = np.asarray(self.start.center, float)
        x[: len(centre)] = centre
        d = [0.5 * (lo + hi) for lo, hi in self.unknowns.values()]
        at = np.concatenate([x, [fld.start], self.w_centre, d])[:, None]
        return np.asarray(Evaluator(fld.jacobian)(at)[: n * n, 0].reshape(n, n))

    def whole(self) -> Piece:
        return whole(self.start, list(self.unknowns.values()))

    @property
    def own_reset(self) -> Tape | None:
        """The reset to apply to the start set; None where the set already holds the memory."""
        return self.reset if self.start.dim == self.plant else None


def compile_reset(loop: ClosedLoop) -> Tape | None:
    """The memory on entry as a function of the plant states."""
    if not loop.reset:
        return None
    return compile_tape(loop.reset, loop.states[: len(loop.states) - len(loop.reset)])


def compile_mode(mode: Mode, p: Floats | None, start: Set | None = None, *, observed: bool = True) -> CompiledMode:
    """Trace and compile a mode; raises `ModegraphError` where the model is wrong.

    Without ``observed``, the states alone are followed: no constraints, inputs or tracking errors.
    """
    loop = close_loop(mode, p)
    if not observed:
        bare = [replace(segment, constraints=[], inputs=[], tracking=[]) for segment in loop.segments]
        loop = replace(loop, segments=bare)
    centre, radius = disturbance_box(mode.system.disturbance)
    unknowns = {name: (float(lo), float(hi)) for name, (lo, hi) in (mode.system.unknowns or {}).items()}
    return CompiledMode(
        loop=loop,
        fields=[compile_field(loop, segment) for segment in loop.segments],
        start=mode_start(mode, p) if start is None else start,
        reset=compile_reset(loop),
        w_centre=centre,
        w_radius=radius,
        unknowns=unknowns,
        stops=[],
    )
