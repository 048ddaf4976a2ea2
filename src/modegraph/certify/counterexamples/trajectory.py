"""Validated counterexamples to condition (C): from point flowpipes and enclosed equilibria, never from samples.

Kinds (method, section 4): "violates" - a constraint is broken before the target is entered; "trapped" -
an equilibrium outside the target; "horizon" - the trajectory stays outside for as long as was asked.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.targets.region import Region
from modegraph.certify.verdict import Unproved, Witness
from modegraph.enclosure.rounding import UNIT
from modegraph.expression.evaluate import Evaluator
from modegraph.expression.tape import Tape
from modegraph.model.mode import Mode
from modegraph.model.sets import Box, Set, is_subset
from modegraph.reach.compiled import CompiledMode
from modegraph.reach.cover.degrees import EXACT
from modegraph.reach.field import Field
from modegraph.reach.flow.flow import Flow
from modegraph.reach.inverse import near_inverse
from modegraph.reach.start.piece import point

Floats = NDArray[np.float64]

FLOAT_STEPS, MOST_FLOAT_STEPS = 200, 1500
"""Steps of a trajectory in floats, at least, and at most."""
TOUCHING = 1e-6
"""A trajectory that comes so near to a target, or to the bound of a constraint, in floats may be on either side."""


@dataclass(frozen=True)
class Scene:
    """What a counterexample needs to know about a mode: its compiled loop, starts and uncertainties."""

    fields: Sequence[Field]
    start: Set
    plant: int
    w_lo: Floats
    w_hi: Floats
    unknowns: dict[str, tuple[float, float]]
    names: Sequence[str]
    reset: Tape | None

    def disturbances(self) -> Iterator[Floats]:
        """Constant disturbances worth trying: the centre, then the corners that matter most."""
        q = len(self.w_lo)
        centre = 0.5 * (self.w_lo + self.w_hi)
        if q:
            yield self.w_hi
            yield self.w_lo
            if q == 2:
                yield np.array([self.w_hi[0], self.w_lo[1]])
                yield np.array([self.w_lo[0], self.w_hi[1]])
        yield np.clip(centre, self.w_lo, self.w_hi)

    def constants(self) -> Floats:
        return np.array([min(max(0.5 * (lo + hi), lo), hi) for lo, hi in self.unknowns.values()])


def scene_of(mode: Mode, compiled: CompiledMode) -> Scene:
    """The scene of a mode under one reference."""
    box = mode.system.disturbance
    return Scene(
        fields=compiled.fields,
        start=compiled.one_start,
        plant=compiled.plant,
        w_lo=np.zeros(0) if box is None else np.asarray(box.lo, float),
        w_hi=np.zeros(0) if box is None else np.asarray(box.hi, float),
        unknowns=compiled.unknowns,
        names=compiled.loop.names,
        reset=compiled.own_reset,
    )


class PointRun:
    """The validated trajectory of one start, one constant disturbance and known constants."""

    def __init__(self, scene: Scene, x0: Floats, w: Floats, d: Floats, longest_step: float = np.inf) -> None:
        self.scene = scene
        self.x0, self.w, self.d = x0, w, d
        self.flow = Flow(
            scene.fields,
            point(x0, d),
            w,
            np.zeros(len(w)),
            EXACT,
            names=scene.names,
            reset=scene.reset if len(x0) == scene.plant else None,
            longest_step=longest_step,
        )
        self.violation: float | None = None
        self._seen = 0

    def extend(self, horizon: float, steps: int) -> None:
        """Integrate to the horizon (or ``steps`` steps); note the first instant of a proved violation."""
        if self._seen == 0 and self._violated(0):
            self.violation = 0.0
        while self.flow.time < horizon and len(self.flow.steps) < steps and self.violation is None:
            if not self.flow.advance(horizon):
                break
            step = self.flow.steps[-1]
            self._seen += 1
            if not (step.face_upper <= 0.0).all() and self._violated(len(self.flow.steps)):
                self.violation = step.end

    def _violated(self, k: int) -> bool:
        return bool((self._least(k) > 0.0).any())

    def _field(self, k: int) -> Field:
        """The field of the step that ends at grid instant k."""
        return self.flow.fields[self.flow.steps[k - 1].segment if k else 0]

    def _least(self, k: int) -> Floats:
        """Lower bounds of all constraint faces at grid instant k."""
        fld = self._field(k)
        if not fld.faces:
            return np.zeros(0)
        inputs, radius = self.flow.variables_at(float(self.flow.times[k]), self.flow.set_at(k), fld)
        value, off, _ = self.flow.evaluate(fld.observed, inputs, radius)
        count = len(fld.faces)
        return np.asarray(-self.flow.bounds.upper(-value[:count]) - off[:count])

    def breach(self) -> Unproved | None:
        """The constraint that is violated first, and by how much at that instant; None as long as none is."""
        if self.violation is None:
            return None
        at = len(self.flow.steps) if self.violation > 0.0 else 0
        least = self._least(at)
        k = int(np.argmax(least))
        return Unproved(self._field(at).faces[k], self.violation, float(least[k]))

    def apart_until(self, region: Region) -> float:
        """The trajectory is proved to be outside the target on [0, this instant) (seconds)."""
        if region.dim != self.scene.plant:
            return 0.0
        n = region.dim
        if not self.flow.steps:
            return 0.0
        lo, hi = self.flow.tubes()
        apart = region.separated(lo[:, :n], hi[:, :n])
        touching = np.flatnonzero(~apart)
        return float(self.flow.steps[touching[0]].start) if len(touching) else self.flow.time

    def witness(self, kind: str, time: float, r_i: Floats | None, r_j: Floats | None) -> Witness:
        names = list(self.scene.unknowns)
        w = self.w if len(self.w) else None
        return Witness(self.x0, w, dict(zip(names, self.d.tolist(), strict=True)), time, kind, r_i, r_j)  # type: ignore[arg-type]


@np.errstate(all="ignore")
def followed_in_floats(
    scene: Scene, runs: Sequence[tuple[Floats, Floats]], d: Floats, regions: Sequence[Region], end: float, safety: bool
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which runs (start, constant disturbance) may refute what, seen from trajectories in floats: a guess.

    Returns
    -------
    outside : (regions, runs), the target is never entered
    broken : (runs,), a constraint is broken before all targets are entered, or with ``safety`` at any time

    All are True where floats cannot tell: too many steps, a target over a memory.
    """
    n = scene.fields[0].states
    unknown = np.ones((len(regions), len(runs)), bool), np.ones(len(runs), bool)
    if scene.reset is not None or not runs or any(region.dim != n for region in regions):
        return unknown
    x = np.array([x0 for x0, _ in runs]).T
    inputs = np.zeros((scene.fields[0].variables, len(runs)))
    inputs[scene.fields[0].first_w : scene.fields[0].first_d] = np.array([w for _, w in runs]).T
    inputs[scene.fields[0].first_d :] = d[:, None]
    entered = np.zeros((len(regions), len(runs)), bool)
    broken = np.zeros(len(runs), bool)
    t, taken = 0.0, 0
    for fld in scene.fields:
        rates, slopes, observed = Evaluator(fld.rates), Evaluator(fld.jacobian), Evaluator(fld.observed)

        def at(f: Evaluator, t: float, x: Floats, fld: Field = fld) -> Floats:
            inputs[:n], inputs[fld.time_index] = x, t
            return np.asarray(f(inputs))

        while t < min(end, fld.end):
            J = at(slopes, t, x)[: n * n].T.reshape(-1, n, n)
            if not np.isfinite(J).all() or taken > MOST_FLOAT_STEPS:
                return unknown
            for k, region in enumerate(regions):
                entered[k] |= region.point_gauges(x.T) < 1.0 - TOUCHING
            before = ~entered.all(axis=0)
            faces = at(observed, t, x)[: len(fld.faces)]
            broken |= (faces > -TOUCHING).any(axis=0) & (before | safety)
            if not before.any() and not safety:
                break
            h = min(end - t, fld.end - t, end / FLOAT_STEPS, 1.0 / max(1e-9, np.abs(J).sum(axis=2).max()))
            a = at(rates, t, x)
            b = at(rates, t + 0.5 * h, x + 0.5 * h * a)
            c = at(rates, t + 0.5 * h, x + 0.5 * h * b)
            x = x + h / 6.0 * (a + 2.0 * b + 2.0 * c + at(rates, t + h, x + h * c))
            t, taken = t + h, taken + 1
    return ~entered, broken


