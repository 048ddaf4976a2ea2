"""What a flow has passed: sets at the instants of its grid, tubes between them, constraints at one instant."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.monomials import Monomials
from modegraph.enclosure.rounding import UNIT
from modegraph.expression.tape import Tape
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.field import Field, Frame
from modegraph.reach.flow.framing import out_of_frame
from modegraph.reach.flow.records import Order, Step
from modegraph.reach.pointwise import evaluate_over
from modegraph.reach.reach_set import ReachSet

Floats = NDArray[np.float64]


class Passed:
    """The steps of a flow, and what they say. `Flow` makes them."""

    fields: Sequence[Field]
    order: Order
    table: Monomials
    bounds: PolynomialBounds
    frame: Frame | None
    w_centre: Floats
    w_radius: Floats
    time: float
    steps: list[Step]
    p0: Floats
    G0: Floats
    _unknowns: Floats

    def evaluate(self, tape: Tape, inputs: Floats, radius: Floats) -> tuple[Floats, Floats, int]:
        """Outputs of a tape at one instant: polynomials (no, N), radii (no,), first undefined row or -1."""
        return evaluate_over(tape, self.table, self.order.degree, inputs, radius)

    def variables_at(self, t: float, reach: ReachSet, fld: Field) -> tuple[Floats, Floats]:
        """Polynomials (nv, N) and radii (nv,) of all tape variables at one instant; the set as `set_at` gives it."""
        inputs = np.zeros((fld.variables, self.table.size))
        inputs[: fld.states] = reach.p
        inputs[fld.time_index, 0] = t
        inputs[fld.first_w : fld.first_d, 0] = self.w_centre
        inputs[fld.first_d :] = self._unknowns
        radius = np.zeros(fld.variables)
        radius[: fld.states] = reach.spread
        radius[fld.first_w : fld.first_d] = self.w_radius
        return inputs, radius

    def faces_at(self, t: float, reach: ReachSet, segment: int) -> Floats:
        """Proved upper bound of every constraint face on a set at one instant, with the inputs of ``segment``."""
        fld = self.fields[segment]
        if not fld.faces:
            return np.zeros(0)
        inputs, radius = self.variables_at(t, reach, fld)
        value, off, _ = self.evaluate(fld.observed, inputs, radius)
        faces = value[: len(fld.faces)]
        upper = self.bounds.upper(faces)
        for i in np.flatnonzero((upper + off[: len(faces)] > 0.0) & np.isfinite(off[: len(faces)])):
            upper[i] = min(upper[i], self.bounds.refined_upper(faces[i], -float(off[i])))
        return np.asarray(upper + off[: len(faces)])

    @property
    def times(self) -> Floats:
        """Grid instants, start included."""
        return np.array([self.steps[0].start if self.steps else self.time, *(s.end for s in self.steps)])

    def set_at(self, k: int) -> ReachSet:
        """The set at grid instant k, in the coordinates of the fields."""
        return self._own(self.p0, self.G0) if k == 0 else self._own(self.steps[k - 1].p, self.steps[k - 1].G)

    def _own(self, p: Floats, G: Floats) -> ReachSet:
        return ReachSet.of(self.bounds, p, G)

    def reach_set(self, k: int) -> ReachSet:
        """The set at grid instant k, in the coordinates of the states."""
        own = self.set_at(k)
        return own if self.frame is None else self._own(*out_of_frame(self.frame, own.p, own.G))

    @property
    def last_set(self) -> ReachSet:
        """The set at the end, in the coordinates of the states."""
        return self.reach_set(len(self.steps))

    def swell(self, step: Step) -> Floats:
        """Box (n,) by which the tube of a step exceeds the hull of p at its ends, state coordinates."""
        out = (step.bend + step.tube) * (1.0 + 4.0 * UNIT)
        if self.frame is not None:
            # V p is rounded at both ends; the polynomials of neighbouring instants are of one size.
            size = 8.0 * (step.p.shape[1] + len(out) + 8) * UNIT * (np.abs(step.p).sum(axis=1) + out)
            out = np.abs(self.frame.V) @ (out + size) * (1.0 + 8.0 * (len(out) + 2) * UNIT)
        return np.asarray(out)

    def tubes(self) -> tuple[Floats, Floats]:
        """Boxes (steps, n) of everything passed during each closed step."""
        polynomials = np.stack([self.reach_set(k).p for k in range(len(self.steps) + 1)])
        lo, hi = self.bounds.ranges(polynomials)
        out = np.stack([self.swell(s) for s in self.steps])
        if self.frame is not None:
            before = np.concatenate([out[:1], out[:-1]])
            out = np.maximum(out, out + 1e-12 * (before + np.abs(polynomials).sum(axis=2)[:-1]))
        below = np.minimum(lo[:-1], lo[1:]) - out
        above = np.maximum(hi[:-1], hi[1:]) + out
        return np.nextafter(below, -np.inf), np.nextafter(above, np.inf)
