"""Algorithm 1: the consistent control mode graph, its submodes and edges (method, section 3)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

from modegraph.certify.references import Cell, Parameter
from modegraph.certify.verdict import Verdict
from modegraph.graph.aggregate import some_pair
from modegraph.graph.switch import Switch


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
    cell: Cell

    @property
    def references(self) -> tuple[Parameter, ...]:
        """The references ``mode`` may have in this submode."""
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


CellVerdicts = Callable[[Switch, Cell], Sequence[tuple[Parameter, Parameter, Verdict]]]


def algorithm_1(switches: Sequence[Switch], verdicts: CellVerdicts) -> tuple[list[Submode], list[Edge]]:
    """Submodes and edges for the certified switches.

    Where R^ij is no product, every product cell cut out of it gives submodes of its own, so no
    certified pair is lost. An entry leads to an exit of the same mode when their references meet.
    """
    submodes: list[Submode] = []
    edges: list[Edge] = []
    for switch in switches:
        i, j = switch.source, switch.target
        for cell in switch.references.cells:
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
                if set(submode.cell.target_index) & set(leaving.cell.source_index):
                    edges.append(Edge(submode, leaving, "stay"))
    return submodes, edges
