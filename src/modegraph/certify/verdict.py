"""The three answers to condition (C) and what comes with them (method, section 4)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Literal, NoReturn

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.reason import Outcome, Reason, Why
from modegraph.errors import ModegraphError
from modegraph.reach.statement import texts, told

Floats = NDArray[np.float64]


class Status(Enum):
    """Outcome of a proof attempt. Only ``CERTIFIED`` may become an edge of the graph."""

    CERTIFIED = "certified"
    REFUTED = "refuted"
    UNDECIDED = "undecided"

    def __bool__(self) -> NoReturn:
        raise ModegraphError(
            f"a status has no truth value (this one is {self.value}): compare it, "
            "such as verdict.status is mg.Status.CERTIFIED, or ask the verdict for .certified or .refuted"
        )


@dataclass(frozen=True)
class Witness:
    """A validated counterexample to condition (C).

    Attributes
    ----------
    x0 : (n,) or (n + k,) array
        A start proved to lie in the start set.
    w : (q,) array or None
        The constant disturbance that was applied.
    d : dict[str, float]
        Values of the unknown constants.
    r_i, r_j : array or None
        The references of source and target.
    time : float
        Seconds: when a constraint is violated ("violates"), from when on the trajectory is proved
        trapped ("trapped"), or how long it was proved to stay outside ("horizon").
    kind : {"violates", "trapped", "horizon"}
        "horizon" refutes only within the horizon of the verdict.
    """

    x0: Floats
    w: Floats | None
    d: Mapping[str, float]
    time: float
    kind: Literal["violates", "trapped", "horizon"]
    r_i: Floats | None = None
    r_j: Floats | None = None


@dataclass(frozen=True)
class Widths:
    """Widths of a reach set at some instants.

    Attributes
    ----------
    states : tuple[str, ...]
        Names of the coordinates: states, then memory.
    times : (k,) array, seconds
    values : (k, n) array
        Widths (upper bound minus lower bound) in the unit of each state.
    """

    states: tuple[str, ...]
    times: Floats
    values: Floats


@dataclass(frozen=True)
class Approach:
    """How near the worst part of the starts comes to the target, at its best time.

    Attributes
    ----------
    time : float
        Seconds after entering the source.
    gauge : float
        1 on the boundary of the target, less inside; an upper bound for everything that part can reach.
    face : str
        The face of the target that decides it, in words: "position <= 0.1", "the ball of radius ...".
    missing : float
        How far beyond that face the set reaches, in ``unit``; negative: the room that is left.
    unit : str
        What ``missing`` is measured in: a state, a combination of states, "distance", ...
    detail : str
        For a round target, the state in which the set is farthest out, relative to the size of the target.
    start : (n,) array or None
        The worst start.
    origin : {"sampled", "middle", "witness", ""}
        Where ``start`` is from: the worst of some sampled starts, the middle of the worst part, the
        counterexample; "" without a start.
    """

    time: float
    gauge: float
    face: str
    missing: float
    unit: str
    detail: str = ""
    start: Floats | None = None
    origin: Literal["sampled", "middle", "witness", ""] = ""


@dataclass(frozen=True)
class Unproved:
    """The first constraint that could not be proved: from ``time`` seconds on, exceeded by up to ``by`` (inf, NaN:
    not defined) in its own unit."""

    constraint: str
    time: float
    by: float

    @property
    def reason(self) -> Reason:
        """It as a reason of a verdict."""
        return Reason(Outcome.CONSTRAINT_NOT_PROVED, constraint=self.constraint, time=self.time, by=self.by)

    def __str__(self) -> str:
        return str(self.reason)


@dataclass(frozen=True)
class Verdict:
    """One answer, with the reason and the numbers that belong to it.

    Attributes
    ----------
    status : Status
    why : tuple of Reason
        What was proved, or what stood in the way: an `Outcome` each, with numbers and a remedy.
    reason : str
        The same for a person; with what would help where it is undecided. Programs read ``why``.
    time : (float, float) or None
        Certified only: seconds ``(earliest, latest)`` after entering the source mode. No trajectory
        is in the target before ``earliest``; every one has been by ``latest``.
    margin : float or None
        Dimensionless: 1 - gauge of the worst piece at its best time. Negative where the proof
        misses; None where no bound was computed.
    slack : dict[str, float]
        Certified distance to each constraint up to the switch, in the constraint's own unit.
    witness : Witness or None
        Refuted only.
    horizon : float or None
        Seconds up to which the pair was examined; None for all time.
    until : float or None
        Seconds up to which the constraints are proved, where that is less than asked for.
    energy : float or None
        Certified upper bound of the integral of u'u up to the switch.
    window : float or None
        Seconds: shortest certified stay inside the target from the switch on.
        Infinite where it stays there for ever.
    tracking : (m,) array or None
        ``check`` only: certified bound of |h(x) - r| over the proved time, per output.
    widths : Widths or None
        How wide the reach set was over time, on the part of the starts that was followed last.
    closest : Approach or None
        How near the worst part of the starts comes to the target; None where no bound was computed.
    unproved : Unproved or None
        The constraint that stood in the way of the proof, if one did.
    """

    status: Status
    why: Why
    time: tuple[float, float] | None = None
    margin: float | None = None
    slack: Mapping[str, float] = field(default_factory=dict)
    witness: Witness | None = None
    horizon: float | None = None
    until: float | None = None
    energy: float | None = None
    window: float | None = None
    tracking: Floats | None = None
    widths: Widths | None = None
    closest: Approach | None = None
    unproved: Unproved | None = None

    @property
    def reason(self) -> str:
        """`why` as prose."""
        return told(self.why) if self.status is Status.UNDECIDED else texts(self.why)

    @property
    def certified(self) -> bool:
        """Whether condition (C), or the limits of a check, were proved."""
        return self.status is Status.CERTIFIED

    @property
    def refuted(self) -> bool:
        """Whether a validated counterexample was found."""
        return self.status is Status.REFUTED

    def __bool__(self) -> NoReturn:
        raise ModegraphError(
            f"a verdict has no truth value (this one is {self.status.value}): ask for .certified or .refuted; "
            "what is neither is undecided"
        )
