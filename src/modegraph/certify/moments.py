"""What all starts of one part can reach at an instant, as a polynomial in the reference and a spread.

x(t) = m(p) + s, p the parameters of the reference of the source: everything else - start, remainder,
unknowns, disturbance - is in the spread s, which is bounded in the terms of a target.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.legal import proved_instants
from modegraph.certify.targets.family import TargetClass
from modegraph.enclosure.rounding import UNIT
from modegraph.reach.flow.flow import Flow
from modegraph.reach.generators import generator_sizes
from modegraph.reach.quadric import Quadric
from modegraph.reach.reach_set import ReachSets
from modegraph.reach.start.class_chart import parameters_of, scale_of

Floats = NDArray[np.float64]

MOST_INSTANTS = 32
"""Looks at one flow that a relation keeps."""


@dataclass(frozen=True)
class Moments:
    """One flow against one target: rows y_k(p) = rows m_k(p) and spreads, at instants k.

    Attributes
    ----------
    lo, hi : (k,) arrays
        The parameters this flow is for.
    whole : bool
        It is for every reference of the class.
    times, energy : (K,) arrays
        Seconds, and bounds of int u'u until then.
    middle, scale : (k,) arrays
        The moments are polynomials in (p - middle) / scale, monomials ``exponents`` (m, k).
    rows : (K, f, m) array
        Coefficients of y; ``size`` (K, f) bounds the terms that were rounded.
    spread : (K, f) or, of a round target, (K, 1) array
    farthest : float
        Bounds the entries of |m| + spread in the states.
    """

    lo: Floats
    hi: Floats
    whole: bool
    times: Floats
    energy: Floats
    middle: Floats
    scale: Floats
    exponents: NDArray[np.int64]
    rows: Floats
    size: Floats
    spread: Floats
    farthest: float

    @property
    def affine(self) -> bool:
        """The moments are affine in the reference."""
        return not self.rows[:, :, self.exponents.sum(axis=1) > 1].any()

    @property
    def is_constant(self) -> bool:
        """The moments do not depend on the reference, and this flow is for all of them."""
        return not self.rows[:, :, self.exponents.sum(axis=1) > 0].any() and self.whole

    def over(self, lo: Floats, hi: Floats) -> tuple[Floats, Floats]:
        """Ranges (B, K, f) of y over boxes (B, k) of references, but for roundings of ROUNDED * size."""
        a, b = (lo - self.middle) / self.scale, (hi - self.middle) / self.scale
        low, high = np.ones((len(lo), len(self.exponents))), np.ones((len(lo), len(self.exponents)))
        for v in range(lo.shape[1]):
            e = self.exponents[:, v]
            ends = a[:, [v]] ** e, b[:, [v]] ** e
            least, most = np.minimum(*ends), np.maximum(*ends)
            astride = (e > 0) & (e % 2 == 0) & (a[:, [v]] < 0.0) & (b[:, [v]] > 0.0)
            least = np.where(astride, 0.0, least)
            products = np.stack([low * least, low * most, high * least, high * most])
            low, high = products.min(axis=0), products.max(axis=0)
        up, down = np.maximum(self.rows, 0.0), np.minimum(self.rows, 0.0)
        lowest = np.einsum("kfm,bm->bkf", up, low) + np.einsum("kfm,bm->bkf", down, high)
        highest = np.einsum("kfm,bm->bkf", up, high) + np.einsum("kfm,bm->bkf", down, low)
        return lowest, highest


def moments_of(
    flow: Flow, target: TargetClass, horizon: float, classes: Sequence[tuple[float, float]]
) -> Moments | None:
    """The instants of a flow at which a switch may be proved; None where there is none.

    ``classes``: ranges of the parameters of the source; of a flow they may be a part, whatever its piece says.
    """
    parameters = len(classes)
    usable = min(proved_instants(flow), int(np.searchsorted(flow.times, horizon, side="right")) - 1)
    if usable < 0:
        return None
    n = target.dim
    own = parameters_of(flow.piece)
    exponents = flow.bounds.exponents
    others = np.ones(exponents.shape[1], bool)
    others[[v for v, _ in own]] = False
    pure = np.flatnonzero(~(exponents[:, others] > 0).any(axis=1))
    first = 1 if flow.times[0] > 0.0 else 0
    if usable < first:
        return None
    instants = np.unique(np.round(np.linspace(first, usable, MOST_INSTANTS)).astype(np.int64))
    sets = ReachSets.of(flow.bounds, [flow.reach_set(k).project(n) for k in instants.tolist()], n)
    p = sets.p
    rest = p.copy()
    rest[:, :, pure] = 0.0
    lo, hi = np.full(parameters, -np.inf), np.full(parameters, np.inf)
    middle, scale = np.zeros(parameters), np.ones(parameters)
    powers = np.zeros((len(pure), parameters), np.int64)
    for v, k in own:
        lo[k], hi[k] = flow.piece.unknown_range(int(flow.piece.uncertain[v - flow.piece.chart.free]))
        middle[k], scale[k] = scale_of(flow.piece, v)
        powers[:, k] = exponents[pure, v]
    rows = np.einsum("fi,kij->kfj", target.rows, p[:, :, pure])
    used = rows.any(axis=(0, 1)) | (powers.sum(axis=1) == 0)
    return Moments(
        lo, hi, all(lo[k] <= least and most <= hi[k] for k, (least, most) in enumerate(classes)),
        flow.times[instants], np.array([_energy(flow, int(k)) for k in instants]), middle, scale, powers[used],
        np.ascontiguousarray(rows[:, :, used]),
        np.abs(p[:, :, pure]).sum(axis=2) @ np.abs(target.rows).T, _spreads(target, replace(sets, p=rest)),
        float(np.abs(p).sum(axis=2).max() + max(np.abs(G).sum() for G in sets.generators) + sets.box.sum()),
    )  # fmt: skip


def _energy(flow: Flow, k: int) -> float:
    """Bound of int u'u until instant k; 0 at the entry."""
    if k == 0:
        return 0.0
    step = flow.steps[k - 1]
    return float(np.nextafter(flow.seen_bounds.upper(step.energy) + step.energy_radius, np.inf))


