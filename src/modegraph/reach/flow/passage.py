"""Passing a kink: every start at its own time, so that all of them meet it at once.

Where a wide set crosses a kink, a polynomial over all starts misses it by a share of the width of its
argument. At the instant tau(xi) at which the start xi meets it, the set is thin there, and both sides are
smooth. So each start runs d_k(xi) seconds in part k, a validated flow of dx/ds = d_k(xi) f(x): until shortly
before its tau(xi), across the kink, and on until the common end. The d_k are doubles whose sum is the length
of the whole, exactly and for every xi; tau is a proposal, and it may miss the kink.
"""

from __future__ import annotations

import math
from copy import copy
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.monomials import monomials
from modegraph.enclosure.rounding import UNIT
from modegraph.expression.ops import RELU
from modegraph.reach.field import Field
from modegraph.reach.flow.grid import is_exact
from modegraph.reach.flow.kinks import Kinks, Passage
from modegraph.reach.flow.own_time import in_own_time
from modegraph.reach.flow.records import Step
from modegraph.reach.generators import generator_box

if TYPE_CHECKING:
    from modegraph.reach.flow.flow import Flow

Floats = NDArray[np.float64]

FIT_MONOMIALS = 130
"""Most monomials of tau."""
SAMPLES = 2.5
"""Samples of tau per monomial."""
LONGEST_PASSAGE = 60
"""Steps of the present length after which a passage that began must be over."""
MARGIN = 1.5
"""Times what tau misses at the samples, and what the remainder adds, is what is left before the kink."""
EARLY, LATE = 0.3, 0.25
"""Shares of the width of the set, across the kink, between it and the kink at the beginning, and of the
spread of tau between the last tau and the end: less, and the bounds of the argument reach across the kink."""
THIN = 0.3
"""Share of the spread of tau in the margin from which on nothing is gained."""
PATIENCE = 2
"""Steps to wait after the first passage that is not possible; twice as many after each further one."""
FINE = 32
"""Clocks are multiples of 2**-FINE of a usual step, so that they add up exactly."""


class Passages:
    """Passes the kinks of one field, where the steps of a flow come upon one."""

    def __init__(self, flow: Flow) -> None:
        fld = flow.fields[flow.segment]
        self.rows = np.flatnonzero(fld.rates.ops[:, 0] == RELU)
        self.own = in_own_time(fld) if len(self.rows) and flow.piece.variables else None
        if self.own is not None:
            self.kinks = Kinks(fld)
        self._quiet, self._patience = 0, PATIENCE

    def near(self, ranges: Floats) -> bool:
        """Whether an argument changes its sign soon, as its ranges during a step show, or already does."""
        if self.own is None:
            return False
        lo, hi = ranges[self.rows].T
        return bool((np.minimum(-lo, hi) > -EARLY * (hi - lo)).any())

    def attempt(self, flow: Flow, h: float, stop: float) -> Step | None:
        """A step until every start has passed the same kinks; ``h``: seconds of a usual step.

        None where that is not possible; then it waits for ever more steps until it tries again.
        """
        self._quiet -= 1
        if self.own is None or self._quiet > 0:
            return None
        walk = _Walk(flow, self.kinks, self.own, h)
        step = walk.run(stop)
        if step is None:
            self._quiet = self._patience
            self._patience *= 2
            shares = walk.shares()
            flow.astride = flow.astride if shares is None else shares
        else:
            self._patience = PATIENCE
        return step


@lru_cache(maxsize=8)
def _samples(weights: tuple[int, ...], degree: int) -> tuple[Floats, Floats]:
    """Monomials (S, N) at samples of the set variables, and (F, S): values there to the first F coefficients."""
    variables, table = len(weights), monomials(weights, degree)
    fit = int(next(k for k in table.start[:0:-1] if k <= max(FIT_MONOMIALS, variables + 1)))
    rng = np.random.default_rng(5)
    inner = np.cos(np.pi * rng.uniform(size=(int(SAMPLES * fit) + 8, variables)))
    corners = np.sign(rng.uniform(-1.0, 1.0, (8 * variables, variables)))
    xi = np.vstack([inner, corners])
    powers = np.ones((len(xi), table.size))
    for v in range(variables):
        powers *= xi[:, v, None] ** table.exponents[:, v]
    low = powers[:, :fit]
    return powers, np.asarray(np.linalg.solve(low.T @ low, low.T))


