"""Flowpipes of the parts of one start set, cut as far as the questions need."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from modegraph.certify.chain_evidence import NOTHING, Past, findings_of
from modegraph.certify.course import TOO_MUCH_FEEDBACK, Course
from modegraph.certify.findings import Findings, better, filled, merge
from modegraph.certify.question import Question
from modegraph.certify.reason import engine_reason
from modegraph.certify.switching.common_time import Missed, widest_variable
from modegraph.cores import in_parallel
from modegraph.guarded import guarded
from modegraph.reach.cover.cuts import nonlinear_variable, parts_of_refused
from modegraph.reach.cover.degrees import PART_LADDER, part_order
from modegraph.reach.flow.flow import Flow, Order
from modegraph.reach.start.piece import Piece

MOST_PARTS = 64
"""Parts explored in all: each may use its share of what is left, whether or not the others need theirs. So the
answer does not depend on which of them ends first."""
DEEPEST_CUT = 7


@dataclass(frozen=True)
class Exploration:
    """Parts of the starts under one question.

    With ``common``, parts that the disturbance has filled are to go on together, one alone is not looked at.
    Possible where time does not matter: they go on from the latest of their instants.
    """

    question: Question
    common: bool

    def _order(self, piece: Piece, effort: int) -> Order:
        return part_order(self.question.linear, piece.variables, effort)

    def explore(
        self, piece: Piece, wanted: Sequence[int], safety: bool, effort: int = 0, allowance: int = MOST_PARTS
    ) -> Findings:
        """Decide the wanted goals (and the check) on one part, cutting it into ``allowance`` parts at most."""
        found = guarded(
            "the flow of a part of the starts",
            lambda: self._run(piece, wanted, safety, effort),
            lambda error: _lost(piece, wanted, error),
        )
        flow = found.flow
        if flow is None:
            return found
        if found.waits and not self.common:
            self._try_alone(found)
        left = [j for j in wanted if j not in found.proofs and j not in found.waiting]
        again, check_again = self._worth_refining(found, left, safety)
        allowance -= 1
        if (not again and not check_again) or not allowance or self.question.deadline.is_over:
            return found
        cut_short = bool(found.failure or found.unproved)
        # A part whose remainder feeds itself is cut: smaller ones need no high degrees.
        finer = cut_short and not (found.refused and piece.depth > 0)
        if finer and effort + 1 < len(PART_LADDER) and self._order(piece, effort + 1) != self._order(piece, effort):
            second = self.explore(piece, again, check_again, effort + 1, allowance)
            return merge(found, [second], again, check_again)
        if piece.depth >= DEEPEST_CUT or piece.variables == 0:
            return found
        # No pieces: this one is proved to hold no start, though only now that it is cut.
        if found.refused:
            pieces, effort = parts_of_refused(flow, DEEPEST_CUT), 0
        elif cut_short:
            pieces = piece.split(nonlinear_variable(flow))
        else:
            pieces = piece.split(widest_variable(flow.set_at(0)))
        share = allowance // max(1, len(pieces))
        if not share:
            return found
        # At a kink a cut leaves a part astride of it, which may get no further yet.
        patient = piece.chart.sublevel is not None or flow.astride is not None
        children: list[Findings] = []
        for child in in_parallel([partial(self.explore, part, again, check_again, effort, share) for part in pieces]):
            children.append(child)
            if not patient and not child.empty and not better(child, found, again, check_again):
                # Smaller starts get no further: the disturbance, not the size of the start, is in the way.
                found.held_back |= any(part.held_back for part in children)
                return found
        return merge(found, children, again, check_again)

    def follow(self, flows: list[Flow], past: Past, found: Findings, park: bool) -> Findings:
        """What flows show that go on from the ends of the chains before them, of what ``found`` waits for."""
        wanted, safety = list(found.waiting), found.waiting_safety is not None
        course = Course(self.question, flows, park, self.common).run(wanted, safety)
        return findings_of(course, wanted, safety, past)

    def _try_alone(self, found: Findings) -> None:
        """Go on with a part that waits until it is decided or wants another restart; it waits no more where that
        breaks down: its part of the starts is too large then."""
        (chain,) = found.waits
        assert chain.following is not None
        part = self.follow([chain.following], Past([chain.flows]), found, park=True)
        assert part.last is not None
        if part.failure or part.unproved or part.last.feedback > TOO_MUCH_FEEDBACK:
            found.unpark(part.failure or part.unproved or filled(part.last))
            return
        chain.alone = part

    def _worth_refining(self, found: Findings, left: Sequence[int], safety: bool) -> tuple[list[int], bool]:
        """Goals for which smaller parts may succeed, and whether the check may."""
        hopeful = {j for j in left if found.missed[j].hopeful}
        if found.broken:
            return sorted(hopeful), False
        cut_short = bool(found.failure or found.unproved)
        if cut_short:
            hopeful |= set(left)
        return sorted(hopeful), safety and found.safety is None and cut_short

    def _run(self, piece: Piece, wanted: Sequence[int], safety: bool, effort: int) -> Findings:
        question = self.question
        flow = question.compiled.flow(piece, self._order(piece, effort), longest_step=question.longest_step)
        course = Course(question, [flow], True, self.common).run(wanted, safety)
        found = findings_of(course, wanted, safety, NOTHING)
        if not found.waits:
            return found
        if self.common and flow.feedback > TOO_MUCH_FEEDBACK:
            found.refused = found.held_back = True
            found.waits, found.failure = [], filled(flow)
            return found
        found.waiting = {j: [] for j in wanted if j not in found.proofs}
        if safety and found.safety is None:
            found.waiting_safety = []
        return found


def _lost(piece: Piece, wanted: Sequence[int], error: Exception) -> Findings:
    """Nothing is known of a part."""
    missed = {j: Missed(np.inf, 0.0, False, piece.middle) for j in wanted}
    return Findings(missed=missed, failure=engine_reason(error))
