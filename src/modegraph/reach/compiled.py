"""A mode under one reference, or a continuous class of them, traced and compiled for the engine."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from modegraph.errors import ModegraphError
from modegraph.expression.evaluate import Evaluator
from modegraph.expression.tape import Tape, compile_tape
from modegraph.model.class_start import StartClass, class_start
from modegraph.model.closed_loop import ClosedLoop, close_loop, mode_start
from modegraph.model.mode import Mode
from modegraph.model.sets import Set
from modegraph.reach.field import Field, Frame, compile_field, disturbance_box
from modegraph.reach.flow.flow import Flow, Order
from modegraph.reach.parallelotope import slow_and_fast_axes
from modegraph.reach.start.class_chart import class_chart
from modegraph.reach.start.piece import Piece, whole

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class CompiledMode:
    """A mode under one reference, or under a continuous class of them, ready for the engine."""

    loop: ClosedLoop
    fields: list[Field]
    start: Set | StartClass
    reset: Tape | None
    w_centre: Floats
    w_radius: Floats
    unknowns: dict[str, tuple[float, float]]
    parameters: list[tuple[float, float]]
    """Ranges of the parameters of a continuous class; empty for one reference."""

    @property
    def plant(self) -> int:
        return len(self.loop.states) - len(self.loop.reset)

    @property
    def linear(self) -> bool:
        """Jacobian and disturbance matrix are constant on every segment."""
        return all(f.linear for f in self.fields)

    @property
    def flat(self) -> bool:
        """States are affine in starts, disturbance and unknowns together: linear, also in how all enter."""
        curved = isinstance(self.start, StartClass) and not self.start.is_affine
        return all(f.flat for f in self.fields) and not curved

    def flow(self, piece: Piece, order: Order, **options: Any) -> Flow:
        """A flow from a piece of the starts; options as of `Flow`."""
        return Flow(
            self.fields, piece, self.w_centre, self.w_radius, order,
            names=self.loop.names, reset=self.own_reset, **options,
        )  # fmt: skip

    @cached_property
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
        d = [0.5 * (lo + hi) for lo, hi in [*self.unknowns.values(), *self.parameters]]
        at = np.concatenate([x, [fld.start], self.w_centre, d])[:, None]
        return np.asarray(Evaluator(fld.jacobian)(at)[: n * n, 0].reshape(n, n))

    def whole(self) -> Piece:
        ranges = [*self.unknowns.values(), *self.parameters]
        if not isinstance(self.start, StartClass):
            return whole(self.start, ranges, len(self.parameters))
        lo, hi = (np.array(side, float) for side in zip(*ranges, strict=True))
        return Piece.whole(class_chart(self.start, lo, hi))

    @property
    def one_start(self) -> Set:
        """The start set, of a mode under one reference."""
        if isinstance(self.start, StartClass):
            raise ModegraphError("this needs one reference of the class; name it by its parameters")
        return self.start

    @property
    def own_reset(self) -> Tape | None:
        """The reset to apply to the start set; None where the set already holds the memory."""
        return self.reset if self.start.dim == self.plant else None


def compile_reset(loop: ClosedLoop) -> Tape | None:
    """The memory on entry as a function of the plant states, and of the parameters of a class."""
    if not loop.reset:
        return None
    return compile_tape(loop.reset, [*loop.states[: len(loop.states) - len(loop.reset)], *loop.parameters])


def compile_mode(mode: Mode, p: Floats | None, start: Set | None = None, *, observed: bool = True) -> CompiledMode:
    """Trace and compile a mode; raises `ModegraphError` where the model is wrong.

    For a continuous class of references, p = None stands for all of it. Without ``observed``, the states alone
    are followed: no constraints, inputs or tracking errors.
    """
    loop = close_loop(mode, p)
    if not observed:
        bare = [replace(segment, constraints=[], inputs=[], tracking=[]) for segment in loop.segments]
        loop = replace(loop, segments=bare)
    region = mode.reference.region if loop.parameters else None
    starts = start if start is not None else mode_start(mode, p) if region is None else class_start(mode)
    centre, radius = disturbance_box(mode.system.disturbance)
    unknowns = {name: (float(lo), float(hi)) for name, (lo, hi) in (mode.system.unknowns or {}).items()}
    return CompiledMode(
        loop=loop,
        fields=[compile_field(loop, segment) for segment in loop.segments],
        start=starts,
        reset=compile_reset(loop),
        w_centre=centre,
        w_radius=radius,
        unknowns=unknowns,
        parameters=[] if region is None else list(zip(region.lo.tolist(), region.hi.tolist(), strict=True)),
    )