@dataclass(frozen=True)
class Equilibrium:
    """A box that contains exactly one equilibrium of the loop under constant w and d (Krawczyk)."""

    lo: Floats
    hi: Floats
    w: Floats
    d: Floats


def enclose_equilibrium(scene: Scene, guess: Floats, w: Floats, d: Floats) -> Equilibrium | None:
    """Newton's method in floats, then Krawczyk's operator in validated arithmetic.

    K = x - Y f(x) + (I - Y J(X)) (X - x) strictly inside X proves a zero of f in X.
    """
    fld = scene.fields[-1]
    n = fld.states
    if len(scene.fields) != 1 or not fld.autonomous:
        return None
    rates, slopes = Evaluator(fld.rates), Evaluator(fld.jacobian)

    def inputs(x: Floats) -> Floats:
        return np.concatenate([x, [0.0], w, d])

    x = guess.copy()
    for _ in range(20):
        f = rates(inputs(x)[:, None])[:, 0]
        J = slopes(inputs(x)[:, None])[: n * n, 0].reshape(n, n)
        if not (np.isfinite(f).all() and np.isfinite(J).all()):
            return None
        try:
            step = np.linalg.solve(J, -f)
        except np.linalg.LinAlgError:
            return None
        if not np.isfinite(step).all():
            return None
        x = x + step
        if np.abs(step).max() <= 4.0 * UNIT * (1.0 + np.abs(x).max()):
            break
    else:
        return None
    flow = Flow(scene.fields, point(x, d), w, np.zeros(len(w)), EXACT, names=scene.names)
    # Where Newton's method ends on a kink the slope may be another than that of its last step: singular, or NaN.
    near = near_inverse(slopes(inputs(x)[:, None])[: n * n, 0].reshape(n, n))
    if near is None or not np.isfinite(near[0]).all():
        return None
    Y = near[0]
    at = inputs(x)[:, None] * np.ones((1, flow.table.size))
    at[:, 1:] = 0.0
    value, off, _ = flow.evaluate(fld.rates, at, np.zeros(len(at)))
    for size in (1e-12, 1e-10, 1e-8):
        radius = size * (1.0 + np.abs(x))
        spread = np.zeros(len(at))
        spread[:n] = radius
        slope, slope_off, _ = flow.evaluate(fld.jacobian, at, spread)
        if not np.isfinite(slope_off).all():
            continue
        J = slope[: n * n, 0].reshape(n, n)
        dJ = slope_off[: n * n].reshape(n, n)
        move = np.abs(Y) @ (np.abs(value[:, 0]) + off)
        rest = np.abs(np.eye(n) - Y @ J) + np.abs(Y) @ dJ + 4.0 * (n + 4) * UNIT * (np.abs(Y) @ np.abs(J) + 1.0)
        need = (move + rest @ radius) * (1.0 + 8.0 * (n + 4) * UNIT)
        if (need < radius).all():
            return Equilibrium(np.nextafter(x - radius, -np.inf), np.nextafter(x + radius, np.inf), w, d)
    return None