def _spreads(target: TargetClass, rest: ReachSets) -> Floats:
    """(K, 1) gauges of a round target, or (K, f) reaches along the rows of a flat one, of m = 0."""
    if target.round:
        quadric = Quadric(np.zeros(target.dim), target.rows, target.grow)
        # Each set in a unit of its own, a power of two: the squares of tiny lengths would be 0.
        largest = [float(np.abs(g).max(initial=0.0)) for g in rest.generators]
        size = np.maximum(np.maximum(np.abs(rest.p).max(axis=(1, 2)), rest.box.max(axis=1)), largest)
        exponent = np.frexp(size)[1]
        scaled = ReachSets(
            rest.bounds,
            np.ldexp(rest.p, -exponent[:, None, None]),
            [np.ldexp(g, -e) for g, e in zip(rest.generators, exponent, strict=True)],
            np.ldexp(rest.box, -exponent[:, None]),
        )
        return np.nextafter(np.ldexp(quadric.gauges(scaled), exponent), np.inf)[:, None]
    z = generator_sizes(target.rows, rest.generators) + rest.box @ np.abs(target.rows).T
    size = np.abs(rest.p).sum(axis=2) @ np.abs(target.rows).T + z
    return np.asarray(rest.bounds.upper(np.einsum("fi,kij->kfj", target.rows, rest.p)) + z + 64.0 * UNIT * size)


def at_state(x: Floats, target: TargetClass) -> Moments:
    """One state (n,), reached at once."""
    none = np.zeros(0)
    rows = (target.rows @ x)[None, :, None]
    size = (np.abs(target.rows) @ np.abs(x))[None]
    spread = np.zeros((1, 1 if target.round else len(target.rows)))
    return Moments(
        none, none, True, np.zeros(1), np.zeros(1), none, none, np.zeros((1, 0), np.int64), rows, size, spread,
        float(np.abs(x).sum()),
    )  # fmt: skip
