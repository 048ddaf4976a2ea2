"""Funnels: nested ellipsoids through which every trajectory of a settled loop sinks, each in a known time.

An ellipsoid is proposed by a semidefinite program over sampled Jacobians (`lyapunov`) and proved to
shrink by `decay`. With V' <= -alpha V + mu on {rho <= s}, V = rho^2 falls from a to b, mu/alpha < b < a <= s^2,
within log((a - mu/alpha) / (b - mu/alpha)) / alpha seconds, and stays below.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import dropwhile, takewhile

import numpy as np
from numpy.typing import NDArray

from modegraph.deadline import NEVER, Deadline
from modegraph.enclosure.monomials import monomials
from modegraph.enclosure.rounding import TINY, UNIT
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.failure import Failure, Mechanism
from modegraph.reach.float_loop import FloatLoop
from modegraph.reach.pointwise import evaluate_over
from modegraph.reach.reach_set import ReachSet
from modegraph.reach.start.piece import Chart, Piece
from modegraph.reach.tail.decay import DecayRegion, Norm, SettledLoop
from modegraph.reach.tail.lyapunov import shrinking_ellipsoid

Floats = NDArray[np.float64]

ROUNDS = 4
"""Programs solved for one ellipsoid, each with the Jacobians that broke the one before."""
SAMPLES = 400
"""Matrices a rate is guessed from."""
EAGER = (1.7, 1.3, 0.9, 0.6, 0.3)
"""Rates asked of an ellipsoid, relative to the slowest mode's (2 at most); around points the last three."""
KEPT = 0.5
"""Level that may be kept by the disturbance in a new ellipsoid."""
NARROWED = 0.95
"""A norm that shrinks less than to this part is the last one."""
MOST_RUNGS = 2
"""Strides in one norm: a new one, made for the smaller set, is quicker."""
STAGES = 12
"""Ellipsoids tried one inside the other."""
PUSHES = (1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.12, 0.08, 0.06, 0.04, 0.03)
"""Sums of the weights m_j tried, relative to s sum_j |g_j|."""
CAUTION = (0.6, 0.85)
"""Parts of a sampled rate that are tried to be proved: the smaller, the quicker the proof."""
STRIDES = (0.6, 0.75, 0.88, 0.94)
"""Ratios of the radii of a rung."""


@dataclass(frozen=True)
class NormBall:
    """{rho <= radius} as a set the engine can bound: p(xi) = centre + radius A xi over the unit ball."""

    norm: Norm
    radius: float
    loop: SettledLoop

    @cached_property
    def piece(self) -> Piece:
        loop, n = self.loop, len(self.norm.centre)
        lo, hi = loop.unknown_lo, loop.unknown_hi
        chart = Chart(self.norm.centre, self.norm.axes * self.radius, True, None, lo, hi, original=False)
        m = n + int((lo < hi).sum())
        return Piece(chart, -np.ones(m), np.ones(m))

    @cached_property
    def set(self) -> ReachSet:
        """With generators (n, n, 1): what rounding the axes loses."""
        n = len(self.norm.centre)
        table = monomials((1,) * self.piece.variables, 2)
        p, _, _ = self.piece.polynomials(table.linear, table.size)
        G = np.zeros((n, n, 1))
        G[np.arange(n), np.arange(n), 0] = 4.0 * UNIT * np.abs(p).sum(axis=1) + TINY
        return ReachSet.of(PolynomialBounds(self.piece, table, table.size), p, G)

    def box(self) -> tuple[Floats, Floats]:
        return self.set.ranges()

    def observed(self) -> tuple[Floats, float, Floats]:
        """Upper bounds of the constraint faces, of u'u, and of the tracking errors' sizes."""
        fld = self.loop.fld
        table = monomials((1,) * self.piece.variables, 2)
        bounds, reach = self.set.bounds, self.set
        _, unknowns, _ = self.piece.polynomials(table.linear, table.size)
        inputs = np.zeros((fld.variables, table.size))
        inputs[: fld.states] = reach.p
        inputs[fld.time_index, 0] = fld.start
        inputs[fld.first_w : fld.first_d, 0] = self.loop.w_centre
        inputs[fld.first_d :] = unknowns
        radius = np.zeros(fld.variables)
        radius[: fld.states] = reach.spread
        radius[fld.first_w : fld.first_d] = self.loop.w_radius
        value, off, _ = evaluate_over(fld.observed, table, table.order, inputs, radius)
        upper = bounds.upper(value) + off
        lower = bounds.upper(-value) + off
        upper, lower = (np.where(np.isnan(side), np.inf, side) for side in (upper, lower))
        faces = len(fld.faces)
        return upper[:faces], float(upper[faces]), np.maximum(upper[faces + 1 :], lower[faces + 1 :])


