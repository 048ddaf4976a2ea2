"""Answers of the library from another process: one that gives none in time can be ended there."""

from __future__ import annotations

import multiprocessing as mp
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Any

import modegraph as mg
from tests.soundness.parted import FAMILIES

BUDGET = 40.0
"""Seconds of work for one instance."""
PATIENCE = 5.0
"""Budgets after which an answer is given up: it never comes."""


@dataclass(frozen=True)
class Answers:
    """What the library says of one instance: {target name: verdict}, the check, {target name: (energy, window)}."""

    verdicts: dict[str, mg.Verdict]
    check: mg.Verdict
    figures: dict[str, tuple[float | None, float | None]]


class Answering:
    """A process that builds what it is asked for, one after another; a new one where the last was ended."""

    def __init__(self) -> None:
        self._process: mp.process.BaseProcess | None = None
        self._line: Connection | None = None

    def __enter__(self) -> Answering:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.end()

    def ask(self, family: str, seed: int) -> Answers | None:
        """The answers for one instance; None if they never come."""
        found = self.call(answers, family, seed)
        assert found is None or isinstance(found, Answers)
        return found

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """What a function of a module returns there; None if that is not known after ``PATIENCE`` budgets."""
        if self._process is None:
            context = mp.get_context("spawn")
            self._line, other = context.Pipe()
            self._process = context.Process(target=_serve, args=(other,), daemon=True)
            self._process.start()
            other.close()
            assert self._line.recv() is None  # it has begun: what it loads is not counted
        assert self._line is not None
        self._line.send((function, arguments))
        if not self._line.poll(PATIENCE * BUDGET):
            self.end()
            return None
        try:
            return self._line.recv()
        except EOFError:
            self.end()
            raise AssertionError(f"{function.__name__}{arguments}: the process ended, its output says why") from None

    def end(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._process = None


def _serve(line: Connection) -> None:
    line.send(None)
    while True:
        try:
            function, arguments = line.recv()
        except EOFError:
            return
        line.send(function(*arguments))


def answers(family: str, seed: int) -> Answers:
    instance = FAMILIES[family](seed)
    graph = mg.build([instance.mode, *instance.targets], horizon=instance.horizon, budget=BUDGET)
    figures = {switch.target: (switch.energy, switch.window) for switch in graph.switches}
    verdicts = {goal.name: graph.verdict(instance.mode.name, goal.name) for goal in instance.targets}
    return Answers(verdicts, graph.check(instance.mode.name), figures)
