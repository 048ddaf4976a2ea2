"""The graph of certified switches and the questions it answers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from modegraph.attach import with_methods
from modegraph.certify.continuous import ContinuousReferences
from modegraph.certify.references import Cell, Parameter, References
from modegraph.certify.verdict import Status, Verdict
from modegraph.errors import ModegraphError, NotBuiltYet
from modegraph.graph.aggregate import Case, deciding_pair, every_member, some_pair
from modegraph.graph.classes import Classes, Floats, Link
from modegraph.graph.entry import may_enter, plain_state
from modegraph.graph.submodes import Edge, Submode, algorithm_1
from modegraph.graph.switch import Switch
from modegraph.model.mode import Mode
from modegraph.model.target import Target

if TYPE_CHECKING:
    from modegraph import api

Node = tuple[str, int]
"""A mode and the position of one reference in its class (0 for a Target)."""


@with_methods
class ModeGraph:
    """Which modes can be chained, with proofs. Made by ``modegraph.build``.

    Attributes
    ----------
    modes : mapping of str to Mode or Target
        In the order given to ``build``.
    switches : tuple[Switch, ...]
        Certified switches only, in mode order.
    submodes : tuple[Submode, ...]
        The nodes of Algorithm 1.
    edges : tuple[Edge, ...]
        Its edges, of both kinds.
    horizon : float or None
        Seconds, as given to ``build``.
    """

    if TYPE_CHECKING:  # from upper layers
        plan = api.plan
        plans = api.plans
        explain = api.explain
        plot = api.plot_graph
        save = api.save_graph
        load = classmethod(api.load_graph)

    def __init__(
        self,
        modes: Sequence[Mode | Target],
        verdicts: Mapping[tuple[Node, Node], Verdict],
        checks: Mapping[Node, Verdict],
        classes: Classes | None = None,
        horizon: float | None = None,
    ) -> None:
        """Collect the verdicts of all ordered pairs of nodes and the check of every node.

        A continuous class is one node, (name, 0), in ``checks`` and in the links of ``classes``. ``horizon``:
        of the modes without one of their own.
        """
        self.horizon = horizon
        self._modes = {m.name: m for m in modes}
        self._verdicts = dict(verdicts)
        self._checks = dict(checks)
        self._classes = classes or Classes({}, {})
        self._parameters: dict[str, Sequence[Parameter]] = {
            m.name: (None,)
            if isinstance(m, Target) or m.name in self._classes.regions
            else tuple(m.reference.parameters())
            for m in modes
        }

    @property
    def modes(self) -> Mapping[str, Mode | Target]:
        return MappingProxyType(self._modes)

    @cached_property
    def switches(self) -> tuple[Switch, ...]:
        found = (self._switch(i, j) for i in self._modes for j in self._modes)
        return tuple(s for s in found if s is not None)

    @property
    def submodes(self) -> tuple[Submode, ...]:
        return self._algorithm_1[0]

    @property
    def edges(self) -> tuple[Edge, ...]:
        return self._algorithm_1[1]

    def verdict(self, i: str | Mode, j: str | Mode | Target, r_i: Any = None, r_j: Any = None) -> Verdict:
        """Whether mode ``i`` can be followed by ``j``: the answer to condition (C).

        Without references the answer is existential over the classes: certified if some pair is,
        refuted if every pair is. With one reference given, existential over the other. The pair of
        a reference with itself (i = j) is trivial and left out.

        Raises
        ------
        ModegraphError
            For an unknown mode or reference, a Target as source, or when no pair is left.
        """
        source, target = self.name_of(i), self.name_of(j)
        if self._classes.involves(source, target):
            return self._class_verdict(source, target, r_i, r_j)
        return some_pair(self._cases(source, target, r_i, r_j))

    def _class_verdict(self, i: str, j: str, r_i: Any, r_j: Any) -> Verdict:
        self._running(i, "no switch starts in it")
        left, right = (self._member(name, r) for name, r in ((i, r_i), (j, r_j)))
        if left is not None and right is not None:
            (a, p), (b, q) = left, right
            if i == j and (a == b if p is None or q is None else np.array_equal(p, q)):
                raise ModegraphError(f"mode {i!r}: a switch from a reference to itself means nothing")
            return self._classes.verdict((i, a), (j, b), p, q)
        known = [None if side is None else side[1] for side in (left, right)]
        return self._classes.existential(i, j, known[0], known[1], self.references(i, j))

    def _member(self, name: str, r: Any) -> tuple[int, Parameter] | None:
        """Position and parameters of the reference r of a mode; None where that leaves several."""
        if r is None and self.has_choice(name):
            return None
        if name in self._classes.regions:
            return 0, self.find(name, r)
        index = self.indices(name, r)[0]
        return index, self._parameters[name][index]

    def find(self, name: str, r: Any) -> Floats:
        """The parameters of a reference of a continuous class; an error names the mode and what exists."""
        mode = self._modes[name]
        assert isinstance(mode, Mode)
        p = mode.find(r)
        assert p is not None
        return p

    def references(self, i: str, j: str) -> ContinuousReferences:
        """R^ij where one of the classes is continuous."""
        return self._classes.references(i, j, self._parameters)

    @property
    def regions(self) -> Mapping[str, Any]:
        """The continuous classes: a Box of parameters for each mode that has one."""
        return self._classes.regions

    def check(self, i: str | Mode, r: Any = None) -> Verdict:
        """Whether the constraints of mode ``i`` hold for all time, for its whole class of references.

        Parameters
        ----------
        i : str or Mode
        r : reference, optional
            Only for this member of the class.

        Raises
        ------
        ModegraphError
            For an unknown mode or reference, or a Target, in which no controller runs.
        """
        name = self._running(self.name_of(i), "there is nothing to check in it")
        if name in self._classes.regions:
            if r is not None:
                self.find(name, r)
            return self._checks[name, 0]
        return every_member([(self._parameters[name][a], self._checks[name, a]) for a in self.indices(name, r)])

    def deciding(self, i: str, j: str, r_i: Any, r_j: Any) -> Case | None:
        """The pair of references that the verdict on i -> j speaks of; None where there is none."""
        if not self._classes.involves(i, j):
            return deciding_pair(self._cases(i, j, r_i, r_j))
        left, right = (self._member(name, r) for name, r in ((i, r_i), (j, r_j)))
        best = self.references(i, j).best(*(None if side is None else side[1] for side in (left, right)))
        if best is None:
            return None
        sides = [
            p if name in self._classes.regions else self._parameters[name][a]
            for name, a, p in zip((i, j), best[0], best[1:3], strict=True)
        ]
        return sides[0], sides[1], self._class_verdict(i, j, r_i, r_j)

    def modes_at(self, x: Any) -> list[tuple[str, References | ContinuousReferences]]:
        """The modes and targets that may be entered from the state ``x`` (n,) now.

        The References of each hold pairs ``(None, r_j)``: ``.target`` lists the references.
        """
        state = plain_state(x, self.dimension)
        found: list[tuple[str, References | ContinuousReferences]] = []
        for name, mode in self._modes.items():
            if name in self._classes.regions:
                refs = self._classes.entered(name, mode, state)
                if refs is not None:
                    found.append((name, refs))
                continue
            parameters = self._parameters[name]
            inside = [b for b, p in enumerate(parameters) if may_enter(mode, p, state)]
            if inside:
                found.append((name, References([None], parameters, [(0, b) for b in inside])))
        return found

    def to_networkx(self) -> Any:
        """Algorithm 1's graph as a ``networkx.DiGraph``.

        Nodes are Submodes with attributes ``mode, role, source, target``; edges have ``kind``
        ("switch" or "stay") and ``switches, earliest, latest, energy, margin`` (zero for "stay").
        """
        try:
            import networkx
        except ImportError as error:
            raise ModegraphError("to_networkx needs networkx: pip install networkx") from error
        graph = networkx.DiGraph()
        for s in self.submodes:
            graph.add_node(s, mode=s.mode, role=s.role, source=s.source, target=s.target)
        for edge in self.edges:
            v = edge.verdict
            earliest, latest = (0.0, 0.0) if v is None or v.time is None else v.time
            graph.add_edge(
                edge.source,
                edge.target,
                kind=edge.kind,
                switches=0 if v is None else 1,
                earliest=earliest,
                latest=latest,
                energy=0.0 if v is None else v.energy,
                margin=None if v is None else v.margin,
            )
        return graph

    def add(self, mode: Mode | Target) -> NoReturn:
        raise NotBuiltYet("adding a mode to a graph is not built yet: call build again with all modes")

    def replace(self, mode: Mode | Target) -> NoReturn:
        raise NotBuiltYet("replacing a mode of a graph is not built yet: call build again with all modes")

    def remove(self, name: str) -> NoReturn:
        raise NotBuiltYet("removing a mode from a graph is not built yet: call build again without it")

    def __repr__(self) -> str:
        return f"ModeGraph({len(self._modes)} modes, {len(self.switches)} certified switches)"

    @property
    def dimension(self) -> int:
        """Number of plant states, the same for all modes."""
        for mode in self._modes.values():
            return mode.set.dim if isinstance(mode, Target) else mode.system.n
        raise ModegraphError("the graph has no modes")

    def name_of(self, mode: Any) -> str:
        """The name of a mode given by name or as the object, checked against this graph."""
        name = mode if isinstance(mode, str) else getattr(mode, "name", None)
        if not isinstance(name, str):
            raise ModegraphError(f"a mode is named by a str or a Mode, not by {type(mode).__name__}")
        if name not in self._modes:
            near = get_close_matches(name, self._modes, n=1, cutoff=0.4)
            hint = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(self._modes)}"
            raise ModegraphError(f"there is no mode {name!r} in the graph; {hint}")
        return name

    def indices(self, name: str, r: Any = None) -> list[int]:
        """Positions in the finite class of mode ``name`` that ``r`` names; all of them for None."""
        mode = self._modes[name]
        if r is None:
            return list(range(len(self._parameters[name])))
        if isinstance(mode, Target):
            raise ModegraphError(f"target {name!r} has no references, but {r!r} was given")
        return [mode.match(r)]

    def has_choice(self, name: str) -> bool:
        """Whether a mode has more than one reference."""
        return name in self._classes.regions or len(self._parameters[name]) > 1

    def parameter(self, node: Node) -> Parameter:
        """The reference of a node of a finite class."""
        return self._parameters[node[0]][node[1]]

    def nodes(self) -> list[Node]:
        """All nodes of finite classes, in mode order, then class order."""
        return [(n, a) for n, p in self._parameters.items() if n not in self.regions for a in range(len(p))]

    def pair_verdicts(self) -> Mapping[tuple[Node, Node], Verdict]:
        """The verdict of every ordered pair of different nodes of finite classes."""
        return MappingProxyType(self._verdicts)

    @property
    def links(self) -> Mapping[tuple[Node, Node], Link]:
        """What is known of every ordered pair of nodes with a continuous class, (name, 0), in it."""
        return self._classes.links

    def goal_check(self, name: str, p: Parameter) -> Verdict:
        """The check of one mode under one reference."""
        mode = self._modes[name]
        return self._checks[name, mode.match(p) if isinstance(mode, Mode) and name not in self.regions else 0]

    def pair_switch(self, i: str, j: str, p: Parameter, q: Parameter) -> Switch:
        """The certified switch for one pair of references, given by their parameters."""
        pair = References([p], [q], [(0, 0)])
        return _switch_of(i, j, pair, self.verdict(i, j, p, q))

    @cached_property
    def _algorithm_1(self) -> tuple[tuple[Submode, ...], tuple[Edge, ...]]:
        def verdicts(switch: Switch, cell: Any) -> list[Case]:
            if not isinstance(cell, Cell):
                return [(None, None, self._class_verdict(switch.source, switch.target, None, None))]
            nodes = [((switch.source, a), (switch.target, b)) for a in cell.source_index for b in cell.target_index]
            return [(self.parameter(s), self.parameter(t), self._verdicts[s, t]) for s, t in nodes]

        submodes, edges = algorithm_1(self.switches, verdicts)
        return tuple(submodes), tuple(edges)

    def _switch(self, i: str, j: str) -> Switch | None:
        if isinstance(self._modes[i], Target):
            return None
        if self._classes.involves(i, j):
            some = self._class_verdict(i, j, None, None)
            # The figures of a switch hold for every pair: at the boundary of R^ij no margin is left.
            known = replace(some, margin=0.0)
            return _switch_of(i, j, self.references(i, j), known) if some.status is Status.CERTIFIED else None
        pairs: dict[tuple[int, int], Verdict] = {}
        undecided = 0
        for a in self.indices(i):
            for b in self.indices(j):
                v = self._verdicts.get(((i, a), (j, b)))
                if v is not None and v.status is Status.CERTIFIED:
                    pairs[a, b] = v
                elif v is not None and v.status is Status.UNDECIDED:
                    undecided += 1
        if not pairs:
            return None
        references = References(self._parameters[i], self._parameters[j], pairs, undecided)
        cases = [(self._parameters[i][a], self._parameters[j][b], v) for (a, b), v in pairs.items()]
        return _switch_of(i, j, references, some_pair(cases))

    def _running(self, name: str, consequence: str) -> str:
        if isinstance(self._modes[name], Target):
            raise ModegraphError(f"{name!r} is a target: it is entered and never left, {consequence}")
        return name

    def _cases(self, i: str, j: str, r_i: Any, r_j: Any) -> list[Case]:
        self._running(i, "no switch starts in it")
        cases = [
            (self._parameters[i][a], self._parameters[j][b], self._verdicts[(i, a), (j, b)])
            for a in self.indices(i, r_i)
            for b in self.indices(j, r_j)
            if (i, a) != (j, b)
        ]
        if not cases and len(self._parameters[i]) == 1:
            raise ModegraphError(f"mode {i!r} has a single reference: a switch to itself means nothing")
        if not cases:
            raise ModegraphError(f"mode {i!r}: a switch from a reference to itself means nothing")
        return cases


def _switch_of(i: str, j: str, references: References | ContinuousReferences, v: Verdict) -> Switch:
    if v.time is None:
        raise ValueError(f"the certified verdict {i} -> {j} has no time")
    return Switch(i, j, references, v.time, v.energy, v.margin, v.window)
