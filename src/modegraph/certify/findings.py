"""What parts of one start set show, and what they show together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from modegraph.certify.proof import SafetyProof, SwitchProof, safe_together, together
from modegraph.certify.reason import Outcome, Reason
from modegraph.certify.switching.common_time import Missed
from modegraph.certify.verdict import Unproved
from modegraph.reach.failure import Failure, Mechanism
from modegraph.reach.flow.flow import Flow

NoTail = tuple[Failure, ...]
"""Why there is no invariant set, and why no funnel; empty where none was looked for."""


@dataclass
class Waiting:
    """A part of the starts that waits: its flows until there, how it may go on alone, and what it showed alone."""

    flows: list[Flow]
    following: Flow | None = None
    alone: Findings | None = None


@dataclass
class Findings:
    """What one part of the starts showed: a proof or the best miss for each goal, and for the check."""

    proofs: dict[int, SwitchProof] = field(default_factory=dict)
    missed: dict[int, Missed] = field(default_factory=dict)
    safety: SafetyProof | None = None
    safe_until: float = 0.0
    no_tail: NoTail = ()
    failure: Reason | None = None
    unproved: Unproved | None = None
    broken: bool = False
    """A sampled start really breaks a constraint: smaller parts cannot help."""
    refused: bool = False
    """Its remainder fed itself too much to wait for a common restart."""
    held_back: bool = False
    """It, or one of the parts it was cut into, was refused."""
    empty: bool = False
    """The part is proved to hold no start: the others decide without it."""
    flow: Flow | None = None
    last: Flow | None = None
    waits: list[Waiting] = field(default_factory=list)
    """Parts that wait to go on together, because the disturbance has filled them."""
    waiting: dict[int, list[SwitchProof]] = field(default_factory=dict)
    """Goals that depend on the parts that wait, with the proofs of the other parts."""
    waiting_safety: list[SafetyProof] | None = None

    def unpark(self, why: Reason | Unproved) -> None:
        """Nothing waits any more: the part is too large, for this reason."""
        self.waits, self.waiting, self.waiting_safety = [], {}, None
        self.failure = Reason(Outcome.TOO_LARGE, why=why.reason if isinstance(why, Unproved) else why)


def ended(failure: Failure) -> Reason:
    """That a flowpipe ends, and why."""
    return Reason(Outcome.FLOWPIPE_ENDED, failure=failure)


def filled(flow: Flow) -> Reason:
    """Why a flow cannot go on whose remainder feeds itself."""
    return ended(Failure(Mechanism.FILLED, time=flow.time))


def better(part: Findings, whole: Findings, wanted: Sequence[int], safety: bool) -> bool:
    """Whether a part of the starts got further than the whole did."""
    if any(j in part.proofs or j in part.waiting for j in wanted) or (safety and part.safety is not None):
        return True
    if (whole.failure or whole.unproved) and not (part.failure or part.unproved):
        return True
    closer = any(part.missed[j].gauge < 0.9 * whole.missed[j].gauge for j in wanted if j in part.missed)
    return closer or part.safe_until > 1.1 * whole.safe_until


def settle(found: Findings, j: int, proof: SwitchProof | None, parts: Sequence[Findings]) -> None:
    """Record the proof of a goal for the whole, or the worst miss among its parts."""
    if proof is not None:
        found.proofs[j] = proof
        found.missed.pop(j, None)
        return
    missed = [part.missed[j] for part in parts if j in part.missed]
    if missed:
        found.missed[j] = max(missed, key=lambda m: m.gauge)


def merge(found: Findings, parts: Sequence[Findings], wanted: Sequence[int], safety: bool) -> Findings:
    """What the parts prove together is proved of the whole; what some wait for, the whole waits for."""
    parts = [part for part in parts if not part.empty]
    if not parts:
        found.empty = True
        return found
    found.held_back |= any(part.held_back for part in parts)
    found.waits = [chain for part in parts for chain in part.waits]
    for j in wanted:
        if j in found.proofs:
            continue
        if all(j in part.proofs or j in part.waiting for part in parts) and any(j in part.waiting for part in parts):
            done = [part.proofs[j] for part in parts if j in part.proofs]
            found.waiting[j] = done + [proof for part in parts for proof in part.waiting.get(j, [])]
            continue
        settle(found, j, together([part.proofs.get(j) for part in parts]), parts)
    safe = [part.safety for part in parts if part.safety is not None]
    late = [part.waiting_safety for part in parts if part.waiting_safety is not None]
    if safety and late and len(safe) + len(late) >= len(parts):
        found.waiting_safety = safe + [proof for proofs in late for proof in proofs]
    elif safety:
        found.safety = safe_together([part.safety for part in parts])
        if found.safety is None:
            found.safe_until = max(found.safe_until, min(part.safe_until for part in parts))
            found.no_tail = found.no_tail or next((part.no_tail for part in parts if part.no_tail), ())
    if all(not part.failure for part in parts):
        found.failure = None
    if all(not part.unproved for part in parts):
        found.unproved = None
    return found
