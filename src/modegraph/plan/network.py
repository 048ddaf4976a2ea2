"""The references a search may use, and the certified switches between them."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from modegraph.certify.references import Parameter
from modegraph.certify.relation import Relation
from modegraph.certify.verdict import Status
from modegraph.plan.objectives import Objective, latest
from modegraph.plan.search import Arc

if TYPE_CHECKING:
    from modegraph.graph.modegraph import ModeGraph, Node

Floats = NDArray[np.float64]


class Network:
    """Nodes (mode, position): all members of the finite classes, and what is proposed of continuous ones.

    Floats propose, R^ij decides: two nodes are joined only where their pair of references is certified.
    """

    def __init__(self, graph: ModeGraph) -> None:
        self.graph = graph
        self.proposed: dict[str, list[Floats]] = {name: [] for name in graph.regions}
        self._known: dict[tuple[str, bytes], Node] = {}
        self._decided: dict[tuple[Node, Node], tuple[float, float, float]] = {}
        """Gauge, latest time and energy of the pairs that were looked at; a gauge above 1: not certified."""

    def propose(self, name: str, p: Floats) -> Node:
        """The node of a reference of a continuous class."""
        # -0.0 and 0.0 are one number.
        key = name, (p + 0.0).tobytes()
        if key not in self._known:
            self._known[key] = name, len(self.proposed[name])
            self.proposed[name].append(p)
        return self._known[key]

    def parameter(self, node: Node) -> Parameter:
        """The reference of a node."""
        return self.proposed[node[0]][node[1]] if node[0] in self.proposed else self.graph.parameter(node)

    def of(self, name: str) -> list[Node]:
        """The nodes of one mode."""
        if name in self.proposed:
            return [(name, k) for k in range(len(self.proposed[name]))]
        return [(name, k) for k in self.graph.indices(name)]

    def nodes(self) -> list[Node]:
        """All nodes in mode order."""
        return [node for name in self.graph.modes for node in self.of(name)]

    def connect(self, pairs: Iterable[tuple[Node, Node]]) -> None:
        """Decide pairs of nodes with a continuous class among them."""
        links: dict[tuple[Node, Node], list[tuple[Node, Node]]] = {}
        for pair in pairs:
            if pair in self._decided or pair[0] == pair[1]:
                continue
            self._decided[pair] = np.inf, np.inf, np.inf
            links.setdefault((self._link(pair[0]), self._link(pair[1])), []).append(pair)
        for key, some in links.items():
            link = self.graph.links.get(key)
            if link is None or not isinstance(link.relation, Relation):
                continue
            source, target = (self._rows([pair[side] for pair in some]) for side in (0, 1))
            found = link.relation.crossings(source, target)
            numbers = zip(found.gauge.tolist(), found.latest.tolist(), found.energy.tolist(), strict=True)
            self._decided.update(zip(some, numbers, strict=True))

    def certified(self, source: Node, target: Node) -> bool:
        """Whether a pair of nodes that was decided, or of finite classes, is certified."""
        if source[0] in self.proposed or target[0] in self.proposed:
            return self._decided.get((source, target), (np.inf,))[0] <= 1.0
        verdict = self.graph.pair_verdicts().get((source, target))
        return verdict is not None and verdict.status is Status.CERTIFIED

    def arcs(self, wanted: Objective) -> dict[Node, list[Arc]]:
        """The certified switches, with what they cost."""
        arcs: dict[Node, list[Arc]] = {}

        def add(source: Node, target: Node, time: float, energy: float | None, margin: float) -> None:
            cost = wanted.cost(time, energy, self.parameter(source), self.parameter(target))
            arcs.setdefault(source, []).append(Arc(source, target, cost, Fraction(time), margin))

        for (source, target), v in self.graph.pair_verdicts().items():
            if v.status is Status.CERTIFIED:
                add(source, target, latest(v), v.energy, 0.0 if v.margin is None else v.margin)
        for (source, target), (gauge, time, energy) in self._decided.items():
            if gauge <= 1.0:
                add(source, target, time, energy, 1.0 - gauge)
        return arcs

    def _link(self, node: Node) -> Node:
        """The name of a node in the links of the graph: a whole class is one."""
        return (node[0], 0) if node[0] in self.proposed else node

    def _rows(self, nodes: list[Node]) -> Floats:
        if nodes[0][0] not in self.proposed:
            return np.zeros((len(nodes), 0))
        return np.array([self.proposed[name][k] for name, k in nodes])
