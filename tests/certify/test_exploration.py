"""Parts of the starts: cut as far as it helps, the same whatever else runs, and one that breaks costs itself alone."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify import exploration as module
from modegraph.certify.decision import decide
from modegraph.certify.exploration import Exploration
from modegraph.certify.question import Goal, Question
from modegraph.certify.targets.region import Region
from modegraph.deadline import NEVER
from modegraph.reach.compiled import compile_mode


def test_starts_on_both_sides_of_a_limit_are_cut_until_they_are_proved() -> None:
    plant = mg.System(lambda x, u: np.array([x[1], u[0] - 0.3 * np.sin(x[0])]), states="position speed", inputs="force")
    wide = mg.Mode(
        "wide", plant, controller=lambda x, r: np.clip(-9.0 * (x[:1] - r) - 6.0 * x[1:], -1.5, 1.5),
        reference=mg.setpoint([0.0]), start=mg.Ball([0.0, 0.0], 0.4), constraints=lambda x: {"speed": abs(x[1]) <= 1.5},
    )  # fmt: skip
    check = mg.build([wide], horizon=8.0).check("wide")
    assert check.status is mg.Status.CERTIFIED, check.reason


def question() -> Question:
    """A pendulum whose wide starts have to be cut until they are inside the target at one instant each."""
    plant = mg.System(lambda x, u: np.array([x[1], -np.sin(x[0]) - 0.5 * x[1] + 0.0 * u[0]]), states=2, inputs=1)
    mode = mg.Mode(
        "m", plant, controller=lambda x: 0.0, reference=mg.setpoint([0.0]), start=mg.Box([0.2, -0.2], [2.4, 0.2])
    )  # fmt: skip
    return Question(compile_mode(mode, None), {0: Goal(Region(mg.Ball([0.0, 0.0], 0.35)), None)}, 12.0, NEVER)


def test_a_part_that_breaks_costs_its_own_answer_and_is_logged(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    asked = question()
    real: Any = Exploration._run

    def run(self: Exploration, piece: Any, *more: Any) -> Any:
        if piece.depth and piece.hi[0] == 1.0:
            raise IndexError("out of luck")
        return real(self, piece, *more)

    monkeypatch.setattr(Exploration, "_run", run)
    with caplog.at_level(logging.ERROR, "modegraph"):
        found = decide(asked, asked.compiled.whole(), [0], safety=True)
    assert 0 not in found.proofs
    assert 0 in found.missed
    assert "Traceback" in caplog.text
    assert "out of luck" in caplog.text


def test_the_parts_do_not_depend_on_which_core_is_quicker(monkeypatch: pytest.MonkeyPatch) -> None:
    """Children in order on one core, or the later ones first: the same parts, and the same numbers."""

    def runs(backwards: bool) -> Any:
        seen = []
        real: Any = Exploration._run

        def run(self: Exploration, piece: Any, *more: Any) -> Any:
            seen.append((*piece.lo.tolist(), *piece.hi.tolist()))
            return real(self, piece, *more)

        def in_order(tasks: Any) -> Any:
            return iter([task() for task in reversed(tasks)][::-1] if backwards else [task() for task in tasks])

        with monkeypatch.context() as m:
            m.setattr(Exploration, "_run", run)
            m.setattr(module, "in_parallel", in_order)
            asked = question()
            found = Exploration(asked, asked.autonomous).explore(asked.compiled.whole(), [0], True)
        proof = found.proofs.get(0)
        return set(seen), None if proof is None else (proof.earliest, proof.latest, proof.margin, proof.parts)

    assert runs(False) == runs(True)


def test_no_more_parts_than_are_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    asked, seen = question(), []
    real: Any = Exploration._run

    def run(self: Exploration, piece: Any, *more: Any) -> Any:
        seen.append(piece)
        return real(self, piece, *more)

    monkeypatch.setattr(Exploration, "_run", run)
    Exploration(asked, True).explore(asked.compiled.whole(), [0], True, allowance=5)
    assert 1 < len(seen) <= 5
