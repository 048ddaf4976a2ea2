"""Proof objects are complete or do not exist."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import modegraph
from modegraph.certify.lasting import LastingEvidence
from modegraph.certify.proof import (
    SafetyProof,
    SwitchProof,
    certified_check,
    certified_switch,
    safe_together,
    together,
)
from modegraph.certify.switching.base import Evidence, least_slack
from modegraph.certify.verdict import Status
from tests.certify.given import safety, switch

SOURCE = Path(modegraph.__file__).parent


@pytest.mark.parametrize(
    "changes",
    [
        {"earliest": -1e-9},
        {"earliest": 2.0},
        {"latest": np.inf},
        {"latest": np.nan},
        {"earliest": np.nan},
        {"margin": np.nan},
        {"window": np.nan},
        {"energy": np.nan},
        {"slack": {"a": -1e-300}},
        {"slack": {"a": np.nan}},
    ],
)
def test_an_incomplete_switch_raises(changes: dict[str, Any]) -> None:
    with pytest.raises(ValueError):
        switch(**changes)


@pytest.mark.parametrize("slack, start", [({"a": -1.0}, 0.0), ({"a": np.nan}, 0.0), ({}, np.inf), ({}, np.nan)])
def test_an_incomplete_check_raises(slack: dict[str, float], start: float) -> None:
    with pytest.raises(ValueError):
        safety(slack, start, np.zeros(1))


def test_a_part_without_proof_leaves_the_whole_without() -> None:
    safe = safety({"a": 1.0}, 2.0, np.array([1.0, 5.0]))
    assert together([]) is None
    assert safe_together([]) is None
    assert together([switch(), None]) is None
    assert safe_together([safe, None]) is None


def test_the_whole_is_as_good_as_its_worst_part() -> None:
    whole = together(
        [
            switch(),
            switch(earliest=0.2, latest=3.0, margin=0.05, window=0.1, energy=9.0, slack={"a": 1, "b": 2}),
        ]
    )
    assert whole is not None
    assert (whole.earliest, whole.latest, whole.margin, whole.window, whole.energy) == (
        0.2,
        3.0,
        0.05,
        0.1,
        9.0,
    )
    assert whole.slack == {"a": 0.0, "b": 2}
    assert whole.parts == 2
    safe = safe_together(
        [
            safety({"a": 1.0}, 2.0, np.array([1.0, 5.0])),
            safety({"a": 0.5}, 3.0, np.array([2.0, 4.0])),
        ]
    )
    assert safe is not None
    assert safe.slack == {"a": 0.5}
    assert safe.tail_start == 3.0
    assert safe.tracking.tolist() == [2.0, 5.0]
    assert least_slack([]) == {}


def test_verdicts_of_proofs() -> None:
    verdict = certified_switch(switch(), 4.0)
    assert verdict.status is Status.CERTIFIED
    assert verdict.time == (0.5, 1.0)
    assert verdict.horizon == 4.0
    assert "zero time" in certified_switch(switch(earliest=0.0, latest=0.0), None).reason
    assert certified_check(safety({}, 0.0, np.array([np.inf]))).tracking is None


@pytest.mark.parametrize("evidence", [(), (0.5, 1.0), ({"earliest": 0.0, "latest": 1.0},)])
def test_a_proof_is_made_of_evidence_and_nothing_else(evidence: Any) -> None:
    with pytest.raises(ValueError, match="without evidence"):
        SwitchProof(evidence)
    with pytest.raises(ValueError, match="without evidence"):
        SafetyProof(evidence)


def test_evidence_cannot_be_made_without_all_that_is_claimed() -> None:
    with pytest.raises(TypeError, match="abstract"):
        Evidence()  # type: ignore[abstract]
    with pytest.raises(TypeError, match="abstract"):
        LastingEvidence()  # type: ignore[abstract]


@pytest.mark.parametrize("folder", ["graph", "plan", "explain", "report", "run"])
def test_only_the_prover_makes_proofs(folder: str) -> None:
    """Nothing above certify/ makes evidence or a proof: it asks for verdicts."""
    made = {"SwitchProof", "SafetyProof", "certified_switch", "certified_check", "OfPair", "OfEveryPair"}
    for path in (SOURCE / folder).rglob("*.py"):
        names = {n.id for n in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(n, ast.Name)}
        assert not names & made, path


def test_certified_is_constructed_in_one_place() -> None:
    """``Status.CERTIFIED`` is only compared elsewhere, never handed to anything but that comparison."""
    for path in SOURCE.rglob("*.py"):
        if path.name in ("proof.py", "verdict.py") and path.parent.name == "certify":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not (
                isinstance(node, ast.Call) and getattr(node.func, "id", getattr(node.func, "attr", "")) == "Verdict"
            ):
                continue
            named = [node.args[0]] if node.args else [k.value for k in node.keywords if k.arg == "status"]
            text = " ".join(ast.unparse(part) for part in named)
            assert "CERTIFIED" not in text, f"{path}:{node.lineno}"
