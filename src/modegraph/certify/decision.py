"""All goals of one start set: parts that a disturbance has filled go on from a common enclosure of their ends."""

from __future__ import annotations

import time
from collections.abc import Sequence

from modegraph.certify.exploration import Exploration
from modegraph.certify.findings import Findings, ended, settle
from modegraph.certify.proof import safe_together, together
from modegraph.reach.failure import Failure, Mechanism
from modegraph.reach.flow.flow import Flow
from modegraph.reach.start.piece import Piece


class Decision:
    """What an exploration and the common continuations of its parked flows show.

    A common enclosure is wider than each part, but it is one flow instead of many, and a contracting loop
    forgets the loss. Where it is too much, every part goes on alone until it wants another restart, and
    only from there together, in halves where all of them are too much again.
    """

    def __init__(self, exploration: Exploration) -> None:
        self.exploration = exploration

    def decide(self, piece: Piece, wanted: Sequence[int], safety: bool = True) -> Findings:
        """Decide the wanted goals, and the check for all starts."""
        exploration = self.exploration
        found = exploration.explore(piece, wanted, safety)
        if not exploration.common:
            self._each_alone(found)
        elif not self._all_at_once(found) and time.monotonic() <= exploration.deadline:
            exploration.common, exploration.parts = False, 0
            proofs, lasting = found.proofs, found.safety
            left = [j for j in wanted if j not in proofs]
            found = exploration.explore(piece, left, safety and lasting is None)
            self._each_alone(found)
            found.proofs = proofs | found.proofs
            found.safety = found.safety or lasting
        return found

    def _each_alone(self, found: Findings) -> None:
        """Let the chains of the parked flows, which went on alone for a while, go on together from there."""
        exploration = self.exploration
        if found.parked:
            chains = [exploration.chains[flow] for flow in found.parked]
            parts = [part for part in chains if not part.parked]
            open_chains = [part for part in chains if part.parked]
            autonomous = all(f.autonomous for f in exploration.fields)
            groups = [open_chains] if autonomous else [[part] for part in open_chains]
            parts += [part for group in groups if group for part in self._in_groups(group, found)]
            self._finish(found, parts)

    def _all_at_once(self, found: Findings) -> bool:
        """Let all parked flows go on as one; False where parts that go on alone may show more."""
        flows = found.parked
        if self.exploration.refused and found.failure:
            return False
        if not flows:
            return True
        following = self._after(flows)
        if following is None:
            return False
        part = self.exploration.follow([following], [[flow] for flow in flows], found, park=False)
        missing = [j for j in found.waiting if j not in part.proofs]
        undecided = bool(missing) or (found.waiting_safety is not None and part.safety is None)
        self._finish(found, [part])
        return not undecided or len(flows) == 1

    def _after(self, flows: Sequence[Flow]) -> Flow | None:
        first = len(flows) == 1 and flows[0].piece.chart.original
        return self.exploration.again(flows, self.exploration.end(), first=first)

    def _in_groups(self, open_chains: list[Findings], found: Findings) -> list[Findings]:
        """Chains that want another restart, together, or in halves where all of them are too much."""
        exploration = self.exploration
        ends = [part.parked[-1] for part in open_chains]
        before = [part.parked for part in open_chains]
        following = exploration.continued[ends[0]] if len(ends) == 1 else exploration.again(ends, exploration.end())
        if following is None:
            failure = Failure(Mechanism.NOT_ENCLOSED_AGAIN, time=max(flow.time for flow in ends))
            part = Findings(flow=ends[0], last=ends[-1], failure=ended(failure))
        else:
            part = exploration.follow([following], before, found, park=False)
        missing = [j for j in found.waiting if j not in part.proofs and any(j not in c.proofs for c in open_chains)]
        decided = not missing and (found.waiting_safety is None or part.safety is not None)
        if decided or len(open_chains) == 1 or time.monotonic() > exploration.deadline:
            proofs = [together([c.proofs.get(j) for c in open_chains]) for j in found.waiting]
            for j, proof in zip(found.waiting, proofs, strict=True):
                if proof is not None:
                    part.proofs[j] = proof
            return [part]
        half = len(open_chains) // 2
        return [*self._in_groups(open_chains[:half], found), *self._in_groups(open_chains[half:], found)]

    def _finish(self, found: Findings, parts: Sequence[Findings]) -> None:
        for j, others in found.waiting.items():
            settle(found, j, together([*others, *(part.proofs.get(j) for part in parts)]), parts)
        if found.waiting_safety is not None:
            found.safety = safe_together([*found.waiting_safety, *(part.safety for part in parts)])
        for part in parts:
            found.failure, found.unproved = part.failure, part.unproved
            found.no_tail, found.safe_until = part.no_tail, max(found.safe_until, part.safe_until)
