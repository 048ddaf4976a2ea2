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

    def cost(self, verdict: Verdict, r_i: Parameter = None, r_j: Parameter = None) -> Cost:
        """The cost of one certified switch; a switch without an energy bound costs an infinity."""
        infinite, total = 0, Fraction(0)
        if self.travelled:
            total += _distance(r_i, r_j)
        for what, weight in self.weights.items():
            if weight == 0:
                continue
            amount = _amount(what, verdict)
            if amount is None:
                infinite += 1
            else:
                total += weight * amount
        return infinite, total


def _distance(r_i: Parameter, r_j: Parameter) -> Fraction:
    """Euclidean distance in reference space; between references of different size there is none to go."""
    if r_i is None or r_j is None or len(r_i) != len(r_j):
        return Fraction(0)
    return Fraction(math.dist(r_i, r_j))


def objective(minimize: Any) -> Objective:
    """The objective named by ``minimize``: a name, or non-negative weights by name.

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
        return Objective("distance", {}, travelled=True)
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


def _amount(what: str, verdict: Verdict) -> Fraction | None:
    if what == "switches":
        return Fraction(1)
    value = latest(verdict) if what == "time" else verdict.energy
    return None if value is None or not math.isfinite(value) else Fraction(value)


def latest(verdict: Verdict) -> float:
    """Certified latest time of a certified switch, seconds."""
    assert verdict.time is not None
    return verdict.time[1]
