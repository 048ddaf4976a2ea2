"""Integrating a plan: the real closed loop with its switching logic."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from modegraph.attach import with_methods
from modegraph.certify.references import Parameter
from modegraph.errors import ModegraphError
from modegraph.graph.entry import Entry, plain_state
from modegraph.model.mode import Mode
from modegraph.model.target import Target
from modegraph.run.live import Live, Plant

if TYPE_CHECKING:
    from modegraph import api

Floats = NDArray[np.float64]

RTOL, ATOL = 1e-10, 1e-12
LOOKS = 200
"""Looks for the target set in the certified time to the switch."""
PATIENCE = 3.0
"""How many times the certified latest time a run waits for a switch before it gives up."""
LEAST_PATIENCE = 10.0
"""Seconds a run waits where nothing else tells how long."""
MOST_LOOKS = 20_000
SETTLED = 1e-4
"""The goal mode has settled when |x'| fell to this fraction of its largest value since the entry."""


@dataclass(frozen=True)
class Violation:
    """A constraint that did not hold: seconds since the run began, mode and constraint."""

    time: float
    mode: str
    constraint: str


@with_methods
@dataclass(frozen=True, eq=False)
class Run:
    """One execution of a plan. There are two samples at each switch instant, before and after it.

    Attributes
    ----------
    t : (N,) array
        Seconds since the run began.
    x : (N, n) array
        Plant states.
    u : (N, p) array
        Inputs; NaN-padded where modes have different numbers of them.
    mode : list[str]
        The mode that runs, for each sample.
    visit : (N,) int array
        Its position in the plan.
    r : (N, m) array
        Reference values, NaN-padded likewise.
    z : (N, k) array
        Controller memory, NaN-padded likewise.
    switch_times : (S,) array
        Seconds since the run began.
    ok : bool
        Every switch of the plan happened and no constraint was violated at any sample.
    message : str
        How the run ended.
    violations : tuple[Violation, ...]
        The first violation of each constraint in each visit.
    states, inputs : tuple[str, ...]
        Names of the columns of x and u.
    """

    t: Floats
    x: Floats
    u: Floats
    mode: list[str]
    visit: NDArray[np.int64]
    r: Floats
    z: Floats
    switch_times: Floats
    ok: bool
    message: str
    violations: tuple[Violation, ...]
    states: tuple[str, ...]
    inputs: tuple[str, ...]

    if TYPE_CHECKING:  # from upper layers
        plot = api.plot_run


def simulate(
    modes: Sequence[Mode | Target],
    references: Sequence[Parameter],
    times: Sequence[tuple[float, float]],
    x0: Any,
    *,
    plant: Plant = None,
    force: bool = False,
    stay: float | None = None,
) -> Run:
    """Run ``modes`` one after the other, switching when x enters the next start set.

    The closed loop is integrated with DOP853 through the user's own functions, piece by piece
    between the breakpoints of the references. Entering is decided with ``Set.contains`` on the dense
    output and refined by bisection; a start set that already holds x is entered at once. The memory
    is reset on entry.

    Parameters
    ----------
    times : sequence of (earliest, latest), one shorter than ``modes``
        Certified switch times; they only set how finely and how long to look.
    x0 : (n,) array
    plant : System or callable(t, x, u) -> (n,), optional
        What really happens; by default each mode's own system with disturbance and unknowns at the
        centre of their ranges.
    force : bool
        Allow an ``x0`` outside the first start set.
    stay : float, optional
        Seconds in the last mode. By default until its reference has ended and the motion has died
        away, at most its horizon or a multiple of the certified times.

    Raises
    ------
    ModegraphError
        For a wrong ``x0``, ``plant`` or ``stay``, or when a model function fails.
    """
    first = modes[0]
    n = first.set.dim if isinstance(first, Target) else first.system.n
    x = plain_state(x0, n)
    if plant is not None and not callable(plant) and not hasattr(plant, "dynamics"):
        raise ModegraphError(f"simulate: plant must be a System or a callable(t, x, u), not {type(plant).__name__}")
    if stay is not None and (isinstance(stay, bool) or not isinstance(stay, Real) or not 0 <= stay < math.inf):
        raise ModegraphError(f"simulate: stay must be a finite number of seconds >= 0, not {stay!r}")
    if not force and not Entry(first, references[0]).contains(x):
        raise ModegraphError(
            f"simulate: x0 = {x.tolist()} is outside the start set of {first.name!r}; nothing is certified "
            "from there (force=True runs it all the same)"
        )
    record = _Record()
    elapsed = 0.0
    message = ""
    with np.errstate(all="ignore"):
        for visit, (mode, p) in enumerate(zip(modes, references, strict=True)):
            if isinstance(mode, Target):
                record.finish(visit, mode, x, elapsed)
                break
            live = Live(mode, p, plant, elapsed)
            last = visit == len(modes) - 1
            if last:
                limit = _settling_time(live, times) if stay is None else float(stay)
                visitor = _Visit(live, record, visit, x, limit, settle=stay is None)
            else:
                following = Entry(modes[visit + 1], references[visit + 1])
                visitor = _Visit(live, record, visit, x, _patience(live, times[visit][1]), following=following)
                if times[visit][1] > 0:
                    visitor.longest = max(times[visit][1] / LOOKS, visitor.limit / MOST_LOOKS)
            message = visitor.run()
            x, elapsed = visitor.x, elapsed + visitor.t
            if message:
                break
            if not last:
                record.switches.append(elapsed)
    return record.run(message or "the plan was executed", not message)