@dataclass(frozen=True)
class Rung:
    """On {rho <= radius}: V' <= -alpha V + mu. The next rung begins at rho = ``lower``."""

    norm: Norm
    radius: float
    lower: float
    alpha: float
    mu: float
    face_upper: Floats
    power: float
    """Upper bound of u'u."""
    tracking: Floats

    @property
    def legal(self) -> bool:
        """Whether the constraints are proved on it, and a bound of the inputs."""
        return bool((self.face_upper <= 0.0).all() and np.isfinite(self.power))

    @property
    def floor(self) -> float:
        """Upper bound of mu / alpha, the value V sinks to."""
        return self.mu / self.alpha * (1.0 + 4.0 * UNIT)

    def seconds(self, a: float, b: float) -> float:
        """Upper bound of the time from rho <= a to rho <= b; inf where b is below the floor."""
        if a <= b:
            return 0.0
        low = b * b * (1.0 - 4.0 * UNIT) - self.floor
        if not low > 1e-9 * self.floor:
            return math.inf
        return math.log((a * a * (1.0 + 4.0 * UNIT) - self.floor * (1.0 - 8.0 * UNIT)) / low) / self.alpha * (1 + 1e-7)

    def after(self, a: float, seconds: float) -> float:
        """Upper bound of rho after some seconds, from rho <= a."""
        left = math.exp(-self.alpha * seconds * (1.0 - 1e-9)) * (1.0 + 1e-9)
        return min(a, math.sqrt((self.floor + max(0.0, a * a - self.floor * (1.0 - 1e-9)) * left) * (1.0 + 1e-9)))


def usable(rungs: Sequence[Rung]) -> tuple[Rung, ...]:
    """The first legal rungs without a gap: a rung in a new norm may reach beyond the one before.

    What enters before a gap passes it; what might enter behind it is given up.
    """
    begun = dropwhile(lambda rung: not rung.legal, rungs)
    return tuple(takewhile(lambda rung: rung.legal, begun))


@dataclass(frozen=True)
class Funnel:
    """Rungs from the widest to the narrowest; each begins inside the one before."""

    loop: SettledLoop
    rungs: tuple[Rung, ...]

    def enter(self, reach: ReachSet) -> tuple[int, float] | None:
        """The deepest rung that holds a set, and the radius there; None if no rung does."""
        gauge, norm = math.inf, None
        found = None
        if not reach.is_finite:
            return None
        for k, rung in enumerate(self.rungs):
            if rung.norm is not norm:
                norm = rung.norm
                gauge = norm.quadric.gauge(reach)
            if gauge <= rung.radius:
                found = k, gauge
        return found

    def gauge(self, reach: ReachSet) -> float:
        """How much larger than the mouth a set is."""
        first = self.rungs[0]
        return first.norm.quadric.gauge(reach) / first.radius

    @property
    def end(self) -> NormBall:
        """Where everything is in the end."""
        return self.ball(len(self.rungs) - 1, self.rungs[-1].lower)

    def ball(self, k: int, radius: float) -> NormBall:
        return NormBall(self.rungs[k].norm, radius, self.loop)


class NoFunnel(Failure):
    """Why there is no funnel."""

    __slots__ = ()


