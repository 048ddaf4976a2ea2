"""A plan: modes, references and switches in order, with what is certified for the whole chain."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from modegraph.attach import with_methods
from modegraph.certify.proof import only_entered
from modegraph.certify.references import Parameter, parameter_text
from modegraph.certify.verdict import Status, Verdict
from modegraph.graph.switch import Switch
from modegraph.model.target import Target
from modegraph.plan.as_json import json_text, plan_data
from modegraph.plan.objectives import Cost, Objective

if TYPE_CHECKING:
    from modegraph import api
    from modegraph.graph.modegraph import ModeGraph


@with_methods
@dataclass(frozen=True, eq=False)
class Plan:
    """A chain of certified switches.

    Attributes
    ----------
    modes : list[str]
    references : list
        Parallel to ``modes``: the chosen reference of each, None where there is only one.
    switches : list[Switch]
        One shorter than ``modes``; each for the chosen pair of references.
    time : (float, float)
        Seconds: sums of the earliest and of the latest switch times, rounded outward. The goal is
        entered between them.
    energy : float or None
        Certified upper bound of the integral of u'u until the goal is entered.
    cost : int or float
        What was minimised; for "margin", the largest gauge on the way (1 - margin).
    margin : float or None
        Smallest margin of the switches; None without a switch.
    objective : str
    goal_check : Verdict
        Whether the constraints hold for all time in the goal mode.
    warnings : tuple[str, ...]
        What the certificate does not cover.
    x0 : (n,) array or None
        The state the plan was asked for.
    """

    if TYPE_CHECKING:  # from upper layers
        simulate = api.simulate
        supervisor = api.supervisor
        export_c = api.export_c
        plot = api.plot_plan

    modes: list[str]
    references: list[Parameter]
    switches: list[Switch]
    time: tuple[float, float]
    energy: float | None
    cost: float
    margin: float | None
    objective: str
    goal_check: Verdict
    warnings: tuple[str, ...]
    x0: Any = None
    graph: ModeGraph = field(repr=False, kw_only=True)
    bounded: Callable[[], float] = field(repr=False, kw_only=True)

    @classmethod
    def of(
        cls,
        graph: ModeGraph,
        stops: Sequence[tuple[str, Parameter]],
        *,
        objective: Objective,
        cost: Cost,
        margin: float | None,
        x0: Any,
        bounded: Callable[[], float],
    ) -> Plan:
        """The plan along ``stops``, a mode and a reference each, whose consecutive pairs are all certified."""
        switches = [graph.pair_switch(i, j, p, q) for (i, p), (j, q) in pairwise(stops)]
        energies = [s.energy for s in switches]
        known = [Fraction(e) for e in energies if e is not None and math.isfinite(e)]
        energy = rounded_up(sum(known, Fraction(0))) if len(known) == len(energies) else None
        goal_check = _goal_check(graph, *stops[-1])
        return cls(
            modes=[name for name, _ in stops],
            references=[p for _, p in stops],
            switches=switches,
            time=(
                rounded_down(sum((Fraction(s.time[0]) for s in switches), Fraction(0))),
                rounded_up(sum((Fraction(s.time[1]) for s in switches), Fraction(0))),
            ),
            energy=energy,
            cost=_cost(objective, cost, margin, len(switches)),
            margin=margin,
            objective=objective.name,
            goal_check=goal_check,
            warnings=_warnings(stops[-1][0], goal_check, objective, cost),
            x0=x0,
            graph=graph,
            bounded=bounded,
        )

    @cached_property
    def bound(self) -> float:
        """No plan made of what is certified costs less, whatever references it chooses (a float computation).

        Equal to ``cost`` where all classes are finite: their best plan is found exactly.
        """
        return min(self.cost, self.bounded()) if self.graph.regions else self.cost

    @property
    def gap(self) -> float:
        """How much a better choice of references might still save: cost - bound."""
        return self.cost - self.bound if math.isfinite(self.cost) else 0.0

    def to_json(self) -> str:
        """The plan as JSON text with the attribute names as keys; what is unknown is null."""
        return json_text(plan_data(self))

    def __str__(self) -> str:
        lines = [" ".join(self.modes)]
        chosen = [
            f"{name} {parameter_text(r)}"
            for name, r in zip(self.modes, self.references, strict=True)
            if self.graph.has_choice(name)
        ]
        if chosen:
            lines.append("  references: " + ", ".join(chosen))
        for s in self.switches:
            lines.append(
                f"  {s.source} -> {s.target}: between {s.time[0]:.4g} and {s.time[1]:.4g} s"
                + ("" if s.margin is None else f", margin {s.margin:.3g}")
                + ("" if s.energy is None else f", energy <= {s.energy:.4g}")
            )
        lines.append(f"  in {self.modes[-1]!r} between {self.time[0]:.4g} and {self.time[1]:.4g} s, certified")
        if self.energy is not None:
            lines.append(f"  energy at most {self.energy:.4g}")
        if self.graph.regions:
            lines.append(f"  {self.objective}: {self.cost:.4g}; no choice of references gets below {self.bound:.4g}")
        lines += [f"  warning: {w}" for w in self.warnings]
        return "\n".join(lines)


def rounded_up(value: Fraction) -> float:
    """The smallest double that is not below ``value``."""
    near = float(value)
    return near if Fraction(near) >= value else math.nextafter(near, math.inf)


def rounded_down(value: Fraction) -> float:
    """The largest double that is not above ``value``."""
    near = float(value)
    return near if Fraction(near) <= value else math.nextafter(near, -math.inf)


def _cost(objective: Objective, cost: Cost, margin: float | None, switches: int) -> float:
    if objective.bottleneck:
        return 0.0 if margin is None else 1.0 - margin
    if cost[0]:
        return math.inf
    return switches if objective.name == "switches" else rounded_up(cost[1])


def _goal_check(graph: ModeGraph, name: str, p: Parameter) -> Verdict:
    return only_entered(name) if isinstance(graph.modes[name], Target) else graph.goal_check(name, p)


def _warnings(goal: str, check: Verdict, objective: Objective, cost: Cost) -> tuple[str, ...]:
    found = []
    if check.status is Status.REFUTED:
        found.append(f"the constraints of goal {goal!r} do not hold for all time: {check.reason}")
    elif check.status is Status.UNDECIDED:
        upto = "" if check.until is None else f" (proved until {check.until:.4g} s)"
        found.append(f"the constraints of goal {goal!r} are not proved for all time{upto}: {check.reason}")
    if cost[0]:
        found.append(f"{objective.name}: {cost[0]} of the switches has no certified bound")
    return tuple(found)
