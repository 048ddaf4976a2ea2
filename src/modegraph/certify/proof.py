"""Proof objects of condition (C), and the only place where CERTIFIED is constructed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from modegraph.certify.reason import Outcome, Reason
from modegraph.certify.switching.common_time import Nearest
from modegraph.certify.verdict import Floats, Status, Verdict


@dataclass(frozen=True)
class SwitchProof:
    """Every start of one part of S_i (and of the unknowns) is in S_j by ``latest``, legally.

    Built only by `zero_time`, from crossings of one flowpipe, or by `together` from proofs of parts
    that cover the whole.
    """

    earliest: float
    latest: float
    margin: float
    window: float
    energy: float
    slack: Mapping[str, float]
    parts: int
    nearest: Nearest | None = field(default=None, compare=False)
    """The part with the least margin, at its best instant."""
    sinks: bool = False
    """Some starts are there only when they have sunk in a funnel."""

    def __post_init__(self) -> None:
        numbers = (self.earliest, self.latest, self.margin, self.window, self.energy)
        if any(np.isnan(v) for v in numbers) or not 0.0 <= self.earliest <= self.latest < np.inf:
            raise ValueError("an incomplete proof of a switch")
        if any(not v >= 0.0 for v in self.slack.values()):
            raise ValueError("a proof of a switch with a constraint that is not proved")


@dataclass(frozen=True)
class SafetyProof:
    """The constraints hold for all t >= 0 from every start of one part of S_i (Assumption 1)."""

    slack: Mapping[str, float]
    tail_start: float
    tracking: Floats

    def __post_init__(self) -> None:
        if any(not v >= 0.0 for v in self.slack.values()) or not np.isfinite(self.tail_start):
            raise ValueError("an incomplete proof of Assumption 1")


def least_slack(many: Iterable[Mapping[str, float]]) -> dict[str, float]:
    """Smallest slack of each constraint."""
    least: dict[str, float] = {}
    for slack in many:
        for name, value in slack.items():
            least[name] = min(value, least.get(name, np.inf))
    return least


def together(proofs: Sequence[SwitchProof | None]) -> SwitchProof | None:
    """A proof for the union of the parts: only if every part has one."""
    if not proofs or any(proof is None for proof in proofs):
        return None
    parts = [proof for proof in proofs if proof is not None]
    return SwitchProof(
        earliest=min(p.earliest for p in parts),
        latest=max(p.latest for p in parts),
        margin=min(p.margin for p in parts),
        window=min(p.window for p in parts),
        energy=max(p.energy for p in parts),
        slack=least_slack(p.slack for p in parts),
        parts=sum(p.parts for p in parts),
        nearest=min(parts, key=lambda p: p.margin).nearest,
        sinks=any(p.sinks for p in parts),
    )


def safe_together(proofs: Sequence[SafetyProof | None]) -> SafetyProof | None:
    """Assumption 1 for the union of the parts: only if every part has a proof."""
    if not proofs or any(proof is None for proof in proofs):
        return None
    parts = [proof for proof in proofs if proof is not None]
    return SafetyProof(
        slack=least_slack(p.slack for p in parts),
        tail_start=max(p.tail_start for p in parts),
        tracking=np.max([p.tracking for p in parts], axis=0),
    )


def certified_switch(proof: SwitchProof, horizon: float | None) -> Verdict:
    """The verdict of a complete proof of condition (C)."""
    if proof.latest == 0.0:
        reason = Reason(Outcome.ZERO_TIME)
    else:
        outcome = Outcome.FUNNEL if proof.sinks else Outcome.COMMON_TIME
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
    )


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
