"""Proof objects are complete or do not exist."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import modegraph
from modegraph.certify.proof import (
    SafetyProof,
    SwitchProof,
    certified_check,
    certified_switch,
    least_slack,
    safe_together,
    together,
)
from modegraph.certify.verdict import Status

SOURCE = Path(modegraph.__file__).parent


def switch(**changes: Any) -> SwitchProof:
    given = {
        "earliest": 0.5,
        "latest": 1.0,
        "margin": 0.1,
        "window": 0.2,
        "energy": 3.0,
        "slack": {"a": 0.0},
        "parts": 1,
    }
    return SwitchProof(**(given | changes))


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
        SafetyProof(slack, start, np.zeros(1))


def test_a_part_without_proof_leaves_the_whole_without() -> None:
    safe = SafetyProof({"a": 1.0}, 2.0, np.array([1.0, 5.0]))
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
            SafetyProof({"a": 1.0}, 2.0, np.array([1.0, 5.0])),
            SafetyProof({"a": 0.5}, 3.0, np.array([2.0, 4.0])),
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
    assert certified_check(SafetyProof({}, 0.0, np.array([np.inf]))).tracking is None


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