def _patience(live: Live, latest: float) -> float:
    """How long to wait for a switch; beyond ``latest`` only where the run left what was certified."""
    return max(PATIENCE * latest, live.mode.horizon or 0.0, live.mode.reference.duration, LEAST_PATIENCE)


def _settling_time(live: Live, times: Sequence[tuple[float, float]]) -> float:
    """How long the goal mode runs at most."""
    duration = 2.0 * live.mode.reference.duration
    if live.mode.horizon is not None:
        return max(live.mode.horizon, duration)
    return max(2.0 * sum(latest for _, latest in times), duration, LEAST_PATIENCE)


@dataclass(eq=False)
class _Record:
    """Samples collected on the way."""

    t: list[float] = field(default_factory=list)
    x: list[Floats] = field(default_factory=list)
    z: list[Floats] = field(default_factory=list)
    u: list[Floats] = field(default_factory=list)
    r: list[Floats] = field(default_factory=list)
    mode: list[str] = field(default_factory=list)
    visit: list[int] = field(default_factory=list)
    switches: list[float] = field(default_factory=list)
    violations: dict[tuple[int, str], Violation] = field(default_factory=dict)
    states: tuple[str, ...] = ()
    inputs: tuple[str, ...] = ()

    def add(self, live: Live, visit: int, t: float, values: dict[str, Any]) -> None:
        name = live.mode.name
        self._sample(live.entered + t, values["x"], name, visit)
        self.z.append(values["z"])
        self.u.append(values["u"])
        self.r.append(np.array(values["r"], dtype=float))
        self.states = live.mode.system.states
        if len(live.mode.system.inputs) > len(self.inputs):
            self.inputs = live.mode.system.inputs
        for constraint in live.violated(values):
            self.violations.setdefault((visit, constraint), Violation(live.entered + t, name, constraint))

    def finish(self, visit: int, target: Target, x: Floats, t: float) -> None:
        """The sample at the entry of a Target, where no controller runs."""
        self._sample(t, x, target.name, visit)
        for column in (self.z, self.u, self.r):
            column.append(np.zeros(0))
        self.states = self.states or tuple(f"x[{k}]" for k in range(len(x)))

    def run(self, message: str, complete: bool) -> Run:
        violations = tuple(self.violations.values())
        if violations:
            v = violations[0]
            message += f"; constraint {v.constraint!r} of mode {v.mode!r} was violated at {v.time:.6g} s"
        return Run(
            t=np.array(self.t),
            x=np.array(self.x),
            u=_padded(self.u),
            mode=self.mode,
            visit=np.array(self.visit, dtype=np.int64),
            r=_padded(self.r),
            z=_padded(self.z),
            switch_times=np.array(self.switches),
            ok=complete and not violations,
            message=message,
            violations=violations,
            states=self.states,
            inputs=self.inputs,
        )

    def _sample(self, t: float, x: Floats, name: str, visit: int) -> None:
        self.t.append(t)
        self.x.append(np.array(x))
        self.mode.append(name)
        self.visit.append(visit)


