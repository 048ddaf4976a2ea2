"""Smaller parts of the starts where that certifies more references: undecided regions shrink with the work spent."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.continuous import ContinuousReferences
from modegraph.certify.legal import proved
from modegraph.certify.moments import moments_of
from modegraph.certify.relation import Part, Relation, whole_relation
from modegraph.certify.targets.family import TargetClass
from modegraph.deadline import Deadline
from modegraph.model.sets import Box
from modegraph.reach.compiled import CompiledMode
from modegraph.reach.cover.chain import Chain
from modegraph.reach.cover.cuts import nonlinear_variable
from modegraph.reach.cover.improve import improve

Floats = NDArray[np.float64]

SAMPLES = 1500
"""Pairs of references at which relations are compared."""
CHOICE = 16
"""Targets drawn for each source."""
WORTH = 0.01
"""Share of the undecided pairs that a cut must decide."""
SMALL = 0.01
"""Share of all pairs that may stay undecided."""
MOST_PARTS, DEEPEST = 64, 9
NEAR, NEARER = 1.25, 0.9
"""A target missed by less is worth cuts, as long as each comes nearer by this."""


@dataclass
class Links:
    """Chains that cover all starts, and what each can prove of each target.

    Attributes
    ----------
    region : Box or None
        The class of the source.
    goals : the targets
    rest : as in `Relation`
    """

    compiled: CompiledMode
    region: Box | None
    goals: Sequence[TargetClass]
    rest: TargetClass | None
    end: float
    chains: list[Chain]

    def __post_init__(self) -> None:
        self._parts: dict[Chain, list[Part | None]] = {chain: self._proofs(chain) for chain in self.chains}

    @property
    def relations(self) -> list[Relation]:
        """The relation to each target."""
        return [
            whole_relation(self.region, goal, [self._parts[chain][j] for chain in self.chains], self.rest)
            for j, goal in enumerate(self.goals)
        ]

    def _proofs(self, chain: Chain) -> list[Part | None]:
        return [part_of(chain, goal, self.end, self.compiled.parameters) for goal in self.goals]

    def refine(self, cuts: int, until: Deadline, progress: Callable[[str], None]) -> None:
        """Cut the starts where it helps, worst part first."""
        if not self.goals or not cuts:
            return
        pairs = [self._pairs(relation, k) for k, relation in enumerate(self.relations)]
        open_, failing = self._failing(pairs)

        def worst(chains: Sequence[Chain]) -> Chain | None:
            candidates = [c for c in chains if c.shared == 0 and c.piece.depth < DEEPEST]
            if open_ <= SMALL * SAMPLES * len(pairs) or not candidates:
                return None
            most = max(candidates, key=lambda chain: failing[chain])
            if failing[most] < WORTH * open_:
                return None
            progress(f"{len(self.chains)} parts, {100.0 * open_ / (SAMPLES * len(pairs)):.0f} % of pairs undecided")
            return most

        def gained(chain: Chain, children: list[Chain], chains: list[Chain]) -> bool:
            nonlocal open_, failing
            before, self.chains = self.chains, chains
            now, failing_now = self._failing(pairs)
            if now > (1.0 - WORTH) * open_:
                # Two variables may need a cut each, but then this one was not the first to cut.
                self.chains = before
                return False
            open_, failing = now, failing_now
            return True

        improve(
            self.chains, worst, partial(self._halves, until=until), gained,
            most=MOST_PARTS, deadline=until, most_cuts=cuts, persistent=True,
        )  # fmt: skip

    def appear(self, until: Deadline, progress: Callable[[str], None]) -> None:
        """Cut the starts where a target that no pair of references is certified for is nearly met."""
        for j in range(len(self.goals)):
            self._bring_near(j, until, progress)

    def _bring_near(self, j: int, until: Deadline, progress: Callable[[str], None]) -> None:
        source, target, gauge = self._nearest(j)

        def worst(chains: Sequence[Chain]) -> Chain | None:
            if not 1.0 < gauge <= NEAR:
                return None
            farthest = max(chains, key=lambda chain: self._gauge(chain, j, source, target))
            if farthest.shared or farthest.piece.depth >= DEEPEST:
                return None
            progress(f"{len(self.chains)} parts, a target is missed by {gauge - 1.0:.2g} of its size")
            return farthest

        def gained(chain: Chain, children: list[Chain], chains: list[Chain]) -> bool:
            nonlocal source, target, gauge
            before, self.chains = self.chains, chains
            found = self._nearest(j)
            if not found[2] <= NEARER * gauge:
                self.chains = before
                return False
            source, target, gauge = found
            return True

        improve(
            self.chains, worst, partial(self._halves, until=until), gained, most=MOST_PARTS, deadline=until
        )  # fmt: skip

    def _nearest(self, j: int) -> tuple[Floats, Floats, float]:
        """The pair (1, ki), (1, kj) found nearest to being certified, and its gauge."""
        sides = [(None,) if side is None else side for side in (self.region, self.goals[j].region)]
        relation = self.relations[j]
        best = ContinuousReferences(sides[0], sides[1], {(0, 0): relation}, False).best(None, None)
        assert best is not None
        return best[1][None], best[2][None], best[3]

    def _gauge(self, chain: Chain, j: int, source: Floats, target: Floats) -> float:
        """How near one chain comes to a target for one pair; 0 where it has no starts."""
        part, goal = self._parts[chain][j], self.goals[j]
        if part is None:
            return np.inf
        if not part.meets(source, source)[0]:
            return 0.0
        return float(Relation(self.region, goal, (part,), None).crossings(source, target).gauge[0])

    def _halves(self, chain: Chain, until: Deadline) -> Iterator[list[Chain]]:
        """Chains of the halves of one chain's starts."""
        halves = chain.piece.split(nonlinear_variable(chain.flows[0]))
        children = [Chain(self.compiled, half, chain.order, until) for half in halves]
        for child in children:
            child.run(self.end)
            self._parts[child] = self._proofs(child)
        yield children

    def _fails(self, part: Part | None, goal: TargetClass, source: Floats, target: Floats) -> NDArray[np.bool_]:
        """Pairs for which a part has starts and proves nothing."""
        if part is None:
            return np.ones(len(source), bool)
        asked = part.meets(source, source)
        return asked & ~Relation(self.region, goal, (part,), None).certified(source, target)

    def _pairs(self, relation: Relation, seed: int) -> tuple[Floats, Floats]:
        """Sources all over the class, each with the target of a few that is nearest to being certified."""
        rng = np.random.default_rng(seed)
        sides = (self.region, relation.goal.region)
        count = SAMPLES * CHOICE
        draws = [np.zeros((count, 0)) if s is None else rng.uniform(s.lo, s.hi, (count, s.dim)) for s in sides]
        source = np.repeat(draws[0][:SAMPLES], CHOICE, axis=0)
        gauge = relation.crossings(source, draws[1]).gauge.reshape(SAMPLES, CHOICE)
        # Some near, some as they come.
        best = np.where(np.arange(SAMPLES) % 3 == 0, 0, gauge.argmin(axis=1)) + CHOICE * np.arange(SAMPLES)
        return source[best], draws[1][best]

    def _failing(self, pairs: Sequence[tuple[Floats, Floats]]) -> tuple[int, dict[Chain, int]]:
        """How many sampled pairs are undecided, and in how many of these each chain proves nothing."""
        total = 0
        failing = dict.fromkeys(self.chains, 0)
        for j, (goal, (source, target)) in enumerate(zip(self.goals, pairs, strict=True)):
            proofs = [self._parts[chain][j] for chain in self.chains]
            alone = [self._fails(part, goal, source, target) for part in proofs]
            refuted = Relation(self.region, goal, (), self.rest).refuted(source, target)
            undecided: NDArray[np.bool_] = np.logical_or.reduce(alone) & ~refuted
            total += int(undecided.sum())
            for chain, fails in zip(self.chains, alone, strict=True):
                failing[chain] += int((fails & undecided).sum())
        return total, failing


def part_of(chain: Chain, goal: TargetClass, end: float, classes: Sequence[tuple[float, float]]) -> Part | None:
    """What the flows of a chain prove of a target; None where they have no usable instant."""
    moments = (moments_of(flow, goal, end, classes) for flow, _ in proved(chain))
    found = [m for m in moments if m is not None]
    axes = chain.piece.chart.axes
    return Part(tuple(found), axes @ chain.piece.middle[: axes.shape[1]]) if found else None
