"""All goals of one start set: parts that a disturbance has filled go on from a common enclosure of their ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from modegraph.certify.chain_evidence import Past
from modegraph.certify.course import again
from modegraph.certify.exploration import Exploration
from modegraph.certify.findings import Findings, Waiting, ended, settle
from modegraph.certify.proof import safe_together, together
from modegraph.certify.question import Question
from modegraph.reach.failure import Failure, Mechanism
from modegraph.reach.start.piece import Piece


def decide(question: Question, piece: Piece, wanted: Sequence[int], safety: bool = True) -> Findings:
    """Decide the wanted goals, and the check for all starts.

    A common enclosure is wider than each part, but it is one flow instead of many, and a contracting loop
    forgets the loss. Where it is too much, every part goes on alone until it wants another restart, and
    only from there together, in halves where all of them are too much again.
    """
    if not question.autonomous:
        return _decided_alone(question, piece, wanted, safety)
    joint = _Continuation(Exploration(question, common=True))
    found = joint.exploration.explore(piece, wanted, safety)
    if joint.all_at_once(found) or question.deadline.is_over:
        return found
    proofs, lasting = found.proofs, found.safety
    found = _decided_alone(question, piece, [j for j in wanted if j not in proofs], safety and lasting is None)
    found.proofs = proofs | found.proofs
    found.safety = found.safety or lasting
    return found


def _decided_alone(question: Question, piece: Piece, wanted: Sequence[int], safety: bool) -> Findings:
    continuation = _Continuation(Exploration(question, common=False))
    found = continuation.exploration.explore(piece, wanted, safety)
    continuation.each_alone(found)
    return found


@dataclass(frozen=True)
class _Continuation:
    """How the parts of an exploration that wait go on."""

    exploration: Exploration

    def each_alone(self, found: Findings) -> None:
        """Let the chains that wait, which went on alone for a while, go on together from there."""
        if not found.waits:
            return
        chains = [chain.alone for chain in found.waits if chain.alone is not None]
        assert len(chains) == len(found.waits)
        parts = [part for part in chains if not part.waits]
        open_chains = [part for part in chains if part.waits]
        groups = [open_chains] if self.exploration.question.autonomous else [[part] for part in open_chains]
        parts += [part for group in groups if group for part in self._in_groups(group, found)]
        _finish(found, parts)

    def all_at_once(self, found: Findings) -> bool:
        """Let all that waits go on as one; False where parts that go on alone may show more."""
        if found.held_back and found.failure:
            return False
        if not found.waits:
            return True
        flows = [chain.flows[-1] for chain in found.waits]
        first = len(flows) == 1 and flows[0].piece.chart.original
        following = again(self.exploration.question, flows, first, self.exploration.common)
        if following is None:
            return False
        past = Past([chain.flows for chain in found.waits])
        part = self.exploration.follow([following], past, found, park=False)
        missing = [j for j in found.waiting if j not in part.proofs]
        undecided = bool(missing) or (found.waiting_safety is not None and part.safety is None)
        _finish(found, [part])
        return not undecided or len(flows) == 1

    def _in_groups(self, open_chains: list[Findings], found: Findings) -> list[Findings]:
        """Chains that want another restart, together, or in halves where all of them are too much."""
        question = self.exploration.question
        waits: list[Waiting] = [chain for part in open_chains for chain in part.waits]
        ends = [chain.flows[-1] for chain in waits]
        following = waits[0].following if len(ends) == 1 else again(question, ends, False, self.exploration.common)
        if following is None:
            failure = Failure(Mechanism.NOT_ENCLOSED_AGAIN, time=max(flow.time for flow in ends))
            part = Findings(flow=ends[0], last=ends[-1], failure=ended(failure))
        else:
            past = Past([chain.flows for chain in waits])
            part = self.exploration.follow([following], past, found, park=False)
        missing = [j for j in found.waiting if j not in part.proofs and any(j not in c.proofs for c in open_chains)]
        decided = not missing and (found.waiting_safety is None or part.safety is not None)
        if decided or len(open_chains) == 1 or question.deadline.is_over:
            proofs = [together([c.proofs.get(j) for c in open_chains]) for j in found.waiting]
            for j, proof in zip(found.waiting, proofs, strict=True):
                if proof is not None:
                    part.proofs[j] = proof
            return [part]
        half = len(open_chains) // 2
        return [*self._in_groups(open_chains[:half], found), *self._in_groups(open_chains[half:], found)]


def _finish(found: Findings, parts: Sequence[Findings]) -> None:
    """What the parts that waited show, with the others, is shown of the whole."""
    for j, others in found.waiting.items():
        settle(found, j, together([*others, *(part.proofs.get(j) for part in parts)]), parts)
    if found.waiting_safety is not None:
        found.safety = safe_together([*found.waiting_safety, *(part.safety for part in parts)])
    for part in parts:
        found.failure, found.unproved = part.failure, part.unproved
        found.no_tail, found.safe_until = part.no_tail, max(found.safe_until, part.safe_until)
