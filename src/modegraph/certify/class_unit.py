"""One unit of work with a continuous class of references on one side or both: relations instead of verdicts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from modegraph.certify.lasting import BehindFlows, NothingToKeep
from modegraph.certify.legal import (
    proved,
    proved_instants,
    proved_until,
    sampled_violation,
    slack_until,
    unproved,
    width_over_time,
)
from modegraph.certify.proof import SafetyProof, certified_check
from modegraph.certify.question import TargetSpec
from modegraph.certify.reason import Outcome, Reason
from modegraph.certify.refinement import Links
from modegraph.certify.relation import Relation
from modegraph.certify.switching.base import least_slack
from modegraph.certify.switching.zero_time import zero_time
from modegraph.certify.targets.family import TargetClass, target_class
from modegraph.certify.verdict import Floats, Status, Verdict
from modegraph.deadline import Deadline
from modegraph.errors import ModegraphError
from modegraph.expression.scalar import Expr
from modegraph.expression.simplify import simplify
from modegraph.guarded import guarded
from modegraph.model.class_start import StartClass, returned_start
from modegraph.model.mode import Mode
from modegraph.model.sets.parametrised import ParametrisedSet
from modegraph.reach.compiled import CompiledMode, compile_mode
from modegraph.reach.cover.chain import Chain
from modegraph.reach.cover.cuts import nonlinear_variable
from modegraph.reach.cover.cutting import Cutting
from modegraph.reach.cover.degrees import CURVED, class_tail_order
from modegraph.reach.cover.improve import improve
from modegraph.reach.failure import Mechanism, engine_stopped
from modegraph.reach.flowpipe import DEFAULT_HORIZON
from modegraph.reach.start.piece import Chart, Piece
from modegraph.reach.tail.base import Tail, TailFailure
from modegraph.reach.tail.box import TailSearch

MOST_PARTS = 32
DEEPEST = 7
PROGRESS = 1.05
"""A cut must carry the constraints this much further, or it is the last one."""


@dataclass(frozen=True)
class ClassResult:
    """Relations parallel to the targets (a reason where there can be none), and the check of the whole class."""

    relations: list[Relation | Reason]
    check: Verdict


def relate(
    mode: Mode,
    p: Floats | None,
    targets: Sequence[TargetSpec],
    *,
    horizon: float | None,
    deadline: Deadline,
    progress: Callable[[str], None],
    cuts: int = 0,
) -> ClassResult:
    """The relations from a mode - under one reference, or p = None for its whole class - to its targets.

    Parameters
    ----------
    horizon : seconds a switch may take; None: the duration of the reference and some more.
    cuts : how often the starts are cut at most, as long as smaller parts certify more references.
    """
    compiled = compile_mode(mode, p)
    end = horizon if horizon is not None else 2.0 * (mode.reference.duration or 0.5 * DEFAULT_HORIZON)
    chains = _legal_chains(compiled, end, deadline, progress)
    region = mode.reference.region if p is None else None
    rest = _resting(mode, p, compiled) if all(chain.flows[0].steps for chain in chains) else None
    goals = [_goal(spec, compiled.plant) for spec in targets]
    links = Links(compiled, region, [goal for goal in goals if isinstance(goal, TargetClass)], rest, end, chains)
    links.appear(deadline, progress)
    links.refine(cuts, deadline, progress)
    known = iter(links.relations)
    # Of the constraints until the last instant that any of the relations uses.
    slack = least_slack(slack_until(flow, k) for chain in links.chains for flow, k in proved(chain))
    at_once = compiled.start.dim == compiled.plant and all(proved_until(chain) >= 0.0 for chain in links.chains)
    relations: list[Relation | Reason] = []
    for goal, spec in zip(goals, targets, strict=True):
        zero = zero_time(mode, p, spec) if at_once and not isinstance(goal, Reason) else None
        relations.append(goal if isinstance(goal, Reason) else replace(next(known), slack=slack, zero=zero))
    return ClassResult(relations, _check(compiled, links.chains))


def _goal(spec: TargetSpec, plant: int) -> TargetClass | Reason:
    """A target of the relations, or why it cannot be one."""
    try:
        return target_class(spec.mode, spec.p, plant)
    except ModegraphError as error:
        return Reason(Outcome.UNUSABLE_TARGET, text=str(error))


def _legal_chains(
    compiled: CompiledMode, end: float, deadline: Deadline, progress: Callable[[str], None]
) -> list[Chain]:
    """Chains that cover all starts, cut where a constraint cannot be proved, as long as that helps."""

    def worst(chains: Sequence[Chain]) -> Chain | None:
        progress(f"{len(chains)} parts")
        least = min(chains, key=proved_until)
        until = proved_until(least)
        hopeless = until >= 0.0 and sampled_violation(least.flows[0])
        return None if until >= min(end, least.time) or hopeless else least

    def cuts(chain: Chain) -> Iterator[list[Chain]]:
        if chain.piece.depth >= DEEPEST:
            return
        if chain.order.degree < CURVED.degree:
            halves, order = [chain.piece], CURVED
        else:
            halves, order = chain.piece.split(nonlinear_variable(chain.flows[0])), chain.order
        children = [Chain(compiled, half, order, deadline) for half in halves]
        for child in children:
            child.run(end)
        yield children

    def gained(chain: Chain, children: list[Chain], chains: list[Chain]) -> bool:
        until = proved_until(chain)
        # A higher degree is kept as it is.
        further = min(map(proved_until, children), default=np.inf) > PROGRESS * until
        return until < 0.0 or further or len(children) == 1

    chains, _ = Cutting(compiled, end, deadline).run()
    return improve(chains, worst, cuts, gained, most=MOST_PARTS, deadline=deadline)[0]


def _resting(mode: Mode, p: Floats | None, compiled: CompiledMode) -> TargetClass | None:
    """The centres of the start sets, where each is an equilibrium of the undisturbed loop, for all unknowns.

    The loop must be known to be defined on the start sets (a validated step shows that): what is cancelled
    here is not asked for its domain.
    """
    loop = compiled.loop
    segment = loop.segments[-1]
    pushes = mode.system.disturbance
    inside = pushes is None or pushes.contains(np.zeros(pushes.dim))
    if len(loop.segments) != 1 or loop.reset or not inside:
        return None
    graph = loop.graph
    start = compiled.start
    if isinstance(start, StartClass):
        centre = _centre_in(mode, compiled)
    else:
        centre = [graph.constant(float(v)) for v in np.asarray(start.center, float)]
    known = {x.index: c.index for x, c in zip(loop.states, centre, strict=True)}
    known |= {w.index: graph.constant(0).index for w in loop.disturbance}
    dropped = len(graph.dropped)
    rates = [Expr(graph, k) for k in graph.rewrite([e.index for e in segment.rhs], known=known)]
    rates = simplify(rates, work=5e5).exprs
    del graph.dropped[dropped:]
    if not all(e.is_constant and e.value == 0 for e in rates):
        return None
    try:
        return target_class(mode, p, compiled.plant)
    except ModegraphError:
        return None


def _centre_in(mode: Mode, compiled: CompiledMode) -> list[Expr]:
    """The centre of the start set as expressions of the closed loop's own graph."""
    loop = compiled.loop
    returned = returned_start(mode, loop.graph, loop.time, loop.parameters)
    assert isinstance(returned, ParametrisedSet)
    return returned.traced(loop.graph, mode.label).centre


