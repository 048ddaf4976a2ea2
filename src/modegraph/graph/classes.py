"""Continuous classes in a graph: relations instead of single verdicts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from modegraph.certify.continuous import ContinuousReferences
from modegraph.certify.moments import at_state
from modegraph.certify.proof import certified_for_some, certified_pair
from modegraph.certify.reason import Outcome, Reason, point
from modegraph.certify.references import Parameter
from modegraph.certify.relation import Part, Relation
from modegraph.certify.targets.family import target_class
from modegraph.certify.verdict import Status, Verdict, Witness
from modegraph.model.mode import Mode
from modegraph.model.sets import Box
from modegraph.model.target import Target
from modegraph.reach.start.piece import Floats

Key = tuple[str, int]
"""A mode and the position of a reference in its finite class; 0 for a continuous class or a Target."""


@dataclass(frozen=True)
class Link:
    """What is known of the switch between two nodes, one of them a whole continuous class.

    ``relation`` is a reason where there can be none. ``horizon`` in seconds (None: as far as the flowpipe went)
    belongs to the source.
    """

    relation: Relation | Reason
    horizon: float | None


@dataclass
class Classes:
    """The continuous classes of a graph.

    Attributes
    ----------
    regions : mode name to the Box of its parameters
    links : every ordered pair of nodes with a continuous class in it
    """

    regions: Mapping[str, Box]
    links: Mapping[tuple[Key, Key], Link]
    _references: dict[tuple[str, str], ContinuousReferences] = field(default_factory=dict)

    def involves(self, *names: str) -> bool:
        return any(name in self.regions for name in names)

    def references(self, i: str, j: str, parameters: Mapping[str, Sequence[Parameter]]) -> ContinuousReferences:
        """R^ij for two modes, one of them with a continuous class."""
        if (i, j) not in self._references:
            relations = {
                (s[1], t[1]): link.relation
                for (s, t), link in self.links.items()
                if s[0] == i and t[0] == j and isinstance(link.relation, Relation)
            }
            sides = [self.regions[name] if name in self.regions else tuple(parameters[name]) for name in (i, j)]
            self._references[i, j] = ContinuousReferences(sides[0], sides[1], relations, i == j)
        return self._references[i, j]

    def verdict(self, source: Key, target: Key, p: Parameter, q: Parameter) -> Verdict:
        """One pair of references, given by their parameters where the class is continuous."""
        link = self.links[source, target]
        if isinstance(link.relation, Reason):
            return Verdict(Status.UNDECIDED, (link.relation,), horizon=link.horizon)
        left, right = self.row(source[0], p), self.row(target[0], q)
        gauge = float(link.relation.crossings(left, right).gauge[0])
        if gauge <= 1.0:
            return certified_pair(link.relation, left, right, link.horizon)
        if link.relation.refuted(left, right)[0]:
            return _resting(link.relation, left, right)
        return _missed(link, left, right, gauge)

    def row(self, name: str, p: Parameter) -> Floats:
        """A reference as one row (1, k) for a relation; without columns where the class is finite."""
        if name not in self.regions:
            return np.zeros((1, 0))
        assert p is not None
        return np.asarray(p, float)[None]

    def existential(
        self, i: str, j: str, r_i: Floats | None, r_j: Floats | None, refs: ContinuousReferences
    ) -> Verdict:
        """Whether some pair is certified, every pair refuted, or neither; a reference given is kept."""
        horizon = next(link.horizon for (s, t), link in self.links.items() if s[0] == i and t[0] == j)
        unusable = [
            link.relation for (s, t), link in self.links.items()
            if s[0] == i and t[0] == j and isinstance(link.relation, Reason)
        ]  # fmt: skip
        best = refs.best(r_i, r_j)
        if best is None:
            why = (*unusable, Reason(Outcome.NO_REFERENCE_LEFT))[:1]
            return Verdict(Status.UNDECIDED, why, horizon=horizon)
        key, left, right, gauge = best
        link = self.links[(i, key[0]), (j, key[1])]
        assert isinstance(link.relation, Relation)
        where = {"r_i": point(left), "r_j": point(right)}
        if gauge <= 1.0:
            return certified_for_some(link.relation, left[None], right[None], link.horizon)
        if not unusable and refs.all_refuted(r_i, r_j):
            told = _resting(link.relation, left[None], right[None])
            why = (Reason(Outcome.WHOLE_REGION_REFUTED, **where, why=told.why),)
            return Verdict(Status.REFUTED, why, margin=1.0 - gauge, witness=told.witness)
        return _missed(link, left[None], right[None], gauge)

    def entered(self, name: str, mode: Mode | Target, x: Floats) -> ContinuousReferences | None:
        """The references under which a mode may be entered from x (n,), proved; None: none is found."""
        goal = target_class(mode, None, len(x))
        relation = Relation(None, goal, (Part((at_state(x, goal),)),), None)
        refs = ContinuousReferences((None,), self.regions[name], {(0, 0): relation}, False)
        best = refs.best(None, None)
        return refs if best is not None and best[3] <= 1.0 else None


def _missed(link: Link, source: Floats, target: Floats, gauge: float) -> Verdict:
    """What is missing for one pair (1, ki), (1, kj)."""
    assert isinstance(link.relation, Relation)
    if not np.isfinite(gauge):
        return Verdict(Status.UNDECIDED, (Reason(Outcome.NO_USABLE_INSTANT),), horizon=link.horizon)
    part, time = link.relation.worst(source, target)
    parts = link.relation.parts
    reason = Reason(
        Outcome.NO_COMMON_TIME, gauge=gauge, time=time, horizon=link.horizon, part=part + 1, parts=len(parts),
        offset=point(parts[part].offset), r_i=point(source[0]), r_j=point(target[0]),
    )  # fmt: skip
    return Verdict(Status.UNDECIDED, (reason,), margin=1.0 - gauge, horizon=link.horizon)


def _resting(relation: Relation, source: Floats, target: Floats) -> Verdict:
    assert relation.rest is not None
    x0 = np.array(relation.rest.at(source)[0][0])
    witness = Witness(x0, None, {}, 0.0, "trapped", source[0], target[0])
    return Verdict(Status.REFUTED, (Reason(Outcome.RESTS_OUTSIDE, x0=point(x0)),), witness=witness, horizon=None)