def trapped_in(scene: Scene, found: Equilibrium, region: Region) -> bool:
    """The equilibrium is a start of the mode and lies outside the target: it stays there for ever."""
    n = scene.plant
    if scene.start.dim != len(found.lo) or scene.reset is not None:
        return False
    if region.dim != n:
        return False
    box = Box(found.lo, found.hi)
    outside = region.separated(found.lo[None, : region.dim], found.hi[None, : region.dim])
    return bool(outside[0]) and is_subset(box, scene.start)


def moved_inside(start: Set, x: Floats) -> Floats | None:
    """A point proved to lie in the set, x (n,) or one a little nearer to the centre; None where that is not enough."""
    centre = np.asarray(start.center, float)
    for shrink in (0.0, 1e-12, 1e-6, 1e-3, 0.05):
        y = centre + (x - centre) * (1.0 - shrink)
        if start.contains(y):
            return np.asarray(y)
    return None


def candidate_starts(scene: Scene, hints: Sequence[Floats]) -> list[Floats]:
    """Points proved to lie in the start set: hints moved inside, the centre, and extreme ones."""
    centre = np.asarray(scene.start.center, float)
    found: list[Floats] = []
    for hint in [*hints, centre]:
        x = moved_inside(scene.start, hint)
        if x is not None:
            found.append(x)
    unique: list[Floats] = []
    for x in found:
        if not any(np.array_equal(x, y) for y in unique):
            unique.append(x)
    return unique