def _check(compiled: CompiledMode, chains: Sequence[Chain]) -> Verdict:
    """Assumption 1 for the whole class: as far as the flows go, and for ever where a tail closes the time axis."""
    until = min(map(proved_until, chains))
    last = compiled.fields[-1]
    widths = width_over_time(chains[0].flows[:1])
    if compiled.linear and not any(f.faces for f in compiled.fields) and until >= last.start:
        # A linear loop has a solution for all time, and there is nothing else to prove.
        ends = [chain.flows[-1] for chain in chains]
        return replace(certified_check(SafetyProof(tuple(NothingToKeep(flow) for flow in ends))), widths=widths)
    if until < 0.0:
        reason = Reason(Outcome.START_NOT_PROVED, whole_class=True)
        return Verdict(Status.UNDECIDED, (reason, *_in_the_way(chains)), until=0.0, widths=widths)
    tails = _tails(compiled, chains)
    if isinstance(tails, TailFailure):
        reason = Reason(Outcome.NOT_FOR_EVER, until=until, why=tails, whole_class=True)
        return Verdict(Status.UNDECIDED, (reason, *_in_the_way(chains)), until=until, widths=widths)
    evidence = tuple(BehindFlows(chain.flows, tail) for chain, tail in zip(chains, tails, strict=True))
    return replace(certified_check(SafetyProof(evidence)), widths=widths)


def _in_the_way(chains: Sequence[Chain]) -> list[Reason]:
    """What ended the chain that ends first: a constraint, or the flow itself; nothing where all go to their end."""
    worst = min(chains, key=proved_until)
    broken = next((flow for flow in worst.flows if proved_instants(flow) < len(flow.steps)), None)
    breach = None if broken is None else unproved(broken, proved_instants(broken))
    why = [] if breach is None else [breach.reason]
    return why + ([] if worst.failure is None else [Reason(Outcome.FLOWPIPE_ENDED, failure=worst.failure)])


def _tails(compiled: CompiledMode, chains: Sequence[Chain]) -> list[Tail] | TailFailure:
    """Invariant sets from the ends of the flows on, their centres moving with the reference: one for each part."""
    found: list[Tail] = []
    for chain in chains:
        flow = chain.flows[-1]
        if chain.failure or proved_instants(flow) < len(flow.steps) or not flow.steps:
            return TailFailure(Mechanism.ENDS_BEFORE_SETTLED)
        order = class_tail_order(compiled.linear, chain.order, chain.piece.variables)
        search = TailSearch(
            flow.fields[-1], _own_chart(flow.piece), compiled.w_centre, compiled.w_radius, compiled.loop.names, order
        )
        tail = guarded("the search for an invariant set", partial(search.attempt, [flow]), _no_tail)
        if isinstance(tail, TailFailure):
            return tail
        if not tail.is_legal:
            return TailFailure(Mechanism.CONSTRAINT_IN_TAIL)
        found.append(tail)
    return found


def _no_tail(error: Exception) -> Tail | TailFailure:
    mechanism, fields = engine_stopped(error)
    return TailFailure(mechanism, **fields)


def _own_chart(piece: Piece) -> Chart:
    """The chart of a piece for the references and unknown constants that it is for: they do not change."""
    lo, hi = piece.unknown_ranges
    return replace(piece.chart, unknown_lo=lo, unknown_hi=hi)
