"""A question in the user's words, turned into a search and back into plans."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np

from modegraph.errors import ModegraphError
from modegraph.graph.entry import may_enter, plain_state
from modegraph.graph.modegraph import Node
from modegraph.model.sets import Box
from modegraph.model.target import Target
from modegraph.plan.bound import Relaxation
from modegraph.plan.candidates import Proposals
from modegraph.plan.network import Network
from modegraph.plan.objectives import objective
from modegraph.plan.plan import Plan
from modegraph.plan.question import End, Question
from modegraph.plan.search import Path, Problem, best_paths
from modegraph.plan.unreachable import unreachable

if TYPE_CHECKING:
    from modegraph.graph.modegraph import ModeGraph


def plans(
    graph: ModeGraph,
    k: int,
    start: Any = None,
    goal: Any = None,
    *,
    minimize: Any = "switches",
    r_start: Any = None,
    r_goal: Any = None,
    x0: Any = None,
    via: Sequence[Any] = (),
    avoid: Sequence[Any] = (),
    max_switches: int | None = None,
) -> list[Plan]:
    """The ``k`` best chains of certified switches, best first; see ``ModeGraph.plan``.

    Raises
    ------
    Unreachable
        If there is no such chain.
    ModegraphError
        If the question makes no sense.
    """
    if isinstance(k, bool) or not isinstance(k, Integral) or k < 1:
        raise ModegraphError(f"plans: k must be a positive integer, not {k!r}")
    if max_switches is not None and (
        isinstance(max_switches, bool) or not isinstance(max_switches, Integral) or max_switches < 0
    ):
        raise ModegraphError(f"plan: max_switches must be an integer >= 0 or None, not {max_switches!r}")
    if goal is None:
        raise ModegraphError("plan: give a goal, the mode or target to end in")
    if start is None and x0 is None:
        raise ModegraphError("plan: give a start, the mode that runs at first, or x0, a state")
    wanted = objective(minimize, max((float((b.hi - b.lo).max()) for b in graph.regions.values()), default=0.0))
    avoided = frozenset(graph.name_of(m) for m in _several("avoid", avoid))
    through = tuple(graph.name_of(m) for m in _several("via", via))
    state = None if x0 is None else plain_state(x0, graph.dimension)
    goals = _ends(graph, graph.name_of(goal), r_goal)
    starts = _starts(graph, start, r_start, state, goals, avoided)
    network = Network(graph)

    def found() -> tuple[Problem, list[Path]]:
        problem = Problem(
            order=_order(network),
            arcs=network.arcs(wanted),
            starts=tuple(n for n in _nodes(network, starts) if state is None or _may_enter(network, n, state)),
            goals=frozenset(_nodes(network, goals)),
            via=through,
            avoid=avoided,
            max_switches=max_switches,
            bottleneck=wanted.bottleneck,
        )
        return problem, best_paths(problem, k)

    if graph.regions:
        proposals, _ = _kept(graph)
        placed = [_placed(proposals, end, state) for end in starts]
        for end in [*placed, *goals]:
            if end.p is not None:
                network.propose(end.stop[0], end.p)
        proposals.along_routes(network, placed, goals, avoided, through)
    problem, paths = found()
    if not paths and graph.regions:
        proposals.everywhere(network)
        problem, paths = found()
    if not paths:
        raise unreachable(graph, problem, None if start is None else graph.name_of(start), graph.name_of(goal))
    question = Question(starts, goals, state, avoided, wanted)
    return [_plan(network, path, question) for path in paths]


_KEPT: WeakKeyDictionary[ModeGraph, tuple[Proposals, Relaxation]] = WeakKeyDictionary()


def _kept(graph: ModeGraph) -> tuple[Proposals, Relaxation]:
    """What was learnt of a graph in earlier questions."""
    if graph not in _KEPT:
        _KEPT[graph] = Proposals(graph), Relaxation(graph)
    return _KEPT[graph]


def _several(what: str, modes: Any) -> list[Any]:
    if isinstance(modes, str) or not hasattr(modes, "__iter__"):
        return [modes]
    return list(modes)


def _order(network: Network) -> dict[Node, tuple[int, int]]:
    position = {name: i for i, name in enumerate(network.graph.modes)}
    return {node: (position[node[0]], node[1]) for node in network.nodes()}


def _ends(graph: ModeGraph, name: str, r: Any) -> list[End]:
    """The references a plan may begin or end with, as the user gave them: one, a Box of them, or None for all."""
    if name not in graph.regions:
        if isinstance(r, Box):
            raise ModegraphError(f"plan: the references of {name!r} are a finite class; name one of them, not a Box")
        return [End((name, a)) for a in graph.indices(name, r)]
    if not isinstance(r, Box):
        return [End((name, 0), None if r is None else graph.find(name, r))]
    region = graph.regions[name]
    if r.dim != region.dim:
        raise ModegraphError(f"plan: a Box of references of {name!r} has {region.dim} parameters, not {r.dim}")
    lo, hi = np.maximum(r.lo, region.lo), np.minimum(r.hi, region.hi)
    if (lo > hi).any():
        raise ModegraphError(f"plan: no reference of {name!r} is in that Box; its class is {region}")
    return [End((name, 0), within=Box(lo, hi))]


def _starts(
    graph: ModeGraph, start: Any, r_start: Any, x0: Any, goals: Sequence[End], avoided: frozenset[str]
) -> list[End]:
    """Where a plan may begin: in the start mode, or with x0 in any that is not avoided."""
    if start is not None:
        name = graph.name_of(start)
        ends = _ends(graph, name, r_start)
        if isinstance(graph.modes[name], Target) and not {e.stop for e in ends} <= {e.stop for e in goals}:
            raise ModegraphError(f"plan: {name!r} is a target, no controller runs in it; start in a mode")
        return ends
    if r_start is not None:
        raise ModegraphError("plan: r_start needs a start mode")
    at_goal = {end.stop[0] for end in goals}
    return [
        end
        for name, mode in graph.modes.items()
        if name not in avoided and (name in at_goal or not isinstance(mode, Target))
        for end in _ends(graph, name, None)
    ]


def _placed(proposals: Proposals, end: End, x0: Any) -> End:
    """An end whose reference is open, with the one whose starts are centred nearest to x0."""
    if x0 is None or end.p is not None or end.stop[0] not in proposals.graph.regions:
        return end
    p = proposals.image(end.stop[0], x0)
    if p is None:
        return end
    return End(end.stop, p if end.within is None else np.clip(p, end.within.lo, end.within.hi), end.within)


def _nodes(network: Network, ends: Sequence[End]) -> list[Node]:
    """The nodes at which a plan may begin or end."""
    continuous = network.proposed
    found: list[Node] = []
    for end in ends:
        name = end.stop[0]
        if name not in continuous:
            found.append(end.stop)
        else:
            found += [(name, k) for k, p in enumerate(continuous[name]) if end.allows(p)]
    return found


def _may_enter(network: Network, node: Node, x0: Any) -> bool:
    return may_enter(network.graph.modes[node[0]], network.parameter(node), x0)


def _plan(network: Network, path: Path, question: Question) -> Plan:
    nodes = [state[0] for state in path.states]
    return Plan.of(
        network.graph,
        [(name, network.parameter((name, a))) for name, a in nodes],
        objective=question.wanted,
        cost=path.key.cost,
        margin=path.margin,
        x0=question.state,
        bounded=lambda: _kept(network.graph)[1].bound(question),
    )
