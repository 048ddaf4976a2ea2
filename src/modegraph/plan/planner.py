"""A question in the user's words, turned into a search and back into plans."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from numbers import Integral
from typing import TYPE_CHECKING, Any

from modegraph.certify.verdict import Status
from modegraph.errors import ModegraphError
from modegraph.graph.entry import may_enter, plain_state
from modegraph.graph.modegraph import Node
from modegraph.model.target import Target
from modegraph.plan.candidates import propose
from modegraph.plan.objectives import Objective, latest, objective
from modegraph.plan.plan import Plan
from modegraph.plan.search import Arc, Path, Problem, best_paths
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
    wanted = objective(minimize)
    avoided = frozenset(graph.name_of(m) for m in _several("avoid", avoid))
    goal_name = graph.name_of(goal)
    goals = frozenset((goal_name, b) for b in graph.indices(goal_name, r_goal))
    state = None if x0 is None else plain_state(x0, graph.dimension)
    if graph.regions:
        propose(graph, None if start is None else graph.name_of(start), goal_name, r_start, r_goal, state)
        goals = frozenset((goal_name, b) for b in graph.indices(goal_name, r_goal))
    problem = Problem(
        order=_order(graph),
        arcs=_arcs(graph, wanted),
        starts=_starts(graph, start, r_start, state, goals, avoided),
        goals=goals,
        via=tuple(graph.name_of(m) for m in _several("via", via)),
        avoid=avoided,
        max_switches=max_switches,
        bottleneck=wanted.bottleneck,
    )
    paths = best_paths(problem, k)
    if not paths:
        raise unreachable(graph, problem, None if start is None else graph.name_of(start), goal_name)
    return [_plan(graph, path, wanted, state) for path in paths]


def _several(what: str, modes: Any) -> list[Any]:
    if isinstance(modes, str) or not hasattr(modes, "__iter__"):
        return [modes]
    return list(modes)


def _order(graph: ModeGraph) -> dict[Node, tuple[int, int]]:
    position = {name: i for i, name in enumerate(graph.modes)}
    return {node: (position[node[0]], node[1]) for node in graph.nodes()}


def _arcs(graph: ModeGraph, wanted: Objective) -> dict[Node, list[Arc]]:
    arcs: dict[Node, list[Arc]] = {}
    for (source, target), v in graph.pair_verdicts().items():
        if v.status is Status.CERTIFIED:
            margin = 0.0 if v.margin is None else v.margin
            cost = wanted.cost(v, graph.parameter(source), graph.parameter(target))
            arc = Arc(source, target, cost, Fraction(latest(v)), margin)
            arcs.setdefault(source, []).append(arc)
    return arcs


def _starts(
    graph: ModeGraph,
    start: Any,
    r_start: Any,
    x0: Any,
    goals: frozenset[Node],
    avoided: frozenset[str],
) -> tuple[Node, ...]:
    """Nodes a plan may begin in: the start mode's references, or those whose start set holds x0."""
    if start is not None:
        name = graph.name_of(start)
        nodes = [(name, a) for a in graph.indices(name, r_start)]
        if isinstance(graph.modes[name], Target) and not goals.issuperset(nodes):
            raise ModegraphError(f"plan: {name!r} is a target, no controller runs in it; start in a mode")
    else:
        if r_start is not None:
            raise ModegraphError("plan: r_start needs a start mode")
        nodes = [
            node
            for node in graph.nodes()
            if node[0] not in avoided and (node in goals or not isinstance(graph.modes[node[0]], Target))
        ]
    if x0 is None:
        return tuple(nodes)
    return tuple(node for node in nodes if may_enter(graph.modes[node[0]], graph.parameter(node), x0))


def _plan(graph: ModeGraph, path: Path, wanted: Objective, x0: Any) -> Plan:
    return Plan.of(
        graph,
        [state[0] for state in path.states],
        objective=wanted,
        cost=path.key.cost,
        margin=path.margin,
        x0=x0,
    )
