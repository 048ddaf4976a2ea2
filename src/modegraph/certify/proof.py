"""Proof objects of condition (C) and of Assumption 1, and the only place where CERTIFIED is constructed.

A proof is made of evidence objects, which are made of what shows it (flows, funnels, relations): no number of a
certified verdict is ever handed in.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from modegraph.certify.lasting import LastingEvidence
from modegraph.certify.reason import Outcome, Reason, point
from modegraph.certify.relation import Relation
from modegraph.certify.switching.base import Evidence, Nearest, least_slack
from modegraph.certify.switching.families import OfEveryPair, OfPair
from modegraph.certify.verdict import Approach, Floats, Status, Verdict


@dataclass(frozen=True, eq=False)
class SwitchProof:
    """Every start of one part of S_i (and of the unknowns) is in S_j by ``latest``, legally.

    The union of the parts of its evidence: together they hold all starts of it.
    """

    evidence: tuple[Evidence, ...]

    def __post_init__(self) -> None:
        if not self.evidence or not all(isinstance(e, Evidence) for e in self.evidence):
            raise ValueError("a proof of a switch without evidence")
        numbers = (self.earliest, self.latest, self.margin, self.window, self.energy)
        if any(np.isnan(v) for v in numbers) or not 0.0 <= self.earliest <= self.latest < np.inf:
            raise ValueError("an incomplete proof of a switch")
        if any(not v >= 0.0 for v in self.slack.values()):
            raise ValueError("a proof of a switch with a constraint that is not proved")

    @cached_property
    def earliest(self) -> float:
        return min(e.earliest for e in self.evidence)

    @cached_property
    def latest(self) -> float:
        return max(e.latest for e in self.evidence)

    @cached_property
    def margin(self) -> float:
        return min(e.margin for e in self.evidence)

    @cached_property
    def window(self) -> float:
        return min(e.window for e in self.evidence)

    @cached_property
    def energy(self) -> float:
        return max(e.energy for e in self.evidence)

    @cached_property
    def slack(self) -> dict[str, float]:
        return least_slack(e.slack for e in self.evidence)

    @property
    def parts(self) -> int:
        return sum(e.parts for e in self.evidence)

    @property
    def nearest(self) -> Nearest | None:
        """The part with the least margin, at its best instant."""
        return min(self.evidence, key=lambda e: e.margin).nearest


@dataclass(frozen=True, eq=False)
class SafetyProof:
    """The constraints hold for all t >= 0 from every start of some parts of S_i (Assumption 1)."""

    evidence: tuple[LastingEvidence, ...]

    def __post_init__(self) -> None:
        if not self.evidence or not all(isinstance(e, LastingEvidence) for e in self.evidence):
            raise ValueError("a proof of Assumption 1 without evidence")
        if any(not v >= 0.0 for v in self.slack.values()) or not np.isfinite(self.tail_start):
            raise ValueError("an incomplete proof of Assumption 1")

    @cached_property
    def slack(self) -> dict[str, float]:
        return least_slack(e.slack for e in self.evidence)

    @cached_property
    def tail_start(self) -> float:
        """Seconds from which on all trajectories are in invariant sets."""
        return max(e.start for e in self.evidence)

    @cached_property
    def tracking(self) -> Floats:
        """Bounds (m,) of |h(x) - r| for all time."""
        return np.asarray(np.max([e.tracking for e in self.evidence], axis=0))


def together(proofs: Sequence[SwitchProof | None]) -> SwitchProof | None:
    """A proof for the union of the parts: only if every part has one."""
    parts = [proof for proof in proofs if proof is not None]
    if not parts or len(parts) < len(proofs):
        return None
    return SwitchProof(tuple(e for proof in parts for e in proof.evidence))


def safe_together(proofs: Sequence[SafetyProof | None]) -> SafetyProof | None:
    """Assumption 1 for the union of the parts: only if every part has a proof."""
    parts = [proof for proof in proofs if proof is not None]
    if not parts or len(parts) < len(proofs):
        return None
    return SafetyProof(tuple(e for proof in parts for e in proof.evidence))


def certified_switch(proof: SwitchProof, horizon: float | None, closest: Approach | None = None) -> Verdict:
    """The verdict of a complete proof of condition (C)."""
    if proof.latest == 0.0:
        reason = Reason(Outcome.ZERO_TIME)
    else:
        outcome = Outcome.FUNNEL if any(e.sinks for e in proof.evidence) else Outcome.COMMON_TIME
        reason = Reason(outcome, latest=proof.latest, parts=proof.parts)
    return Verdict(
        Status.CERTIFIED,
        (reason,),
        time=(proof.earliest, proof.latest),
        margin=proof.margin,
        slack=dict(proof.slack),
        horizon=horizon,
        energy=proof.energy,
        window=proof.window,
        closest=closest,
    )


def certified_pair(relation: Relation, source: Floats, target: Floats, horizon: float | None) -> Verdict:
    """The verdict on a pair (1, ki), (1, kj) of references that a relation certifies."""
    return certified_switch(SwitchProof((OfPair(relation, source, target),)), horizon)


def certified_for_some(relation: Relation, source: Floats, target: Floats, horizon: float | None) -> Verdict:
    """The existential verdict on two classes; its numbers hold for every certified pair, its margin is of this one."""
    verdict = certified_switch(SwitchProof((OfEveryPair(relation, source, target),)), horizon)
    reason = Reason(Outcome.SOME_REGION_CERTIFIED, r_i=point(source[0]), r_j=point(target[0]))
    return replace(verdict, why=(reason,), margin=OfPair(relation, source, target).margin)


def certified_check(proof: SafetyProof) -> Verdict:
    """The verdict of a complete proof of Assumption 1."""
    tracking = proof.tracking if proof.tracking.size and np.isfinite(proof.tracking).all() else None
    return Verdict(
        Status.CERTIFIED,
        (Reason(Outcome.FOR_ALL_TIME, start=proof.tail_start, constraints=bool(proof.slack)),),
        slack=dict(proof.slack),
        tracking=tracking,
    )


def only_entered(name: str) -> Verdict:
    """What stands for Assumption 1 at a `Target`: it is entered and never left, so nothing is asked of it."""
    return Verdict(Status.CERTIFIED, (Reason(Outcome.ONLY_ENTERED, target=name),))
