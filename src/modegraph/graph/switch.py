"""A certified switch of the graph."""

from __future__ import annotations

from dataclasses import dataclass

from modegraph.certify.continuous import ContinuousReferences
from modegraph.certify.references import References


@dataclass(frozen=True, eq=False)
class Switch:
    """The controller of ``source`` can be followed by that of ``target``, proved (eq. 7).

    Attributes
    ----------
    source, target : str
        Mode names; ``target`` may be a Target.
    references : References or ContinuousReferences
        The pairs (r_i, r_j) for which it is proved. The figures below hold for all of them.
    time : (float, float)
        Seconds after entering ``source``: no trajectory is in the target set before the first, every
        one has been by the second. Over several pairs, the hull.
    energy : float or None
        Certified upper bound of the integral of u'u up to the switch; None where none was computed.
    margin : float or None
        Smallest margin of the pairs (dimensionless, see Verdict).
    window : float or None
        Seconds: shortest certified stay inside the target set from the switch on, measured while
        ``source`` runs on.
    """

    source: str
    target: str
    references: References | ContinuousReferences
    time: tuple[float, float]
    energy: float | None = None
    margin: float | None = None
    window: float | None = None

    def __repr__(self) -> str:
        return f"Switch({self.source} -> {self.target}, time {self.time[0]:.4g}..{self.time[1]:.4g})"
