"""The flowpipe of one piece: validated steps, with step control, and what is observed along them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.arguments import Errors, Guess, Initial, Settings, Workspace, program
from modegraph.enclosure.monomials import Monomials, monomials
from modegraph.enclosure.rounding import UNIT
from modegraph.enclosure.step import DONE, NO_CONTRACTION, flow_step
from modegraph.expression.tape import Tape
from modegraph.guarded import note
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.failure import Failure, Mechanism, engine_stopped
from modegraph.reach.field import Field
from modegraph.reach.flow.breakdown import breakdown
from modegraph.reach.flow.error_table import error_table
from modegraph.reach.flow.framing import into_frame
from modegraph.reach.flow.grid import next_instant
from modegraph.reach.flow.observation import observed_along
from modegraph.reach.flow.passage import Passages
from modegraph.reach.flow.passed import Passed
from modegraph.reach.flow.records import Order, Step
from modegraph.reach.flow.step_control import (
    GROWTH_CAP,
    MOST_TIME_DEGREE,
    error_guess,
    feeding_cap,
    rate_cap,
    time_degree,
)
from modegraph.reach.generators import generator_box, thinned
from modegraph.reach.pointwise import workspace
from modegraph.reach.start.class_chart import start_polynomials
from modegraph.reach.start.piece import Piece

Floats = NDArray[np.float64]

JACOBIAN_TIME_DEGREE = 2
FUNDAMENTAL_TIME_DEGREE = 5
TOLERANCE = 1e-7
"""Local error per second aimed at, relative to the size of the states."""
OUTGROWN = 1e3
"""A remainder this many times larger than the set is given up."""
RUNAWAY_STEPS = 10
"""A remainder that doubles over this many steps while they cover little time is given up."""
RESTART_STEPS, RESTART_FEEDBACK, RESTART_SHARE = 12, 0.05, 0.3
"""A disturbed flow is enclosed and started again after this many steps, when the remainder feeds
itself by this share and is this large relative to the polynomial part."""
LATE_FEEDBACK = 0.4
"""The share for flows that were restarted twice: then the set is small, and restarting only widens it."""
SHORTER_LOOKS = 4
"""How often a step is cut to a quarter because a constraint cannot be proved between its ends."""
SMALLEST_STEP = 1e-7
"""A flowpipe stops when its step falls below this part of the time scale of the loop."""


class Flow(Passed):
    """Flowpipe of one piece of the starts of one mode, extended step by step.

    Parameters
    ----------
    fields : one compiled field per segment of the reference.
    piece : starts and unknowns.
    w_centre, w_radius : (q,) the disturbance set; for a fixed disturbance the radius is 0.
    order : degrees.
    reset : tape of the memory as a function of the plant state, where the piece is on the plant only.
    framed : the piece is given in the coordinates of the fields' frame.
    generation : how often the starts were enclosed again.
    longest_step : seconds; switching instants are ends of steps, so steps must not be too long.
    t0, energy : seconds and a bound of int u'u at the start, kept as ``spent``, for a flow that continues another.
    lean : only boxes are kept of the remainders behind the last step.
    """

    def __init__(
        self,
        fields: Sequence[Field],
        piece: Piece,
        w_centre: Floats,
        w_radius: Floats,
        order: Order,
        *,
        names: Sequence[str],
        reset: Tape | None = None,
        t0: float = 0.0,
        energy: float = 0.0,
        framed: bool = False,
        longest_step: float = np.inf,
        generation: int = 0,
        lean: bool = False,
    ) -> None:
        self.fields = list(fields)
        self.piece = piece
        self.order = order
        self.names = list(names)
        self.w_centre, self.w_radius = w_centre, w_radius
        self.table: Monomials = monomials(order.weights or (1,) * piece.variables, order.degree)
        q = min(order.jacobian, order.degree)
        self.small = int(self.table.start[q + 1])
        self.q = q
        self.seen = min(order.degree, max(q, 2))
        self.failure: Failure | None = None
        self.time = t0
        self.segment = 0
        while self.fields[self.segment].end <= t0:
            self.segment += 1
        self.first_segment = self.segment
        self.longest_step = longest_step
        self.generation = generation
        self.lean = lean
        self.steps: list[Step] = []
        self.h = 0.0
        n = self.fields[0].states
        self.bounds = PolynomialBounds(piece, self.table, self.table.size)
        seen = int(self.table.start[self.seen + 1])
        self.seen_bounds = PolynomialBounds(piece, self.table, seen)
        p, unknowns, slack = start_polynomials(piece, self.table)
        self._unknowns = unknowns
        self._errors = error_table(self.table, self.q, n)
        self._spaces: dict[tuple[int, str], Workspace] = {}
        self.series: Workspace
        self.time_degree = MOST_TIME_DEGREE
        self._cut = np.full(MOST_TIME_DEGREE + 1, order.degree, np.int64)
        if order.degree > 3:
            # The degree kept falls with the power of time: the dropped part is in the defect.
            fall = np.array([0, 0, 0, 1, 1, 2, 2, 2, 2])
            self._cut = np.maximum(order.degree - fall, 2).astype(np.int64)
        G = np.zeros((0, n, self.small))
        if not np.isfinite(slack).all():
            self.failure = Failure(Mechanism.CLASS_TOO_LARGE)
            slack = np.zeros(len(slack))
        if reset is not None and p.shape[0] < n:
            p, slack = self._with_memory(p, slack, reset)
        self.frame = self.fields[0].frame
        if self.frame is not None and not framed:
            p, slack = into_frame(self.frame, p, slack)
        if slack.any():
            G = np.zeros((n, n, self.small))
            G[np.arange(n), np.arange(n), 0] = slack * (1.0 + 4.0 * UNIT)
        self.p0, self.G0 = p, G
        self._p, self._G = p, G
        self.remainder = generator_box(G)
        """A box (n,) of the last remainder, in the coordinates of the fields."""
        self._ebox = np.zeros(n)
        self._ybox = np.zeros(n)
        self._growth: Floats | None = None
        self._energy = np.zeros(seen)
        self.spent = energy
        self._energy_radius = energy
        self.feedback = 0.0
        self.next_restart = RESTART_STEPS
        self._sizes: list[float] = []
        self._longest = 0.0
        self._passages: dict[int, Passages] | None = {}
        self.astride: Floats | None = None
        """Shares (m,) of the set variables in a kink that only some of the starts had passed."""

    # -- the start -------------------------------------------------------------------------------

    def _with_memory(self, p: Floats, slack: Floats, reset: Tape) -> tuple[Floats, Floats]:
        """Append z = reset(x) to the states of the start."""
        k = len(reset.outputs)
        inputs = np.zeros((len(reset.variables), self.table.size))
        inputs[: len(p)] = p
        parameters = len(inputs) - len(p)
        inputs[len(p) :] = self._unknowns[len(self._unknowns) - parameters :]
        radius = np.zeros(len(reset.variables))
        radius[: len(p)] = slack
        z, off, bad = self.evaluate(reset, inputs, radius)
        if bad >= 0 or not np.isfinite(off).all():
            self.failure = Failure(Mechanism.RESET_UNDEFINED, label=reset.labels[max(bad, 0)])
            off = np.zeros(k)
        return np.vstack([p, z]), np.concatenate([slack, off])

    # -- stepping --------------------------------------------------------------------------------

    def space(self, kind: str, tape: Tape, K: int, size: int, degree: int) -> Workspace:
        """Arrays for the nodes of a tape, the same for each step of a segment."""
        key = (self.segment, kind)
        if key not in self._spaces:
            self._spaces[key] = workspace(tape, K, size, degree)
        return self._spaces[key]

    def _first_step(self) -> float:
        fld = self.fields[self.segment]
        span = 1.0 if np.isinf(fld.end) else fld.end - self.time
        return min(0.05, span)

    def advance(self, limit: float) -> bool:
        """One step towards ``limit``; False when the flowpipe has failed."""
        try:
            with np.errstate(all="ignore"):
                return self._advance(limit)
        except Exception as error:
            # What was proved until here stays proved.
            note(f"a step from t = {self.time:.6g} s", error)
            mechanism, fields = engine_stopped(error)
            self.failure = Failure(mechanism, **fields)
            return False

    def _advance(self, limit: float) -> bool:
        if self.failure is not None:
            return False
        fld = self.fields[self.segment]
        if self.h <= 0.0:
            self.h = self._first_step()
        stop = min(limit, fld.end)
        h_try = min(self.h, self.longest_step)
        shortened = 0
        for _ in range(60):
            t1 = next_instant(self.time, h_try, stop)
            h = t1 - self.time
            outcome = self._attempt(fld, h)
            status, node, p, G, tube, bend, rest, control = outcome
            passed = self._pass_kinks(h, stop)
            if passed is not None:
                self._append(passed)
                return True
            scale = TOLERANCE * (1.0 + np.abs(self._p[:, 0]).max())
            if status == DONE and np.isfinite(control).all():
                rate, floor = control[0] / h, max(scale, 0.3 * control[1] / h)
                factor = 1.6 if rate <= 0.0 else min(1.6, max(0.3, 0.9 * (floor / rate) ** (1.0 / self.time_degree)))
                if rate > 4.0 * floor and h > 1e-4:
                    self.time_degree = MOST_TIME_DEGREE
                    h_try = h * min(0.8, factor)
                    continue
                caps = min(
                    (
                        cap / value
                        for value, cap in (
                            (control[2], GROWTH_CAP),
                            (control[3], rate_cap(fld, bool(self.w_radius.any()))),
                        )
                        if value > 0.0
                    ),
                    default=1.6,
                )
                if caps < 0.5 and h > 1e-4:
                    h_try = h * caps
                    continue
                factor = min(factor, caps, feeding_cap(self.piece, outcome))
                degree = self.time_degree
                if self.w_radius.any():
                    degree = time_degree(degree, rate / floor, float(control[3]))
                seen = observed_along(self, fld, h, tube)
                look = shortened < SHORTER_LOOKS and h > 1e-6 and not (seen[0] <= 0.0).all()
                # Between the ends a constraint is bounded through its bend: try a shorter look.
                if look and (self.faces_at(t1, self._own(p, G), self.segment) <= 0.0).all():
                    shortened += 1
                    h_try = 0.25 * h
                    continue
                self.h = h * max(0.1, factor) if h > 0.5 * h_try else h_try
                break
            h_try = 0.4 * h
            if h_try < SMALLEST_STEP:
                self._fail(fld, status, node)
                return False
        else:
            self._fail(fld, NO_CONTRACTION, 0)
            return False
        self.feedback, self.time_degree = float(control[4]), degree
        self._ybox = rest
        self._record(t1, p, G, tube, bend, seen)
        if not np.isfinite(p).all() or self._runs_away():
            self._fail(fld, NO_CONTRACTION, 0)
            return False
        return True

    def _pass_kinks(self, h: float, stop: float) -> Step | None:
        """Where the step just tried crosses a kink: one that passes it as a whole, if possible."""
        if self._passages is None:
            return None
        if self.segment not in self._passages:
            self._passages[self.segment] = Passages(self)
        passages = self._passages[self.segment]
        ranges = self.series.ranges
        return passages.attempt(self, h, stop) if passages.near(ranges) else None

    def _runs_away(self) -> bool:
        """Whether the remainder has begun its last growth: it feeds itself while the steps shrink."""
        size = float(self.remainder.max(initial=0.0))
        self._sizes.append(size)
        if size > OUTGROWN * (1.0 + np.abs(self._p).sum(axis=1).max()):
            return True
        self._longest = max(self._longest, self.steps[-1].end - self.steps[-1].start)
        back = RUNAWAY_STEPS
        if len(self._sizes) <= back or size == 0.0:
            return False
        mean = (self.steps[-1].end - self.steps[-back].start) / back
        return size > 2.0 * self._sizes[-back - 1] and mean < 0.15 * self._longest and self.feedback > 0.5

    def _attempt(self, fld: Field, h: float) -> Any:
        f, j = fld.rates, fld.jacobian
        K, KJ = self.time_degree, JACOBIAN_TIME_DEGREE
        big = self.series = self.space(f"f{K}", f, K, self.table.size, self.order.degree)
        jac = self.space("j", j, KJ, self._errors.table.size, self._errors.table.order)
        inputs = np.zeros((fld.variables, self.table.size))
        inputs[: fld.states] = self._p
        inputs[fld.time_index, 0] = self.time
        inputs[fld.first_w : fld.first_d, 0] = self.w_centre
        inputs[fld.first_d :] = self._unknowns
        n = fld.states
        most = ((60 if fld.linear or n < 4 else 60 if self.q <= 3 else 30) if self.w_radius.any() else 12) * n + 8
        moving = self.w_radius if self.w_radius.any() else np.zeros(0)
        outputs = j.outputs
        if not len(moving):
            outputs = np.concatenate([outputs[: n * n], outputs[n * n + n * fld.disturbances :]])
        longer = h / (self.steps[-1].end - self.steps[-1].start) if self.steps else 1.0
        guess = error_guess(self._ebox, self._ybox, self.remainder, self._growth, longer)
        return flow_step(
            program(f), program(j)._replace(outputs=outputs),
            Initial(inputs, self._G, moving, fld.full_w and len(moving) > 0, fld.first_w, fld.time_index),
            Settings(
                h, self._cut[: K + 1], np.full(KJ + 1, self._errors.table.order, np.int64), self.q,
                FUNDAMENTAL_TIME_DEGREE, most,
            ),
            Guess(*guess), big, jac, self.table.arrays, self._errors.table.arrays,
            Errors(self._errors.embed, self._errors.owner, self._errors.variables),
        )  # fmt: skip

    def _record(
        self,
        t1: float,
        p: Floats,
        G: Floats,
        tube: Floats,
        bend: Floats,
        seen: tuple[Floats, Floats, float, Floats],
    ) -> None:
        face_upper, mean, mean_radius, tracking = seen
        h = t1 - self.time
        energy = self._energy + h * mean
        rounding = 4.0 * UNIT * float(np.abs(energy).sum() + h * np.abs(mean).sum())
        radius = (self._energy_radius + h * mean_radius + rounding) * (1.0 + 8.0 * UNIT)
        self._append(Step(self.time, t1, p, G, tube, bend, face_upper, energy, radius, tracking, self.segment))

    def _append(self, step: Step) -> None:
        self.steps.append(step)
        if len(self.steps) > 1:
            # Only the last remainder goes on; of the others the targets need no more than this.
            self.steps[-2].G = thinned(self.steps[-2].G, 0 if self.lean else 1 + self.piece.variables)
        self._p, self._G, self._ebox, self.time = step.p, step.G, step.tube, step.end
        self._growth = step.tube / self.remainder if self.w_radius.any() else None
        self.remainder = generator_box(step.G)
        self._energy, self._energy_radius = step.energy, step.energy_radius
        if step.end >= self.fields[self.segment].end:
            self.segment += 1
            self.h = min(self.h, 0.05)

    def _fail(self, fld: Field, status: int, node: int) -> None:
        widths = self.remainder
        if self.frame is not None:
            widths = np.abs(self.frame.V) @ widths
        worst = self.names[int(np.argmax(widths))] if len(widths) else ""
        self.failure = breakdown(self.time, status, node, fld, worst)

    def run(self, limit: float) -> bool:
        """Advance until ``limit``; False when the flowpipe failed before."""
        while self.time < limit:
            if not self.advance(limit):
                return False
        return True

    @property
    def slope(self) -> Floats:
        """Float Jacobian (n, n) at the centre of the last step."""
        fld = self.fields[self.steps[-1].segment]
        n = fld.states
        space = self._spaces[(self.steps[-1].segment, "j")]
        return np.asarray(space.P[fld.jacobian.outputs[: n * n], 0, 0].reshape(n, n).copy())

    def wants_restart(self) -> bool:
        """Whether the remainder feeds itself and is as large as the polynomial part."""
        least = RESTART_FEEDBACK if self.generation < 2 else LATE_FEEDBACK
        if not self.w_radius.any() or len(self.steps) < self.next_restart or self.feedback < least:
            return False
        own = np.abs(self._p[:, 1:]).sum(axis=1)
        return bool((self.remainder > RESTART_SHARE * own).all())
