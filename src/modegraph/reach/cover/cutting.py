"""Chains of flows that together hold all starts, cut where they end too early or are too wide."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from modegraph.cores import in_parallel
from modegraph.deadline import NEVER, Deadline
from modegraph.reach.compiled import CompiledMode
from modegraph.reach.cover.chain import Chain
from modegraph.reach.cover.cuts import nonlinear_variable
from modegraph.reach.cover.degrees import is_light
from modegraph.reach.cover.improve import Ending, improve
from modegraph.reach.cover.looseness import is_given_up, is_loose, is_very_loose, looseness, remainder
from modegraph.reach.cover.probe import orders_of
from modegraph.reach.failure import Failure, Mechanism
from modegraph.reach.start.piece import Piece

Floats = NDArray[np.float64]

MOST_PIECES = 32
DEEPEST_CUT = 9
MOST_LOOSE_PIECES, WORTH_CUTTING = 8, 0.8
"""A class of references that is very loose is cut into at most so many, while halves are by this much tighter."""
MOST_TRIES = 3
"""Places where a chain of flows is cut before it is given up."""
MOST_TIGHTENED, NARROWER = 8, 0.9
"""Complete chains are cut up to so many pieces, as long as the halves together end narrower by this in some state."""
PROGRESS = 1.05
"""A cut or a higher degree must get this much further, or it is the last one."""
PATIENT_DEPTH = 2
"""Pieces cut less often than this may get no further: two variables may need a cut each."""
STUCK = {Ending.LIMIT: Mechanism.NO_MORE_CUTS, Ending.NO_GAIN: Mechanism.CUTS_DO_NOT_HELP}


@dataclass(frozen=True)
class _Part:
    """A piece with its best chain: which rung of the ladder made it, and the last rung worth trying."""

    chain: Chain
    rung: int
    top: int


class Cutting:
    """Pieces of the start set, or of later sets, cut where the flowpipe ends first, as long as that gets further."""

    def __init__(self, compiled: CompiledMode, end: float, deadline: Deadline = NEVER) -> None:
        self.compiled, self.end, self.deadline = compiled, end, deadline
        self.disturbed = bool(compiled.w_radius.any())

    def run(self) -> tuple[list[Chain], Failure | None]:
        """A chain for each piece, and why cutting ended where it failed."""
        whole = self.compiled.whole()
        self._ladder = orders_of(self.compiled, whole, self.end)
        parts = [self._best(whole, 0, len(self._ladder) - 1)]
        parts, ending = improve(
            parts, _first_to_fail, self._cuts, self._further, most=MOST_PIECES, deadline=self.deadline
        )
        if ending is not Ending.ENOUGH:
            return [part.chain for part in parts], Failure(STUCK[ending])
        if self.disturbed:
            parts, _ = improve(
                parts, self._widest, self._cut_on_the_way, self._narrower, most=MOST_TIGHTENED, deadline=self.deadline
            )
        elif self.compiled.parameters:
            parts, _ = improve(
                parts, _loosest, self._cut_at_the_start, self._tighter, most=MOST_LOOSE_PIECES, deadline=self.deadline
            )
        return [part.chain for part in parts], None

    # -- parts that do not get to the end ----------------------------------------------------------

    def _cuts(self, part: _Part) -> Iterator[list[_Part]]:
        return (self._cut(part, k) for k in self._places(part.chain))

    def _further(self, whole: _Part, children: list[_Part], parts: list[_Part]) -> bool:
        """Whether all children get further than the whole did.

        At a kink one is enough, for a cut leaves a part astride of it.
        """
        # A piece without halves is proved to hold no start; not all are, for the start set is not empty.
        chain = whole.chain
        place = children[0].chain.shared if children else 0
        if place == 0 and chain.piece.depth < PATIENT_DEPTH and len(chain.flows) == 1:
            return True
        further = [not c.chain.failure or c.chain.time > PROGRESS * chain.time for c in children]
        return any(further) if chain.flows[place].astride is not None else all(further)

    # -- parts that are wider than need be -----------------------------------------------------------

    def _cut_at_the_start(self, part: _Part) -> Iterator[list[_Part]]:
        yield self._cut(part, 0)

    def _tighter(self, whole: _Part, children: list[_Part], parts: list[_Part]) -> bool:
        """Whether pieces of a class of references are much tighter."""
        worst = max((looseness(child.chain) for child in children), default=0.0)
        return worst <= WORTH_CUTTING * looseness(whole.chain)

    def _widest(self, parts: Sequence[_Part]) -> _Part | None:
        """The part with the widest end, if it may be cut on the way."""
        size = np.maximum(_end_widths(parts), 1e-300)
        widest = max(parts, key=lambda part: float((_end_widths([part]) / size).sum()))
        return widest if self._on_the_way(widest.chain) else None

    def _on_the_way(self, chain: Chain) -> list[int]:
        return [k for k in self._places(chain) if k > 0 and k in chain.fed()]

    def _cut_on_the_way(self, part: _Part) -> Iterator[list[_Part]]:
        yield self._cut(part, self._on_the_way(part.chain)[0])

    def _narrower(self, whole: _Part, children: list[_Part], parts: list[_Part]) -> bool:
        """Whether the ends of the children together are much narrower in some state."""
        if any(child.chain.failure for child in children):
            return False
        return bool((_end_widths(children) <= NARROWER * _end_widths([whole])).any())

    # -- cutting -------------------------------------------------------------------------------------

    def _places(self, chain: Chain) -> list[int]:
        """Flows of a chain, the start of which may be cut, best first."""
        pieces = [flow.piece for flow in chain.flows]
        able = [k for k in chain.weak() if pieces[k].depth < DEEPEST_CUT and pieces[k].variables > 0]
        return able[:MOST_TRIES]

    def _cut(self, part: _Part, k: int) -> list[_Part]:
        """The halves of a part: of the start set, or of a set that flow k > 0 was started again from."""
        if k == 0:
            halves = part.chain.piece.split(nonlinear_variable(part.chain.flows[0]))
            return list(in_parallel([partial(self._best, half, part.rung, part.top) for half in halves]))
        return list(in_parallel([partial(self._go_on, part, chain) for chain in part.chain.halves(k)]))

    def _go_on(self, part: _Part, chain: Chain) -> _Part:
        chain.run(self.end)
        return replace(part, chain=chain)

    def _best(self, piece: Piece, first: int, top: int) -> _Part:
        """The chain of a piece with the first degree that is good enough, or the best one."""
        light = [is_light(order, piece) for order in self._ladder]
        best: _Part | None = None
        given_up: _Part | None = None
        for rung in range(first, top + 1):
            if best is not None and self.deadline.is_over:
                break
            if best is not None and not light[rung] and (best.chain.failure or not is_very_loose(best.chain)):
                break
            chain = Chain(self.compiled, piece, self._ladder[rung], self.deadline)
            impatient = best is None and not self.disturbed and rung < top and light[rung + 1]
            done = chain.run(self.end, is_given_up if impatient else None)
            if done and chain.time < self.end:
                given_up = _Part(chain, rung, top)
                continue
            if given_up is not None and not done:
                given_up.chain.run(self.end)
                best = given_up
            given_up = None
            if best is not None and not _is_worth_it(chain, best.chain):
                return replace(best, top=best.rung)
            best = _Part(chain, rung, top)
            if not chain.begun or (done and (self.disturbed or not is_loose(chain))):
                break
        assert best is not None
        return best


def _first_to_fail(parts: Sequence[_Part]) -> _Part | None:
    return min((part for part in parts if part.chain.failure), key=lambda part: part.chain.time, default=None)


def _loosest(parts: Sequence[_Part]) -> _Part | None:
    """The loosest part of a class of references, where it is very loose."""
    loosest = max(parts, key=lambda part: looseness(part.chain))
    return loosest if is_very_loose(loosest.chain) and loosest.chain.piece.variables else None


def _end_widths(parts: Sequence[_Part]) -> Floats:
    """Widths (n,) of the box around the ends of all parts."""
    boxes = [part.chain.flows[-1].last_set.ranges() for part in parts]
    return np.asarray(np.max([hi for _, hi in boxes], axis=0) - np.min([lo for lo, _ in boxes], axis=0))


def _is_worth_it(chain: Chain, other: Chain) -> bool:
    """Whether a chain of higher degree is worth its cost: it gets further, or is narrower at the end."""
    if chain.failure or other.failure:
        return not chain.failure or chain.time > PROGRESS * other.time
    return float(remainder(chain)[0].max()) < float(remainder(other)[0].max())
