"""Exact cancellation of rational terms over transcendental atoms.

A computed-torque loop written the ordinary way, ``solve(M, M @ v + C @ qd - C @ qd)``, becomes ``v``. An
expression is replaced only where its tape gets cheaper, and every condition of being defined that goes
away with a cancelled term is handed back: a cancelled pole is still a pole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Literal

from modegraph.expression.graph import POSITIVE
from modegraph.expression.ops import CONST, COS, LEAVES, LOG, RECIP, SIN, VAR, WHERE
from modegraph.expression.rational import (
    RATIONAL,
    Field,
    Form,
    atoms_of,
    combine,
    cost,
    square_root_argument,
)  # fmt: skip
from modegraph.expression.scalar import Expr, Graph
from modegraph.expression.work import TooBig, Work

Kind = Literal["nonzero", "positive", "where"]

SMALL = 60
"""Polynomials of up to this many terms are always written out for comparison."""

WORK = 1e6
"""Work of one simplification, in the units of `Work`."""
EACH = 30.0
"""Work of a node that is rebuilt."""


@dataclass(frozen=True)
class Simplified:
    """Result of `simplify`.

    Attributes
    ----------
    exprs : list[Expr]
        Parallel to what was given; equal wherever the originals are defined.
    dropped : list[Expr]
        Denominators, logarithm arguments and where-conditions of the originals that no longer occur.
        The originals are defined only where all of them hold, so they stay proof obligations.
    kinds : list[str]
        Parallel to `dropped`: "nonzero" (a denominator), "positive" (a logarithm's argument) or "where"
        (a condition: the original is certainly continuous only where it does not change sign).
    guards : list[Expr]
        The reciprocals and logarithms themselves: a tape with these as further outputs is defined
        exactly where the originals are.
    """

    exprs: list[Expr]
    dropped: list[Expr] = field(default_factory=list)
    kinds: list[Kind] = field(default_factory=list)
    guards: list[Expr] = field(default_factory=list)


class Pass:
    """One bottom-up rewriting of all nodes.

    Attributes
    ----------
    forms : {node: Form or None}
        Rational functions of the atoms; None where that got too big.
    atom_nodes : {atom: node}
        What stands for each atom of ``field``.
    """

    def __init__(self, graph: Graph, order: list[int], *, reduce: bool, work: Work) -> None:
        self._graph = graph
        self.work = work
        self.field = Field(graph, atoms_of(graph, order), reduce=reduce, work=work)
        self.forms: dict[int, Form | None] = {}
        self._by_node: dict[int, Form] = {}
        self.atom_nodes: dict[int, int] = {k: k for k in self.field.atoms}
        self._current: dict[int, int] = {}
        self._settled: dict[int, int] = {}
        for index in order:
            work.add(EACH)
            if graph.nodes[index].op in RATIONAL:
                self._rational(index)
            else:
                self._atom(index)

    def _rational(self, index: int) -> None:
        node = self._graph.nodes[index]
        if node.op == CONST:
            self._current[index] = index
            self.forms[index] = self.field.constant(node.const)  # type: ignore[arg-type]
            return
        operands = [k for k in (node.a, node.b) if k >= 0]
        whole = all(self.forms[k] is not None for k in operands)
        pick = self._current.__getitem__ if whole else self.settle
        a, b = pick(node.a), pick(node.b) if node.b >= 0 else -1
        new = self._graph.remake(node, a, b, -1)
        if node.op == RECIP:
            self._keep_note(index, self._graph.coefficient(new)[0])
        form = combine(self.field, index, self.forms, new) if whole else None
        if whole and form is None:
            a, b = self.settle(node.a), self.settle(node.b) if node.b >= 0 else -1
            new = self._graph.remake(node, a, b, -1)
        self._current[index] = new
        self.forms[index] = form
        if form is not None:
            self.field.name(form, new)

    def _atom(self, index: int) -> None:
        graph = self._graph
        node = graph.nodes[index]
        if node.op == VAR:
            new = index
        else:
            a, b, c = (self.settle(k) if k >= 0 else -1 for k in (node.a, node.b, node.c))
            new = graph.remake(node, a, b, c)
            self._keep_note(index, new)
            if graph.origins.get(index, ("", ()))[0] == "sqrt":
                argument = square_root_argument(graph, new)
                if argument is not None:
                    graph.origins.setdefault(new, ("sqrt", (argument,)))
        self._current[index] = new
        value = graph.value(new)
        base, k = graph.coefficient(new)
        if value is not None:
            self.forms[index] = self.field.constant(value)
            return
        if base not in self._by_node:
            self.atom_nodes[index] = base
            self._by_node[base] = self.field.atom(index)
            self._relate(base)
        self.forms[index] = self.field.scale(self._by_node[base], k)

    def _keep_note(self, old: int, new: int) -> None:
        notes = self._graph.notes
        if old in notes and self._graph.nodes[old].op == self._graph.nodes[new].op:
            notes.setdefault(new, notes[old])

    def _relate(self, atom: int) -> None:
        """Tell the field what the square of a new atom is."""
        known = self._by_node
        op = self._graph.nodes[atom].op
        if op in (SIN, COS):
            sine, cosine = (atom, atom + 1) if op == SIN else (atom - 1, atom)
            if sine in known and cosine in known:
                self.field.relate(known[sine], Form(1 - known[cosine].numerator ** 2))
        argument = square_root_argument(self._graph, atom)
        if argument is None:
            return
        form = next((f for k, f in self.forms.items() if self._current[k] == argument), None)
        if form is not None:
            self.field.relate(known[atom], form)

    def settle(self, index: int) -> int:
        """The cheaper of the node rebuilt as it is and its form written out."""
        if index not in self._settled:
            self._settled[index] = self._cheaper(index)
        return self._settled[index]

    def _cheaper(self, index: int) -> int:
        current, form = self._current[index], self.forms[index]
        if form is None or self._graph.nodes[index].op in LEAVES or self.work.over:
            return current
        own = cost(self._graph, [current], self.work)
        if len(form.numerator) > max(SMALL, 3 * own):
            return current
        try:
            written = self.field.express(form, self.atom_nodes)
        except TooBig:
            return current
        return written if cost(self._graph, [written], self.work) < own else current


def simplify(exprs: Sequence[Expr], *, work: float = WORK) -> Simplified:
    """Cheaper expressions with the same values, and the obligations that were dropped on the way.

    Parameters
    ----------
    exprs : expressions of one graph
    work : after so much of it (units of `Work`) what was found is used and the rest stays as it is

    Raises `ModegraphError` where a denominator turns out to be identically zero.
    """
    if not exprs:
        return Simplified([])
    graph = exprs[0].graph
    budget = Work(work)
    roots = [e.index for e in exprs]
    forgotten = list(graph.dropped)
    order = graph.reachable(roots + forgotten)
    passes = []
    related = _has_relations(graph, order)
    for reduce in (False, True) if related else (False,):
        share = budget.share(0.6 if related and not reduce else 1.0)
        passes.append(Pass(graph, order, reduce=reduce, work=share))
    candidates = [roots] + [[p.settle(k) for k in roots] for p in passes]
    chosen = _cheapest(graph, candidates, budget)
    result = Simplified([Expr(graph, k) for k in chosen])
    _obligations(graph, order, passes, chosen, result, budget)
    del graph.dropped[len(forgotten) :]
    return result


def _has_relations(graph: Graph, order: list[int]) -> bool:
    present = set(order)
    for k in order:
        if graph.nodes[k].op == SIN and k + 1 in present:
            return True
        if square_root_argument(graph, k) is not None:
            return True
    return False


def _cheapest(graph: Graph, candidates: list[list[int]], work: Work) -> list[int]:
    """Choose a version of each root so that they are cheap together."""
    best = min(candidates, key=lambda roots: cost(graph, roots, work))
    value = cost(graph, best, work)
    for k, other in product(range(len(best)), candidates):
        if other[k] != best[k] and not work.over:
            trial = [*best[:k], other[k], *best[k + 1 :]]
            trial_value = cost(graph, trial, work)
            if trial_value < value:
                best, value = trial, trial_value
    return best


def _obligations(
    graph: Graph, order: list[int], passes: list[Pass], chosen: list[int], result: Simplified, work: Work
) -> None:
    """Fill in what the originals needed to be defined and the result does not mention."""
    kept = set(graph.reachable(chosen))
    seen: set[tuple[Kind, int]] = set()
    for index in order:
        node = graph.nodes[index]
        if node.op == WHERE:
            kind, argument = "where", node.c
        elif node.op in (RECIP, LOG):
            kind, argument = "nonzero" if node.op == RECIP else "positive", node.a
        else:
            continue
        versions = [argument, *(p.settle(argument) for p in passes)]
        _obligation(graph, index, kind, versions, kept, seen, result, work)  # type: ignore[arg-type]


def _obligation(
    graph: Graph,
    index: int,
    kind: Kind,
    versions: list[int],
    kept: set[int],
    seen: set[tuple[Kind, int]],
    result: Simplified,
    work: Work,
) -> None:
    if index in kept:
        return
    if kind == "where":
        argument = _shortest(graph, versions, work)
        if graph.value(argument) is None and (kind, argument) not in seen:
            seen.add((kind, argument))
            result.dropped.append(Expr(graph, argument))
            result.kinds.append(kind)
        return
    guards = {}
    for version in versions:
        if graph.signs[version] == POSITIVE:
            return
        note = graph.notes.get(index)
        guard = graph.coefficient(graph.recip(version, note))[0] if kind == "nonzero" else graph.log(version, note)
        if guard in kept or (kind, guard) in seen or graph.value(guard) is not None:
            return
        guards[version] = guard
    argument = _shortest(graph, list(guards), work)
    seen.add((kind, guards[argument]))
    result.dropped.append(Expr(graph, argument))
    result.kinds.append(kind)
    result.guards.append(Expr(graph, guards[argument]))


def _shortest(graph: Graph, versions: list[int], work: Work) -> int:
    """The version that costs least; the first, where no work is left to compare them."""
    return versions[0] if work.over else min(versions, key=lambda k: cost(graph, [k], work))
