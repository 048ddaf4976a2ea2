"""One case in a process of its own: python -m benchmarks.one NAME prints its figures as lines of JSON."""

from __future__ import annotations

import itertools
import json
import sys
import time
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

import modegraph as mg
from benchmarks.case import Case
from benchmarks.cases import CASES
from benchmarks.figures import FIGURES, Figures
from benchmarks.spread import sampled_spread

Result = TypeVar("Result")
LONG = 10.0
"""A run that takes longer, in seconds, is not repeated."""


def timed(work: Callable[[], Result]) -> tuple[Result, float]:
    """The faster of two runs: the first one may load kernels."""
    best = float("inf")
    for _ in range(2):
        begin = time.perf_counter()
        result = work()
        best = min(best, time.perf_counter() - begin)
        if best > LONG:
            break
    return result, best


def proved(case: Case) -> dict[str, Any]:
    mode = case.mode()
    verdict, seconds = timed(lambda: mg.build([mode], horizon=case.until).check(mode.name))
    until = case.until if verdict.status is mg.Status.CERTIFIED else verdict.until or 0.0
    done = until >= case.until
    return {"seconds": seconds, "complete": done, "reason": "proved" if done else verdict.reason}


def enclosed(case: Case, figures: Figures) -> dict[str, Any]:
    mode = case.mode()

    def work() -> tuple[Any, Any]:
        pipe = mg.flowpipe(mode, horizon=case.until)
        return pipe, pipe.at(case.until) if pipe.complete else None

    (pipe, box), seconds = timed(work)
    row: dict[str, Any] = {
        "seconds": seconds, "complete": pipe.complete, "reason": "" if pipe.complete else pipe.reason,
        "steps": pipe.steps, "pieces": pipe.pieces,
    }  # fmt: skip
    if box is not None:
        index = [mode.system.states.index(name) for name in figures.states]
        row["widths"] = [float(box.hi[k] - box.lo[k]) for k in index]
        if figures.holds is not None:
            row["holds"] = figures.holds[1](pipe)
        if figures.own is not None:
            row["own"] = max(own_ratio(mode, pipe, p, case.until, index) for p in some_references(mode))
    return row


def some_references(mode: mg.Mode) -> list[np.ndarray]:
    """Corners, centre, and the middles between them, of a class of references."""
    region = mode.reference.region
    assert region is not None
    shares = itertools.product((0.0, 0.5, 1.0), repeat=region.dim)
    return [np.clip(region.lo + np.array(s) * (region.hi - region.lo), region.lo, region.hi) for s in shares]


def own_ratio(mode: mg.Mode, pipe: mg.Flowpipe, p: np.ndarray, until: float, index: list[int]) -> float:
    """How much wider the flowpipe of a class is at one reference than that one's own."""
    own, one = mg.flowpipe(mode, r=p, horizon=until).at(until), pipe.at(until, r=p)
    return float(((one.hi - one.lo) / (own.hi - own.lo))[index].max())


def report(name: str) -> None:
    case = next(case for case in CASES if case.name == name)
    figures = FIGURES[name]
    if case.mode().constraints is not None:
        print(json.dumps(proved(case)), flush=True)
        return
    row = enclosed(case, figures)
    print(json.dumps(row), flush=True)
    if "widths" in row and (case.start.hi > case.start.lo).any():
        spread = sampled_spread(case)
        states = case.mode().system.states
        print(json.dumps({"spread": [float(spread[states.index(s)]) for s in figures.states]}), flush=True)


if __name__ == "__main__":
    report(sys.argv[1])
