"""S_i inside S_j: a switch in zero time, decided exactly, for single sets and for classes of references.

A pair counts where the inclusion holds for both start sets of each reference, the formula in exact numbers and
the set in floats that a run enters (as `is_subset` decides it for single references). Where numbers have no
exact values, an inequality with all roundings decides, or nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.legal import slack_until
from modegraph.certify.question import TargetSpec
from modegraph.certify.switching.base import Evidence, Nearest
from modegraph.certify.switching.fit import Fit, Never, fit_of
from modegraph.certify.switching.start_family import StartFamily, start_family
from modegraph.certify.targets.region import Region
from modegraph.errors import ModegraphError
from modegraph.expression.derivative import derivative
from modegraph.model.mode import Mode
from modegraph.model.sets import Polytope, Set, exact, is_subset
from modegraph.model.sets.rational import rational_subset
from modegraph.reach.flow.flow import Flow

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class InZeroTime(Evidence):
    """The start set is inside the target, the constraints are proved at t = 0.

    Attributes
    ----------
    start : the start set, on the plant state
    flow : a flow from all of it, of which only the start is looked at
    region : the target
    """

    start: Set
    flow: Flow
    region: Region

    def __post_init__(self) -> None:
        flow = self.flow
        legal = flow.failure is None and (flow.faces_at(0.0, flow.set_at(0), 0) <= 0.0).all()
        if not legal or not is_subset(self.start, self.region.set):
            raise ValueError("a start set that is not inside the target, or breaks a constraint")

    @property
    def earliest(self) -> float:
        return 0.0

    @property
    def latest(self) -> float:
        return 0.0

    @property
    def margin(self) -> float:
        assert self.nearest is not None
        return max(0.0, 1.0 - self.nearest.gauge)

    @property
    def window(self) -> float:
        return 0.0

    @property
    def energy(self) -> float:
        return 0.0

    @property
    def slack(self) -> dict[str, float]:
        return slack_until(self.flow, 0)

    @cached_property
    def nearest(self) -> Nearest | None:
        start = self.flow.reach_set(0).project(self.region.dim)
        return Nearest(0.0, self.region.gauge(start), start)


@dataclass(frozen=True, eq=False)
class ZeroTime:
    """The pairs of references for which every start of the source is in the target at once.

    It speaks of sets: that the constraints hold at t = 0 on all starts is for others to prove. The pair of a
    reference with itself is like any other here.
    """

    source: StartFamily
    target: StartFamily
    fit: Fit

    def decides(self, p: Floats, q: Floats) -> NDArray[np.bool_]:
        """For p (B, ki) and q (B, kj): where S_i(p) is proved to be inside S_j(q)."""
        low, high = self.fit.excess_of_pairs(p, q)
        possible: NDArray[np.bool_] = ~(low > 0.0)
        if not possible.any():
            return possible
        possible &= self.source.covers(p) & self.target.covers(q)
        inside = possible & (high <= 0.0)
        for k in np.flatnonzero(possible & ~inside):
            inside[k] = self._exactly(p[k], q[k])
        return np.asarray(inside)

    def _exactly(self, p: Floats, q: Floats) -> bool:
        inner, outer = self.source.exact(p), self.target.exact(q)
        if inner is None or outer is None or not rational_subset(inner, outer):
            return False
        try:
            return is_subset(self.source.own(p), self.target.own(q))
        except ModegraphError:
            return False

    def boxes(self, source: tuple[Floats, Floats], target: tuple[Floats, Floats]) -> NDArray[np.bool_]:
        """Which products of boxes lo, hi (B, ki) x (B, kj) are inside as a whole."""
        known = self.source.covers(source[0]) & self.source.covers(source[1])
        known &= self.target.covers(target[0]) & self.target.covers(target[1])
        return np.asarray(known & (self.fit.excess(source, target)[1] <= 0.0))

    def excludes(self, source: tuple[Floats, Floats], target: tuple[Floats, Floats]) -> NDArray[np.bool_]:
        """Which products of boxes hold no pair that is inside."""
        return np.asarray(self.fit.excess(source, target)[0] > 0.0)

    def gauges(self, p: Floats, q: Floats) -> Floats:
        """Gauges (B,), at most 1, of pairs that are inside."""
        return np.asarray(np.clip(self.fit.gauges(p, q), 0.0, 1.0))


def zero_time(mode: Mode, p: Floats | None, spec: TargetSpec) -> ZeroTime | None:
    """From a mode - under the reference p, or p = None for its whole class - to a target; None where no pair
    is inside, or nothing is known of that."""
    try:
        source, target = start_family(mode, p), start_family(spec.mode, spec.p)
        if source is None or target is None or source.dim != target.dim or source.shape.kind is Polytope:
            return None
        if spec.mode is mode and _only_itself(source):
            return None
        return ZeroTime(source, target, fit_of(source, target))
    except (ModegraphError, OverflowError, Never):
        return None


def _only_itself(family: StartFamily) -> bool:
    """Equal sets around centres that differ from reference to reference: none is inside another."""
    entries = [e for row in family.shape.axes for e in row]
    slopes = derivative(family.shape.centre, family.parameters)
    if not family.parameters or not all(e.is_constant for e in [*entries, *(e for row in slopes for e in row)]):
        return False
    rows = [[e.value for e in row] for row in slopes]
    gram = [[exact.dot(a, b) for b in zip(*rows, strict=True)] for a in zip(*rows, strict=True)]
    return exact.is_positive_definite(gram)
