"""Tables for the terminal, and the same answers as data."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from modegraph.certify.verdict import Status, Verdict
from modegraph.model.target import Target
from modegraph.plan.as_json import switch_data, verdict_data

if TYPE_CHECKING:
    from modegraph.explain.explanation import Explanation
    from modegraph.graph.modegraph import ModeGraph
    from modegraph.run.simulate import Run

_STYLE = {Status.CERTIFIED: "green", Status.REFUTED: "red", Status.UNDECIDED: "yellow"}
_NARROW = 120
"""Columns where the output is no terminal."""


def graph_data(graph: ModeGraph) -> dict[str, Any]:
    """Every verdict on a pair of modes, every check and the certified switches."""
    return {
        "modes": list(graph.modes),
        "verdicts": [{"source": i, "target": j, **verdict_data(v)} for i, j, v in _verdicts(graph)],
        "checks": {name: verdict_data(v) for name, v in _checks(graph).items()},
        "switches": [switch_data(s) for s in graph.switches],
    }


def explanation_data(e: Explanation) -> dict[str, Any]:
    """An explanation: the verdict, and what is known beside it. The changed modes of a repair are not data."""
    return {
        "source": e.source,
        "target": e.target,
        **verdict_data(e.verdict),
        "r_i": e.r_i,
        "r_j": e.r_j,
        "closest": None if e.closest is None else asdict(e.closest),
        "reach": None if e.reach is None else asdict(e.reach),
        "worst_start": e.worst_start,
        "worst_start_is": e.worst_start_is,
        "blocking": e.blocking,
        "missing": e.missing,
        "block": None if e.block is None else asdict(e.block),
        "repairs": [
            {"kind": r.kind, "value": r.value, "missed": r.missed, "text": r.text, "verdict": verdict_data(r.verdict)}
            for r in e.repairs
        ],
        "notes": list(e.notes),
        "text": e.text,
    }


def run_data(run: Run) -> dict[str, Any]:
    """The samples and the outcome of a run."""
    return {
        "t": run.t,
        "x": run.x,
        "u": run.u,
        "mode": run.mode,
        "r": run.r,
        "z": run.z,
        "switch_times": run.switch_times,
        "ok": run.ok,
        "message": run.message,
        "violations": [{"time": v.time, "mode": v.mode, "constraint": v.constraint} for v in run.violations],
        "states": run.states,
        "inputs": run.inputs,
    }


def print_graph(graph: ModeGraph) -> None:
    """One row for every ordered pair, then one for every check."""
    rows = _verdicts(graph)
    table = _table("from", "to", "answer", "time", "margin", "why")
    for i, j, v in rows:
        time = "" if v.time is None else f"{v.time[0]:.3g} .. {v.time[1]:.3g}"
        _add(table, v, i, j, time)
    console = _console()
    console.print(table)
    print_checks(_checks(graph))
    count = {s: sum(v.status is s for _, _, v in rows) for s in Status}
    console.print(", ".join(f"{count[s]} {s.value}" for s in Status) + f" of {len(rows)} pairs", markup=False)


def print_checks(checks: Mapping[str, Verdict]) -> None:
    """One row for every mode: do its constraints hold for all time."""
    table = _table("mode", "for all time", "margin", "why")
    for name, v in checks.items():
        _add(table, v, name)
    _console().print(table)


def print_run(run: Run) -> None:
    """When the switches happened and how the run ended."""
    console = _console()
    for instant, name in zip(run.switch_times, _entered(run), strict=False):
        console.print(f"  {instant:9.4f} s  enters {name}", markup=False, highlight=False)
    console.print(f"  {run.t[-1]:9.4f} s  {run.message}", markup=False, highlight=False)


def _entered(run: Run) -> list[str]:
    return [run.mode[k] for k in range(1, len(run.t)) if run.visit[k] != run.visit[k - 1]]


def _verdicts(graph: ModeGraph) -> list[tuple[str, str, Verdict]]:
    sources = [name for name, mode in graph.modes.items() if not isinstance(mode, Target)]
    return [(i, j, graph.verdict(i, j)) for i in sources for j in graph.modes if i != j or graph.has_choice(i)]


def _checks(graph: ModeGraph) -> dict[str, Verdict]:
    return {name: graph.check(name) for name, mode in graph.modes.items() if not isinstance(mode, Target)}


def _add(table: Any, v: Verdict, *first: str) -> None:
    """A row whose cells are literal text: reasons may contain square brackets."""
    from rich.text import Text

    labels, rest = (first[:2], first[2:]) if len(first) > 2 else (first, ())
    cells = [Text(c) for c in labels]
    cells.append(Text(v.status.value, style=_STYLE[v.status]))
    cells += [Text(c) for c in rest]
    cells.append(Text("" if v.margin is None else f"{v.margin:.3g}"))
    cells.append(Text(v.reason))
    table.add_row(*cells)


def _table(*columns: str) -> Any:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for column in columns:
        table.add_column(column, no_wrap=column != "why", overflow="fold")
    return table


def _console() -> Any:
    from rich.console import Console

    width = None if sys.stdout.isatty() else max(_NARROW, shutil.get_terminal_size((_NARROW, 24)).columns)
    return Console(width=width)
