"""One pair of references, proved by itself, and what it becomes when its modes are changed."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

from modegraph.certify.question import TargetSpec
from modegraph.certify.references import Parameter
from modegraph.certify.unit import certify_unit
from modegraph.certify.verdict import Verdict
from modegraph.cores import one_core
from modegraph.deadline import Deadline
from modegraph.graph.build import node_verdict
from modegraph.model.mode import Mode
from modegraph.model.sets import Set, Sublevel, is_subset
from modegraph.model.sets.scaled import scaled
from modegraph.model.start import mode_start
from modegraph.model.target import Target
from modegraph.model.variant import narrowed, with_horizon, with_set, with_start, without_constraints


@dataclass(frozen=True, eq=False)
class Pair:
    """The switch from one mode under one reference to another, within a list of modes.

    Attributes
    ----------
    modes : tuple of Mode and Target
        All modes of the graph, ``source`` and ``target`` among them.
    source, target : Mode, Mode or Target
        The same object where a mode is followed by itself.
    r_i, r_j : array or None
        Members of their finite classes.
    """

    modes: tuple[Mode | Target, ...]
    source: Mode
    target: Mode | Target
    r_i: Parameter
    r_j: Parameter

    @classmethod
    def of(
        cls,
        modes: tuple[Mode | Target, ...],
        source: Mode,
        target: Mode | Target,
        r_i: Parameter,
        r_j: Parameter,
        horizon: float | None,
    ) -> Pair:
        """The pair in a graph; of continuous classes these references alone are left, and the horizon is fixed."""
        pair = cls(modes, source, target, r_i, r_j)
        if source.reference.region is not None:
            members = [r_i, r_j] if source is target else [r_i]
            pair = pair._with(narrowed(source, [p for p in members if p is not None]), None)
        if isinstance(pair.target, Mode) and pair.target.reference.region is not None and r_j is not None:
            pair = pair._with(None, narrowed(pair.target, [r_j]))
        return pair.lasting(source.horizon or horizon)

    def _with(self, source: Mode | None, target: Mode | Target | None) -> Pair:
        """With another source or target; where both are one mode, that is what changes."""
        one = self.source is self.target
        new_source = source or (target if one and isinstance(target, Mode) else self.source)
        new_target = target or (source if one else None) or self.target
        places = {self.source.name: new_source, self.target.name: new_target}
        return replace(
            self, modes=tuple(places.get(m.name, m) for m in self.modes), source=new_source, target=new_target
        )

    # -- changes ---------------------------------------------------------------------------------

    def shrunk(self, scale: float) -> Pair:
        """With the starts of the source scaled about their centre."""
        start = scaled(mode_start(self.source, self.r_i), scale)
        return self._with(with_start(self.source, self.r_i, start), None)

    def grown(self, factor: float) -> Pair:
        """With the set to be entered scaled about its centre."""
        return self._with(None, with_set(self.target, self.r_j, scaled(self.entered, factor)))

    def lasting(self, seconds: float | None) -> Pair:
        """With another horizon."""
        return self._with(with_horizon(self.source, seconds), None)

    def unconstrained(self) -> Pair:
        """With nothing to keep on the way."""
        return self._with(without_constraints(self.source), None)

    # -- proofs ----------------------------------------------------------------------------------

    @property
    def entered(self) -> Set:
        """The set the switch leads into."""
        return self.target.set if isinstance(self.target, Target) else mode_start(self.target, self.r_j)

    @property
    def starts_inside(self) -> bool:
        """Whether all starts of the source are in the target already, decided exactly; False where that is costly."""
        start, entered = mode_start(self.source, self.r_i), self.entered
        if isinstance(start, Sublevel) or isinstance(entered, Sublevel) or start.dim != entered.dim:
            return False
        return is_subset(start, entered)

    @property
    def spec(self) -> TargetSpec:
        return TargetSpec(self.target.name, self.r_j, self.target)

    def proved(self, deadline: float, until: float = math.inf) -> Verdict:
        """The verdict on this pair alone, without a search for counterexamples, nor for switches after ``until``."""
        with one_core():
            found = certify_unit(
                self.source, self.r_i, [self.spec],
                horizon=self.source.horizon, deadline=_until(deadline), switches_only=True, until=until,
            )  # fmt: skip
        return found.verdicts[0]

    def built(self, deadline: float) -> Verdict:
        """The verdict on this pair from the unit of work that ``build(self.modes)`` does for it."""
        source = self.source.name, self.source.match(self.r_i)
        target = self.target.name, 0 if isinstance(self.target, Target) else self.target.match(self.r_j)
        return node_verdict(self.modes, source, target, horizon=self.source.horizon, deadline=_until(deadline))


def _until(instant: float) -> Deadline:
    """The deadline at an instant of ``time.monotonic()``."""
    return Deadline(instant - time.monotonic())
