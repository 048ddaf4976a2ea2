"""Times of questions to a graph with continuous classes: python -m benchmarks.queries EXAMPLE prints them as JSON."""

from __future__ import annotations

import importlib.util
import json
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import modegraph as mg

EXAMPLES = Path(__file__).parents[1] / "examples"
ASKED = {"quadrotor": ("hover", "touchdown"), "arm_points": ("reach", "hold")}
"""The start and the goal of the plans asked for."""
QUESTIONS, LOOKS = 60, 4000


def load(name: str) -> Any:
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def seconds(ask: Callable[[], object]) -> float:
    begin = time.perf_counter()
    ask()
    return time.perf_counter() - begin


def plans(graph: mg.ModeGraph, start: str, goal: str, minimize: str) -> tuple[list[float], int]:
    """Seconds of plans for fresh references, and how many there are none for."""
    rng = np.random.default_rng(1)
    times, none = [], 0
    for k in range(QUESTIONS + 1):
        ends = [rng.uniform(graph.regions[name].lo, graph.regions[name].hi) for name in (start, goal)]
        begin = time.perf_counter()
        try:
            graph.plan(start, goal, r_start=ends[0], r_goal=ends[1], minimize=minimize)
        except mg.Unreachable:
            none += 1
        # The first question of a kind also finds the routes.
        times += [time.perf_counter() - begin] if k else []
    return times, none


def measure(name: str) -> dict[str, Any]:
    module = load(name)
    build: list[mg.ModeGraph] = []
    built = seconds(lambda: build.append(mg.build(module.modes, horizon=module.horizon)))
    graph = build[0]
    start, goal = ASKED[name]
    refs = graph.switches[0].references
    pairs = [(np.asarray(a), np.asarray(b)) for a, b in refs.sample(40, seed=1)]
    refs.contains(*pairs[0])
    looks = [seconds(lambda p=pair: refs.contains(*p)) for pair in pairs * (LOOKS // len(pairs))]
    found: dict[str, Any] = {
        "build": built,
        "contains": statistics.median(looks),
    }
    for minimize in ("switches", "time"):
        times, none = plans(graph, start, goal, minimize)
        found[minimize] = {"median": statistics.median(times), "worst": max(times), "unreachable": none}
    return found


if __name__ == "__main__":
    json.dump(measure(sys.argv[1]), sys.stdout)
