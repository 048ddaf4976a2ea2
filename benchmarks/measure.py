"""Timings in processes of their own, so that caches and peak memory are what they seem."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
TIME_LIMIT = 60.0
"""Seconds for one case, its sampled spread included."""

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


def queries(example: str) -> dict[str, Any]:
    """What `benchmarks.queries` measures, in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.queries", example]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    if done.returncode:
        raise RuntimeError(f"asking {example} failed:\n{done.stderr}")
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def import_seconds() -> float:
    """Best of five, without the start of Python itself."""
    code = "import time; t = time.perf_counter(); import modegraph; print(time.perf_counter() - t)"
    runs = [subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True) for _ in range(5)]
    return min(float(run.stdout) for run in runs)


def figures(name: str, limit: float = TIME_LIMIT) -> dict[str, Any]:
    """What one case shows, in a new process that is ended after ``limit`` seconds; never an exception.

    Keys as `benchmarks.one` prints them; without "seconds" there is only a "reason".
    """
    command = [sys.executable, "-m", "benchmarks.one", name]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT) as process:
        try:
            out, err = process.communicate(timeout=limit)
            missing = err.strip().splitlines()[-1] if err.strip() else "nothing was printed"
        except subprocess.TimeoutExpired:
            process.kill()
            out, _ = process.communicate()
            missing = f"not done in {limit:g} s"
    row: dict[str, Any] = {}
    for line in out.splitlines():
        row.update(json.loads(line))
    if process.returncode:
        row["reason"] = "; ".join(text for text in (row.get("reason"), missing) if text)
    return row
