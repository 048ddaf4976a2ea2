"""A flowpipe of one piece that is started again where a disturbance makes that tighter."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy

import numpy as np

from modegraph.deadline import NEVER, Deadline
from modegraph.reach.compiled import CompiledMode
from modegraph.reach.cover.cuts import nonlinear_variable
from modegraph.reach.cover.restart import again, halved, restarted
from modegraph.reach.failure import Failure, Mechanism
from modegraph.reach.flow.flow import LATE_FEEDBACK, Order
from modegraph.reach.start.piece import Piece


class Chain:
    """Flows of one piece; each but the first continues from an enclosure of the end of the one before.

    Chains that are halves of another share its first flows.
    """

    def __init__(self, compiled: CompiledMode, piece: Piece, order: Order, deadline: Deadline = NEVER) -> None:
        """``deadline``: at which it stops where it is."""
        self.deadline = deadline
        self.piece = piece
        self.order = order
        self.compiled = compiled
        first = compiled.flow(piece, order, lean=True)
        self.flows = [first]
        self.failure: Failure | None = first.failure
        """Why it stopped; None while it has not."""
        self.begun = first.failure is None
        self.shared = 0
        """Number of flows that other chains have too."""

    def run(self, end: float, give_up: Callable[[Chain], bool] | None = None) -> bool:
        """Advance until ``end``, or until ``give_up``; False when the flowpipe failed before."""
        while self.flows[-1].time < end:
            if give_up is not None and give_up(self):
                return True
            flow = self.flows[-1]
            if self.deadline.is_over:
                self.failure = Failure(Mechanism.OUT_OF_TIME, time=flow.time)
                return False
            if not flow.advance(end):
                self.failure = flow.failure
                self._drop_unbounded()
                return False
            if not self.compiled.linear and flow.wants_restart():
                following = again(self.compiled, [flow], end, first=len(self.flows) == 1)
                if following is not None:
                    self.flows.append(following)
        return True

    def _drop_unbounded(self) -> None:
        """Take back last steps whose bounds are not finite."""
        flow = self.flows[-1]
        while flow.steps:
            last = flow.steps[-1]
            if all(np.isfinite(a).all() for a in (last.p, last.G, last.tube, last.bend)):
                break
            flow.steps.pop()
        if not flow.steps and len(self.flows) > 1:
            self.flows.pop()

    def weak(self) -> list[int]:
        """Indices of its own flows, where cutting their starts helps most first.

        What a remainder feeds to itself comes from how much the Jacobian varies over the set: the first flow
        in which that is much is where the set has become too large for all that follow.
        """
        fed = self.fed()
        return fed + [k for k in reversed(range(self.shared, len(self.flows))) if k not in fed]

    def fed(self) -> list[int]:
        """Indices of its own flows whose remainders fed themselves much at the end."""
        return [k for k in range(self.shared, len(self.flows)) if self.flows[k].feedback >= LATE_FEEDBACK]

    def halves(self, k: int) -> list[Chain]:
        """Chains, not yet run, that share the flows before the restarted flow k and go on from its halves."""
        whole, found = self.flows[k], []
        if whole.piece.chart.free > len(whole.p0):
            # In a parallelotope each axis carries all of the width: half of one of many columns is no half.
            whole = restarted([self.flows[k - 1]], whole.fields, compact=True) or whole
        for flow in halved(whole, nonlinear_variable(whole)):
            chain = copy(self)
            chain.flows, chain.shared, chain.failure = [*self.flows[:k], flow], k, None
            found.append(chain)
        return found

    @property
    def time(self) -> float:
        """Instant until which everything is enclosed, seconds."""
        steps = self.flows[-1].steps
        return steps[-1].end if steps else 0.0
