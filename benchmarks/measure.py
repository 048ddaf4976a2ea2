"""Timings in processes of their own, so that caches and peak memory are what they seem."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import modegraph as mg

ROOT = Path(__file__).parents[1]

BUILD = """
import json, resource, runpy, sys, time
import modegraph as mg
model = runpy.run_path(sys.argv[1])
begin = time.perf_counter()
graph = mg.build(model["modes"], horizon=model["horizon"])
seconds = time.perf_counter() - begin
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1024 if sys.platform != "darwin" else 1)
names = list(graph.modes)
statuses = [graph.verdict(i, j).status.value for i in names for j in names if i != j]
checks = [graph.check(i).status.value for i in names]
print(json.dumps({"seconds": seconds, "megabytes": peak / 1e6, "statuses": statuses, "checks": checks}))
"""


def build(example: str, *, cold: bool = False) -> dict[str, Any]:
    """Build an example in a new process; ``cold`` compiles every kernel anew. Wall time is "total"."""
    with tempfile.TemporaryDirectory() as fresh:
        environment = dict(os.environ)
        if cold:
            environment["NUMBA_CACHE_DIR"] = fresh
        begin = time.perf_counter()
        done = subprocess.run(
            [sys.executable, "-c", BUILD, str(ROOT / "examples" / f"{example}.py")],
            capture_output=True,
            text=True,
            env=environment,
            check=False,
        )
        total = time.perf_counter() - begin
    if done.returncode:
        raise RuntimeError(f"building {example} failed:\n{done.stderr}")
    return {**json.loads(done.stdout.splitlines()[-1]), "total": total}


def import_seconds() -> float:
    """Best of five, without the start of Python itself."""
    code = "import time; t = time.perf_counter(); import modegraph; print(time.perf_counter() - t)"
    runs = [subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True) for _ in range(5)]
    return min(float(run.stdout) for run in runs)


@dataclass(frozen=True)
class PipeFigure:
    """Time and end width of one flowpipe."""

    seconds: float
    widths: tuple[float, ...]
    steps: int
    complete: bool
    reason: str


def flowpipe(mode: mg.Mode, until: float, states: tuple[str, ...]) -> PipeFigure:
    """The faster of two runs (the first one may load kernels); widths of ``states`` at ``until``."""
    best, pipe = float("inf"), None
    for _ in range(2):
        begin = time.perf_counter()
        pipe = mg.flowpipe(mode, horizon=until)
        best = min(best, time.perf_counter() - begin)
    assert pipe is not None
    if not pipe.complete:
        return PipeFigure(best, tuple(float("nan") for _ in states), len(pipe.times), False, pipe.reason)
    begin = time.perf_counter()
    box = pipe.at(until)
    best += time.perf_counter() - begin
    index = [mode.system.states.index(name) for name in states]
    return PipeFigure(best, tuple(float(box.hi[k] - box.lo[k]) for k in index), len(pipe.times), True, "")
