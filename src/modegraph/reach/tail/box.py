"""All time after some instant: an invariant set around the equilibrium that returns into itself.

A parallelotope B that contains the reach set is taken as a start set of its own; when its flow lies
inside B again, B is invariant for the sampled loop, and the flow in between covers all later time.
Valid because the last segment does not depend on time and the class of disturbances does not either.
Containment in B holds for all unknown constants at once, hence for each of them. For a class of references
the centre of B moves with the parameters, as the equilibria do: B(p) = c + T (p - middle) / radius + axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.rounding import TINY, UNIT
from modegraph.reach.failure import Mechanism
from modegraph.reach.field import Field
from modegraph.reach.float_loop import FloatLoop
from modegraph.reach.flow.flow import Flow, Order
from modegraph.reach.generators import with_box
from modegraph.reach.parallelotope import half_widths, modal_axes
from modegraph.reach.reach_set import ReachSet
from modegraph.reach.start.class_chart import parameters_of, scale_of
from modegraph.reach.start.piece import Chart, Piece
from modegraph.reach.tail.base import Tail, TailFailure

Floats = NDArray[np.float64]

FLOOR = 0.3
"""Least semi-axis of B relative to the largest, so that its aspect ratio is harmless."""

TOO_MUCH_FEEDBACK = 0.6
"""A candidate set whose remainder feeds itself by this share is given up where a disturbance acts: soon the
remainder grows without bound. (That of a class of references may do so for long.)"""


def relevant_states(fld: Field) -> list[int]:
    """States that a constraint or a function with a restricted domain reads, and what feeds them.

    The others grow by what these do and by nothing else: they exist for all time.
    """
    keep = set(range(fld.states))
    while True:
        readers = {k: [i for i in keep if k in fld.reads[i]] for k in keep}
        idle = [k for k in keep if not readers[k] and k not in fld.observed_states]
        if not idle:
            return sorted(keep)
        keep -= set(idle)


class TailSearch:
    """Tries, at instants of a set of flows, to close the time axis."""

    def __init__(
        self,
        fld: Field,
        chart: Chart,
        w_centre: Floats,
        w_radius: Floats,
        names: Sequence[str],
        order: Order,
    ) -> None:
        self.fld = fld
        self.chart = chart
        self.w_centre, self.w_radius = w_centre, w_radius
        self.names = names
        self.order = order
        self.states = relevant_states(fld)
        self.possible = bool(np.isinf(fld.end)) and fld.autonomous
        self._whole = Piece.whole(chart)
        self._tilt = np.zeros((fld.states, len(self._whole.uncertain)))
        self._floats = self._loop(chart.unknown_lo, chart.unknown_hi)

    def _loop(self, lo: Floats, hi: Floats) -> FloatLoop:
        return FloatLoop(self.fld, self.w_centre, self.w_radius, lo, hi)

    def attempt(self, flows: Sequence[Flow]) -> Tail | TailFailure:
        """Try from the present end of the flows (all the pieces of the starts)."""
        if not self.possible:
            return TailFailure(Mechanism.DEPENDS_ON_TIME)
        keep = self.states
        n = self.fld.states
        if any(flow.time < self.fld.start for flow in flows):
            return TailFailure(Mechanism.REFERENCE_MOVES)
        start = max(flow.time for flow in flows)
        if not keep:
            return self._nothing_moves(flows, start)
        ends = [flow.set_at(len(flow.steps)).p[:, 0] for flow in flows]
        centre = self._floats.equilibrium(np.mean(ends, axis=0), keep)
        if centre is None:
            return TailFailure(Mechanism.NO_EQUILIBRIUM)
        self._tilt = self._moving(centre)
        slope = self._floats.jacobian(centre)[np.ix_(keep, keep)]
        if not np.isfinite(slope).all():
            return TailFailure(Mechanism.JACOBIAN_NOT_FINITE)
        decay = -np.linalg.eigvals(slope).real.max()
        if not decay > 1e-9:
            return TailFailure(Mechanism.DOES_NOT_SETTLE, rate=0.0 - float(decay))
        missed = TailFailure(Mechanism.PARALLEL_MODES)
        for frame in (modal_axes(slope), np.eye(len(keep))):
            widest = np.max([self._half_widths(flow, frame, centre) for flow in flows], axis=0)
            if not np.isfinite(widest).all():
                continue
            size = np.maximum(widest * 1.02, FLOOR * widest.max())
            if self.w_radius.any():
                size = np.maximum(size, self._disturbed_size(np.asarray(np.linalg.inv(frame), float), slope, centre))
            # The ends of a class may be known in parts, more tightly than B as a whole will be.
            for growth in (1.0, 1.6, 2.1, 4.0) if self._tilt.any() else (1.0, 1.6):
                axes = np.zeros((n, len(keep)))
                axes[keep] = frame * (size * growth)
                found = self._returns(centre, axes, flows, start, decay)
                if isinstance(found, Tail):
                    return found
                missed = found
        return missed

    def _moving(self, centre: Floats) -> Floats:
        """How the equilibrium moves with the parameters of a class, (n, uncertain unknowns): secants through it."""
        tilt = np.zeros((self.fld.states, len(self._whole.uncertain)))
        for v, _ in parameters_of(self._whole):
            k = v - self.chart.free
            i = int(self._whole.uncertain[k])
            ends = []
            for value in (self.chart.unknown_lo[i], self.chart.unknown_hi[i]):
                lo, hi = self.chart.unknown_lo.copy(), self.chart.unknown_hi.copy()
                lo[i] = hi[i] = value
                ends.append(self._loop(lo, hi).equilibrium(centre, self.states))
            if ends[0] is not None and ends[1] is not None:
                tilt[:, k] = 0.5 * (ends[1] - ends[0])
        return tilt

    def _from_centre(self, flow: Flow) -> ReachSet:
        """The end of a flow, in the coordinates of the fields, without what the centre of B moves by."""
        end = flow.set_at(len(flow.steps))
        if not self._tilt.any():
            return end
        p, n = end.p.copy(), self.fld.states
        lost = np.zeros(n)
        own = dict(parameters_of(flow.piece))
        for v, number in parameters_of(self._whole):
            tilt = self._tilt[:, v - self.chart.free]
            middle, radius = scale_of(self._whole, v)
            mine = next((u for u, k in own.items() if k == number), None)
            if mine is None:
                # Cut to a point, or nearly: what is left of its range is not known here.
                return replace(end, p=np.full_like(p, np.nan))
            c, r = scale_of(flow.piece, mine)
            p[:, 0] -= tilt * ((c - middle) / radius)
            p[:, flow.bounds.linear[mine]] -= tilt * (r / radius)
            lost += np.abs(tilt) * (abs(c) + abs(middle) + r) / radius
        lost = 16.0 * UNIT * (lost * (len(own) + 1) + np.abs(p).sum(axis=1)) + TINY
        return replace(end, p=p, G=with_box(end.G, lost))

    def _disturbed_size(self, inverse: Floats, slope: Floats, centre: Floats) -> Floats:
        """Float estimate of the ultimate bound under the disturbance, in the frame's coordinates."""
        push = np.abs(inverse @ self._floats.disturbance_matrix(centre)[self.states]) @ self.w_radius
        values = np.linalg.eigvals(slope)
        return np.asarray(1.3 * push / max(1e-9, -values.real.max()))

    def _nothing_moves(self, flows: Sequence[Flow], start: float) -> Tail:
        """No state matters to a constraint: they hold for ever as they hold at one instant."""
        last = len(flows[0].fields) - 1
        upper = np.max([f.faces_at(f.time, f.set_at(len(f.steps)), last) for f in flows], axis=0)
        unbounded = np.full(self.fld.states, np.inf)
        return Tail(start, upper, np.full(self.fld.outputs, np.inf), -unbounded, unbounded, np.inf)

    def _returns(
        self, centre: Floats, axes: Floats, flows: Sequence[Flow], start: float, decay: float
    ) -> Tail | TailFailure:
        """Flow B = centre + axes [-1, 1]^k until it is inside itself; check that B holds the flows."""
        keep = self.states
        k = len(keep)
        inside = [self._inside(flow, axes, centre) for flow in flows]
        if not all(inside):
            return TailFailure(Mechanism.NOT_IN_CANDIDATE)
        chart = self.chart.around(centre, axes, self.chart.original)
        if self._tilt.any():
            chart = replace(chart, tilt=self._tilt)
        d = int((chart.unknown_lo < chart.unknown_hi).sum())
        piece = Piece(chart, -np.ones(k + d), np.ones(k + d))
        last = replace(self.fld, start=0.0)
        order = self.order
        if order.weights:
            # Those of the columns of B are not those of the states; the unknowns are the same.
            order = replace(order, weights=(1,) * k + order.weights[len(order.weights) - d :])
        flow = Flow([last], piece, self.w_centre, self.w_radius, order, names=self.names, framed=True)
        span = 25.0 / decay
        while flow.time < span and len(flow.steps) < 400:
            if not flow.advance(span):
                return TailFailure(Mechanism.CANDIDATE_STOPS, failure=flow.failure)
            upper = flow.steps[-1].face_upper
            if not (upper <= 0.0).all():
                bad = self.fld.faces[int(np.argmax(~(upper <= 0.0)))]
                return TailFailure(Mechanism.CONSTRAINT_IN_CANDIDATE, constraint=bad)
            if self._inside(flow, axes, centre):
                return self._tail(flow, start, decay)
            if self.w_radius.any() and not self._tilt.any() and flow.feedback > TOO_MUCH_FEEDBACK:
                return TailFailure(Mechanism.CANDIDATE_FILLED)
        return TailFailure(Mechanism.DOES_NOT_RETURN)

    def _half_widths(self, flow: Flow, axes: Floats, centre: Floats) -> Floats:
        keep = self.states
        return half_widths(self._from_centre(flow).select(keep), axes, centre[keep])

    def _inside(self, flow: Flow, axes: Floats, centre: Floats) -> bool:
        return bool((self._half_widths(flow, axes[self.states], centre) < 1.0).all())

    def _tail(self, flow: Flow, start: float, decay: float) -> Tail:
        lo, hi = flow.tubes()
        faces = np.max([s.face_upper for s in flow.steps], axis=0)
        tracking = np.max([s.tracking for s in flow.steps], axis=0)
        if len(self.states) < self.fld.states:
            tracking = np.full(self.fld.outputs, np.inf)
        below, above = np.full(self.fld.states, -np.inf), np.full(self.fld.states, np.inf)
        if flow.frame is None or len(self.states) == self.fld.states:
            kept = self.states if flow.frame is None else list(range(self.fld.states))
            below[kept] = lo.min(axis=0)[kept]
            above[kept] = hi.max(axis=0)[kept]
        return Tail(start, faces, tracking, below, above, decay)