class _Walk:
    """One passage: a flow in own time from the last set of a flow in common time."""

    def __init__(self, flow: Flow, kinks: Kinks, own: Field, h: float) -> None:
        self.flow, self.kinks, self.h = flow, kinks, h
        self.powers, self.solve = _samples(flow.order.weights or (1,) * flow.piece.variables, flow.order.degree)
        walk = copy(flow)
        walk.fields, walk.segment, walk.first_segment, walk.time = [own], 0, 0, 0.0
        walk.longest_step, walk.steps = np.inf, []
        walk._spaces, walk._sizes, walk._longest, walk._passages = {}, [], 0.0, None
        self.walk = walk
        self.unit = 2.0 ** (math.frexp(h)[1] - FINE)
        self.clock = np.zeros(flow.table.size)
        """Seconds (N,) each start has run so far."""
        self.knots: list[tuple[Floats, Floats]] = []
        """The clock and p (n, N) at the end of each step."""

    def run(self, stop: float) -> Step | None:
        flow, h = self.flow, self.h
        longest = min(LONGEST_PASSAGE * h, stop - flow.time)
        found = self.kinks.passages(*self._samples(), 0.5 * h, longest, LATE)
        if found is None or not all(self._pass(passage) for passage in found):
            return None
        earliest, latest = (float(t) for t in flow.bounds.ranges(self.clock))
        length = self._on_grid(latest + LATE * (latest - earliest))
        end = flow.time + length
        if not is_exact(flow.time, end) or end - flow.time != length or end > stop:
            return None
        last = self._constant(length) - self.clock
        if not self._part(last) or not np.array_equal(self.clock, self._constant(length)):
            return None
        if not all((step.face_upper <= 0.0).all() for step in self.walk.steps):
            # Shorter steps in common time may prove what these did not.
            return None
        return self._step(end, length)

    def _samples(self) -> tuple[Floats, Floats]:
        """States (n, S) of the samples, and the other variables of the rates."""
        x = self.walk._p @ self.powers.T
        fixed = np.concatenate([[self.flow.time], self.flow.w_centre])
        fixed = np.repeat(fixed[:, None], x.shape[1], axis=1)
        return x, np.vstack([fixed, self.flow._unknowns @ self.powers.T])

    def shares(self) -> Floats | None:
        """Share (m,) of each set variable in the arguments that have both signs now; None: there are none."""
        argument, _ = self.kinks.speeds(*self._samples())
        mixed = argument[(argument.min(axis=1) < 0.0) & (argument.max(axis=1) > 0.0)]
        if not len(mixed):
            return None
        linear = np.abs(mixed @ self.solve.T)[:, self.flow.table.linear]
        return np.asarray((linear / np.maximum(linear.sum(axis=1, keepdims=True), 1e-300)).sum(axis=0))

    def _ahead(self, kink: int) -> tuple[Floats, Floats]:
        """Seconds (S,) until the samples meet a kink at their present speed, and how much the remainder adds."""
        x, rest = self._samples()
        argument, speed = self.kinks.speeds(x, rest)
        swing = self.kinks.swings(x, rest, generator_box(self.walk._G))
        return -argument[kink] / speed[kink], swing[kink] / np.abs(speed[kink])

    def _pass(self, passage: Passage) -> bool:
        """Run until shortly before tau, then together: until the first may meet the kink, and past the last."""
        coefficients = self.solve @ passage.seconds
        fit = len(coefficients)
        miss = float(np.abs(self.powers[:, :fit] @ coefficients - passage.seconds).max())
        margin = MARGIN * (miss + float(np.median(self._ahead(passage.kink)[1])))
        thin = THIN * float(np.ptp(passage.seconds))
        if not margin < thin:
            return False
        tau = np.zeros_like(self.clock)
        tau[:fit] = np.round(coefficients / self.unit) * self.unit
        tau[0] -= self._on_grid(margin)
        if not self._part(tau - self.clock):
            return False
        ahead, off = self._ahead(passage.kink)
        first, last = float((ahead - MARGIN * off).min()), float((ahead + MARGIN * off).max())
        if not (last - first < 2.0 * thin and 0.0 < last < np.inf):
            return False
        spread = 0.1 * (last - first)
        first, last = max(0.0, first - spread), last + spread
        together = [self._on_grid(s) for s in (first, last - first) if s > self.unit]
        return all(self._part(self._constant(s)) for s in together)

    def _part(self, seconds: Floats) -> bool:
        """Every start runs so many seconds (N,) of its own; False where that is not proved."""
        walk = self.walk
        total = self.clock + seconds
        back = total - self.clock
        # The sum has no rounding error (Knuth), and no start stands still or goes back.
        exact = np.array_equal(back, seconds) and np.array_equal(total - back, self.clock)
        if not exact or not float(-self.flow.bounds.upper(-seconds)) > 0.0:
            return False
        done, begin = len(walk.steps), walk.time
        walk._unknowns = np.vstack([self.flow._unknowns, seconds])
        walk.h = min(1.0, self.h / float(seconds[0]))
        if not walk.run(begin + 1.0):
            return False
        self.h = walk.h * float(seconds[0]) if len(walk.steps) > done + 1 else self.h
        for step in walk.steps[done:]:
            self.knots.append((self.clock + (step.end - begin) * seconds, step.p))
        self.clock = total
        return True

    def _constant(self, seconds: float) -> Floats:
        """The same for every start."""
        out = np.zeros_like(self.clock)
        out[0] = seconds
        return out

    def _on_grid(self, seconds: float) -> float:
        return float(np.ceil(seconds / self.unit) * self.unit)

    def _step(self, end: float, length: float) -> Step:
        """The walk as one step in common time."""
        walk, flow = self.walk, self.flow
        travel = walk._p - flow._p
        nonlinear = np.abs(travel[:, 1:]).sum(axis=1)
        bend = np.zeros(len(travel))
        for clock, p in self.knots:
            # The chord in common time, at the clocks of the starts: p(0) + clock / length (p(end) - p(0)).
            # Between two knots the clock and the chord of p are both linear in s.
            share = clock / length
            off = p - flow._p - share[0] * travel
            off[:, 1:] -= np.outer(travel[:, 0], share[1:])
            size = (np.abs(p).sum(axis=1) + np.abs(flow._p).sum(axis=1)) * (1.0 + np.abs(share).sum())
            distance = np.abs(off).sum(axis=1) + np.abs(share[1:]).sum() * nonlinear
            bend = np.maximum(bend, distance + 16.0 * (len(share) + 8) * UNIT * size)
        steps = walk.steps
        return Step(
            flow.time, end, walk._p, walk._G,
            np.max([s.tube for s in steps], axis=0),
            (bend + np.max([s.bend for s in steps], axis=0)) * (1.0 + 1e-12),
            np.max([s.face_upper for s in steps], axis=0),
            steps[-1].energy, steps[-1].energy_radius,
            np.max([s.tracking for s in steps], axis=0),
            flow.segment,
        )  # fmt: skip
