"""Graphs with hand-made verdicts, so that planning can be tested without proofs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from modegraph.certify.reason import Outcome, Reason, Why
from modegraph.certify.verdict import Status, Verdict
from modegraph.graph.modegraph import ModeGraph, Node
from modegraph.model.mode import Mode
from modegraph.model.reference import Points, setpoint
from modegraph.model.sets import Box
from modegraph.model.system import System
from modegraph.model.target import Target


def because(text: str) -> Why:
    """A made-up reason."""
    return (Reason(Outcome.ENGINE_LIMIT, text=text),)


PLANT = System(lambda x, u: np.array([u[0]]), states="x", inputs="u")

REFUTED = Verdict(Status.REFUTED, because("it leaves X"))
UNDECIDED = Verdict(Status.UNDECIDED, because("the budget ended"), margin=-0.1)


def certified(
    latest: float = 1.0,
    *,
    earliest: float = 0.0,
    energy: float | None = 1.0,
    margin: float | None = 0.5,
    **more: Any,
) -> Verdict:
    return Verdict(Status.CERTIFIED, because("proved"), time=(earliest, latest), energy=energy, margin=margin, **more)


def mode(name: str, points: int = 1, radius: float = 0.5) -> Mode:
    """x' = r - x with starts within ``radius`` of r; the references are 0, 1, ..."""
    reference = setpoint([0.0]) if points == 1 else setpoint(Points([[float(k)] for k in range(points)]))
    return Mode(
        name,
        PLANT,
        controller=lambda x, r: r - x,
        reference=reference,
        start=lambda r: Box([r[0] - radius], [r[0] + radius]),
    )


def graph(
    modes: Sequence[str | Mode | Target],
    verdicts: Mapping[tuple[Any, Any], Verdict],
    checks: Mapping[Any, Verdict] | None = None,
) -> ModeGraph:
    """Pairs and checks may be given by name or by node (name, k); what is not given is refuted."""
    made = [mode(m) if isinstance(m, str) else m for m in modes]
    nodes: list[Node] = []
    for m in made:
        count = 1 if isinstance(m, Target) else len(m.reference.parameters())
        nodes += [(m.name, k) for k in range(count)]
    targets = {m.name for m in made if isinstance(m, Target)}
    table = {(a, b): REFUTED for a in nodes for b in nodes if a != b and a[0] not in targets}
    for (i, j), verdict in verdicts.items():
        pairs = [(a, b) for a in nodes for b in nodes if a != b and i in (a, a[0]) and j in (b, b[0])]
        table.update(dict.fromkeys(pairs, verdict))
    settled = Verdict(Status.CERTIFIED, because("for all time"))
    answers = {node: settled for node in nodes if node[0] not in targets}
    for key, verdict in (checks or {}).items():
        answers.update({node: verdict for node in answers if key in (node, node[0])})
    return ModeGraph(made, table, answers)