def _padded(rows: Sequence[Floats]) -> Floats:
    width = max((len(row) for row in rows), default=0)
    out = np.full((len(rows), width), np.nan)
    for k, row in enumerate(rows):
        out[k, : len(row)] = row
    return out


class _Visit:
    """One mode from its entry to the entry of ``following``, or for ``limit`` seconds."""

    def __init__(
        self,
        live: Live,
        record: _Record,
        visit: int,
        x: Floats,
        limit: float,
        *,
        following: Entry | None = None,
        settle: bool = False,
    ) -> None:
        self.live = live
        self.record = record
        self.visit = visit
        self.x = x
        self.limit = limit
        self.following = following
        self.settle = settle
        self.t = 0.0
        self.longest = limit / LOOKS
        self.largest = 0.0

    def run(self) -> str:
        """Integrate; afterwards ``x`` and ``t`` (since entry) are where it ended. "" if all went well."""
        y = self.live.entry(self.x)
        self.live.require_finite(y)
        self.largest = float(np.linalg.norm(self.live.slope(0.0, y, math.inf)[: self.live.n]))
        if self._enters(y) or self.limit == 0:
            self._sample(0.0, y, math.inf)
            return ""
        ends = [b for b in self.live.breaks if b < self.limit] + [self.limit]
        for end in ends:
            if end <= self.t:
                continue
            y, outcome = self._piece(y, end)
            if outcome is not None:
                self.x = y[: self.live.n]
                return outcome
        self.x = y[: self.live.n]
        if self.following is None:
            return ""
        return f"mode {self.live.mode.name!r} did not reach the next start set in {self.limit:.6g} s"

    def _piece(self, y: Floats, end: float) -> tuple[Floats, str | None]:
        """Integrate to ``end``, a breakpoint or the limit; an outcome ends the visit."""
        from scipy.integrate import DOP853

        live = self.live
        self._sample(self.t, y, math.inf)
        solver = DOP853(
            lambda t, state: live.slope(t, state, end),
            self.t,
            y,
            end,
            rtol=RTOL,
            atol=ATOL,
            max_step=math.inf,
        )
        while solver.status == "running":
            failure = solver.step()
            if failure is not None or not np.all(np.isfinite(solver.y)):
                return y, f"mode {live.mode.name!r} diverged {self.t:.6g} s after its entry"
            path = solver.dense_output()
            begin, stop = float(solver.t_old or 0.0), float(solver.t)
            looks = np.linspace(begin, stop, 1 + max(1, math.ceil((stop - begin) / self.longest)))[1:]
            before = begin
            for look in looks:
                state = solver.y if look == stop else path(look)
                if self._enters(state):
                    self.t, y = self._entry_instant(path, before, float(look), state)
                    self._sample(self.t, y, end)
                    return y, ""
                before = float(look)
                self._sample(before, state, end)
            self.t, y = stop, np.array(solver.y)
            if self._has_settled(y, end):
                return y, ""
        return y, None

    def _enters(self, y: Floats) -> bool:
        return self.following is not None and self.following.contains(y[: self.live.n])

    def _entry_instant(self, path: Any, outside: float, inside: float, state: Floats) -> tuple[float, Floats]:
        """Bisection between a look outside and a look inside; the answer is inside."""
        while True:
            middle = 0.5 * (outside + inside)
            if not outside < middle < inside or inside - outside <= 1e-13 * inside:
                return inside, np.array(state)
            there = path(middle)
            if self._enters(there):
                inside, state = middle, there
            else:
                outside = middle

    def _has_settled(self, y: Floats, end: float) -> bool:
        if not self.settle:
            return False
        speed = float(np.linalg.norm(self.live.slope(self.t, y, end)[: self.live.n]))
        self.largest = max(self.largest, speed)
        return self.t >= self.live.mode.reference.duration and speed <= SETTLED * self.largest

    def _sample(self, t: float, y: Floats, end: float) -> None:
        self.record.add(self.live, self.visit, t, self.live.values(t, y, end))