class FunnelBuilder:
    """Proposes and proves funnels of one loop."""

    def __init__(self, loop: SettledLoop, deadline: Deadline = NEVER) -> None:
        self.loop, self.deadline = loop, deadline
        self._floats = FloatLoop(loop.fld, loop.w_centre, loop.w_radius, loop.unknown_lo, loop.unknown_hi)

    # -- floats: proposals -----------------------------------------------------------------------

    def _propose(
        self, centre: Floats, push: Floats, scale: Floats, alpha: float,
        points: Floats, around: NormBall | None, weight: Floats,
    ) -> Floats | None:  # fmt: skip
        """Axes (n, n) of an ellipsoid around the points and around a ball of an earlier norm."""
        n = len(scale)
        y, g = points / scale, push / scale
        at = centre + points
        inside = None
        if around is not None:
            axes = around.norm.axes * around.radius
            inner = axes * 1.001 / scale[:, None]
            inside = np.asarray(np.linalg.inv(inner @ inner.T), float)
            at = centre + np.vstack([axes.T, -axes.T])
        sampled = self._floats.jacobians(np.vstack([centre, at[:: max(1, len(at) // 12)]]))
        slopes = sampled / scale[None, :, None] * scale
        for k in range(ROUNDS):
            P = shrinking_ellipsoid(slopes, g, alpha, KEPT, y, inside, weight)
            if P is None:
                return None
            L = np.linalg.cholesky(P)
            back = np.linalg.inv(L)
            rng = np.random.default_rng(k)
            s = rng.normal(size=(SAMPLES, n))
            s /= np.linalg.norm(s, axis=1)[:, None]
            full = self._floats.jacobians(centre + (s @ back) * scale) / scale[None, :, None] * scale
            Z = L.T @ full @ back.T
            gz = g @ L
            m = np.linalg.norm(gz, axis=1) + 1e-300
            N = (gz.T / (m / m.sum() * alpha * KEPT)) @ gz
            top = np.linalg.eigvalsh(Z + np.swapaxes(Z, 1, 2) + N).max(axis=1)
            if not top.size or top.max() < -0.9 * alpha:
                break
            slopes = np.concatenate([slopes, full[np.argsort(-top)[:8]]])
        return np.asarray(scale[:, None] * back.T)

    # -- intervals: proofs -----------------------------------------------------------------------

    def build(self, points: Floats, fit: Floats, enough: Callable[[NormBall], bool]) -> Funnel | NoFunnel:
        """A funnel whose mouth holds (about) the points (K, n), narrow enough at its end if that can be proved.

        ``fit``: half-widths (n,) whose proportions the ellipsoids are to have.
        """
        centre = self._floats.equilibrium(points.mean(axis=0), range(self.loop.fld.states))
        if centre is None:
            return NoFunnel(Mechanism.NO_EQUILIBRIUM)
        slope = self._floats.jacobian(centre)
        if not np.isfinite(slope).all():
            return NoFunnel(Mechanism.JACOBIAN_NOT_FINITE)
        rate = -float(np.linalg.eigvals(slope).real.max())
        if not rate > 1e-6:
            return NoFunnel(Mechanism.DOES_NOT_SETTLE, rate=0.0 - rate)
        found = self.loop.push(centre)
        if found is None:
            return NoFunnel(Mechanism.UNDEFINED_AT_EQUILIBRIUM)
        push, box = found
        y = points - centre
        scale = np.abs(y).max(axis=0)
        scale = np.maximum(scale, 1e-3 * scale.max(initial=1e-12))
        rungs: list[Rung] = []
        last: NormBall | None = None
        for _ in range(STAGES):
            weight = np.diag((scale / (scale if last is None else fit)) ** 2)
            added = self._stage(centre, push, box, scale, rate, y, last, weight / weight.max(), enough)
            if not added:
                break
            rungs += added
            narrowed = added[-1].lower / added[0].radius
            scale = scale * narrowed
            last = NormBall(added[-1].norm, added[-1].lower, self.loop)
            if narrowed > NARROWED or enough(last) or self.deadline.is_over:
                break
        if not rungs:
            return NoFunnel(Mechanism.NO_TIME_FOR_ELLIPSOIDS if self.deadline.is_over else Mechanism.NO_ELLIPSOID)
        kept = usable(rungs)
        return Funnel(self.loop, kept) if kept else NoFunnel(Mechanism.FUNNEL_CONSTRAINT)

    def _stage(
        self, centre: Floats, push: Floats, box: Floats, scale: Floats, rate: float, points: Floats,
        last: NormBall | None, weight: Floats, enough: Callable[[NormBall], bool],
    ) -> list[Rung]:  # fmt: skip
        """Rungs in the most eager norm that can be proved, around the points or inside what was reached last."""
        for eager in EAGER if last is not None else EAGER[2:]:
            if last is None:
                axes = self._propose(centre, push, scale, eager * rate, points, None, weight)
            else:
                axes = self._propose(centre, push, scale, eager * rate, points[:0], last, weight)
            norm = None if axes is None else Norm.of(centre, axes)
            if norm is None:
                continue
            mouth = 1.0
            if last is not None:
                mouth = norm.quadric.gauge(last.set)
            rungs = self._descend(norm, mouth, push, box, enough)
            if rungs:
                return rungs
        return []

    def _descend(
        self, norm: Norm, radius: float, push: Floats, box: Floats, enough: Callable[[NormBall], bool]
    ) -> list[Rung]:
        """Rungs in one norm from a radius down as far as it shrinks."""
        n = len(norm.centre)
        near = push @ norm.inverse.T
        size = np.abs(norm.inverse) @ (np.abs(push).sum(axis=0) + box)
        # A^-1 = (N A)^-1 N: off by norm.off of the largest entry; and rounding.
        loose = np.abs(norm.inverse) @ box + (1.01 * norm.off + 8.0 * (n + 4) * UNIT) * size.max(initial=0.0)
        columns = np.vstack([near, np.diag(loose)])
        length = np.linalg.norm(columns, axis=1) + 1e-300
        share = length / length.sum()
        rungs: list[Rung] = []
        while True:
            region = DecayRegion(self.loop, norm, radius, self.deadline)
            chosen = self._step_down(region, radius, columns, share, float(length.sum()))
            if chosen is None:
                return rungs
            alpha, mu, lower = chosen
            upper, power, tracking = NormBall(norm, radius, self.loop).observed()
            rungs.append(Rung(norm, radius, lower, alpha, mu, upper, power, tracking))
            radius = lower
            if len(rungs) >= MOST_RUNGS or enough(NormBall(norm, radius, self.loop)):
                return rungs

    def _step_down(
        self, region: DecayRegion, radius: float, columns: Floats, share: Floats, total: float
    ) -> tuple[float, float, float] | None:
        """(alpha, mu, next radius) of a proved rung; None where the norm does not shrink any more."""
        samples = region.sample(SAMPLES)
        if samples is None:
            return None
        n = len(samples[0])
        rates = []
        for part in PUSHES:
            weights = share * max(part * total * radius, TINY)
            M = (columns.T / weights) @ columns
            M = 0.5 * (M + M.T)
            rates.append((-float(np.linalg.eigvalsh(samples + M).max()), float(weights.sum()), M))
        best: tuple[float, float, float] | None = None
        for caution in CAUTION:
            options = []
            for stride in STRIDES:
                lower = stride * radius
                for rate, mu, M in rates:
                    alpha = caution * rate
                    if alpha <= 0.0 or mu / alpha > 0.97 * lower * lower:
                        continue
                    seconds = math.log((radius**2 - mu / alpha) / (lower**2 - mu / alpha)) / alpha
                    options.append((seconds / math.log(radius / lower), lower, alpha, mu, M))
            if not options:
                continue
            quickest = min(option[0] for option in options)
            # The longest stride that is nearly as quick.
            _, lower, alpha, mu, M = min((o for o in options if o[0] <= 1.3 * quickest), key=lambda o: (o[1], o[0]))
            # Rounding of M, entry by entry, is far below 1e-12 of its size.
            if not region.negative(M + (1e-12 * np.trace(M) + alpha * (1.0 + 1e-12)) * np.eye(n)):
                break
            best = alpha, mu * (1.0 + 1e-12), lower
        return best
