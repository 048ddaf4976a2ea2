"""Algorithm 1: the consistent control mode graph, its submodes and edges (method, section 3)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from modegraph.certify.continuous import ProductCell
from modegraph.certify.references import Cell, Parameter, match_parameter
from modegraph.certify.verdict import Verdict
from modegraph.graph.aggregate import some_pair
from modegraph.graph.switch import Switch
from modegraph.model.sets import Box


@dataclass(frozen=True)
class Submode:
    """A mode restricted to the references of one product cell of R^ij.

    Attributes
    ----------
    mode : str
        ``source`` for an exit, ``target`` for an entry.
    role : {"entry", "exit"}
    source, target : str
        The switch i -> j this submode belongs to.
    cell : Cell
        The certified product of references. With i = j the role tells exit from entry.
    """

    mode: str
    role: Literal["entry", "exit"]
    source: str
    target: str
    cell: Cell | ProductCell

    @property
    def references(self) -> tuple[Parameter, ...] | Box:
        """The references ``mode`` may have in this submode; a Box of a continuous class."""
        return self.cell.source if self.role == "exit" else self.cell.target

    def __str__(self) -> str:
        return f"{self.role}({self.source}->{self.target})"


@dataclass(frozen=True, eq=False)
class Edge:
    """An edge between submodes: ``switch`` (exit to entry) or ``stay`` (entry to exit, free).

    Attributes
    ----------
    source, target : Submode
    kind : {"switch", "stay"}
    verdict : Verdict or None
        For a switch, what is certified for every pair of the cell.
    """

    source: Submode
    target: Submode
    kind: Literal["switch", "stay"]
    verdict: Verdict | None = None


MOST_CELLS = 12
"""Products that are cut out of one continuous R^ij."""
CellVerdicts = Callable[[Switch, Cell | ProductCell], Sequence[tuple[Parameter, Parameter, Verdict]]]


def algorithm_1(switches: Sequence[Switch], verdicts: CellVerdicts) -> tuple[list[Submode], list[Edge]]:
    """Submodes and edges for the certified switches.

    Where R^ij is no product, every product cell cut out of it gives submodes of its own, so no
    certified pair is lost. An entry leads to an exit of the same mode when their references meet.
    """
    submodes: list[Submode] = []
    edges: list[Edge] = []
    for switch in switches:
        i, j = switch.source, switch.target
        for cell in switch.references.cells[:MOST_CELLS]:
            leaving = Submode(i, "exit", i, j, cell)
            entering = Submode(j, "entry", i, j, cell)
            submodes += [leaving, entering]
            edges.append(Edge(leaving, entering, "switch", some_pair(verdicts(switch, cell))))
    exits: dict[str, list[Submode]] = {}
    for submode in submodes:
        if submode.role == "exit":
            exits.setdefault(submode.mode, []).append(submode)
    for submode in submodes:
        if submode.role == "entry":
            for leaving in exits.get(submode.mode, []):
                if _meet(submode.cell, leaving.cell):
                    edges.append(Edge(submode, leaving, "stay"))
    return submodes, edges


def _meet(entering: Cell | ProductCell, leaving: Cell | ProductCell) -> bool:
    """Whether some reference of a mode is in both cells."""
    if isinstance(entering, Cell) and isinstance(leaving, Cell):
        return bool(set(entering.target_index) & set(leaving.source_index))
    a, b = entering.target, leaving.source
    if isinstance(a, Box) and isinstance(b, Box):
        return bool((np.maximum(a.lo, b.lo) <= np.minimum(a.hi, b.hi)).all())
    assert isinstance(a, tuple)
    assert isinstance(b, tuple)
    return any(match_parameter(a, p) is not None for p in b)
