"""What a plan minimises."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from numbers import Real
from typing import Any

from modegraph.certify.references import Parameter
from modegraph.certify.verdict import Verdict
from modegraph.errors import ModegraphError

NAMES = ("switches", "time", "energy", "margin", "distance")
WEIGHED = ("switches", "time", "energy")

Cost = tuple[int, Fraction]
"""(how many unbounded terms, sum of the others): compares like a sum with infinities, exactly."""

NO_COST: Cost = (0, Fraction(0))


@dataclass(frozen=True)
class Objective:
    """A weighted sum over the switches of a plan, or its largest bottleneck margin.

    Attributes
    ----------
    name : str
        As the user gave it.
    weights : mapping of str to Fraction
        For "switches", "time" (latest, seconds) and "energy"; empty for "margin".
    bottleneck : bool
        Maximise the smallest margin instead of a sum.
    travelled : bool
        The distance between the references of each switch, where they have the same size.
    """

    name: str
    weights: Mapping[str, Fraction]
    bottleneck: bool = False
    travelled: bool = False
    grain: float = 0.0
    """Distances are rounded up to multiples of this, so that many short steps are not less than one long."""

    def cost(self, time: float, energy: float | None, r_i: Parameter = None, r_j: Parameter = None) -> Cost:
        """The cost of one certified switch with its latest time; an infinity where the energy has no bound."""
        infinite, total = 0, Fraction(0)
        if self.travelled:
            total += _distance(r_i, r_j, self.grain)
        for what, weight in self.weights.items():
            if weight == 0:
                continue
            amount = 1.0 if what == "switches" else time if what == "time" else energy
            if amount is None or not math.isfinite(amount):
                infinite += 1
            else:
                total += weight * Fraction(amount)
        return infinite, total


def _distance(r_i: Parameter, r_j: Parameter, grain: float) -> Fraction:
    """Euclidean distance in reference space; between references of different size there is none to go."""
    if r_i is None or r_j is None or len(r_i) != len(r_j):
        return Fraction(0)
    distance = math.dist(r_i, r_j)
    return Fraction(math.ceil(distance / grain)) * Fraction(grain) if grain else Fraction(distance)


def objective(minimize: Any, size: float = 0.0) -> Objective:
    """The objective named by ``minimize``: a name, or non-negative weights by name.

    ``size``: of the classes of references; distances count to 1e-9 of it.

    Raises
    ------
    ModegraphError
        For anything else, listing what there is.
    """
    if isinstance(minimize, Mapping):
        return _weighted(minimize)
    if not isinstance(minimize, str) or minimize not in NAMES:
        raise ModegraphError(
            f"plan: minimize={minimize!r} is unknown; use {', '.join(map(repr, NAMES))} "
            f"or weights such as {{'time': 1, 'switches': 0.5}}"
        )
    if minimize == "margin":
        return Objective("margin", {}, bottleneck=True)
    if minimize == "distance":
        return Objective(
            "distance", {}, travelled=True, grain=2.0 ** math.floor(math.log2(1e-9 * size)) if size else 0.0
        )
    return Objective(minimize, {minimize: Fraction(1)})


def _weighted(weights: Mapping[Any, Any]) -> Objective:
    if not weights:
        raise ModegraphError("plan: minimize={} weighs nothing; give a weight for " + ", ".join(WEIGHED))
    exact = {}
    for what, weight in weights.items():
        if what not in WEIGHED:
            raise ModegraphError(f"plan: minimize cannot weigh {what!r}; weights are for {', '.join(WEIGHED)}")
        number = float(weight) if isinstance(weight, Real) and not isinstance(weight, bool) else math.nan
        if not 0 <= number < math.inf:
            raise ModegraphError(f"plan: the weight of {what!r} must be a finite number >= 0, not {weight!r}")
        exact[what] = Fraction(number)
    return Objective(" + ".join(f"{weights[w]:g} {w}" for w in weights), exact)


def latest(verdict: Verdict) -> float:
    """Certified latest time of a certified switch, seconds."""
    assert verdict.time is not None
    return verdict.time[1]
