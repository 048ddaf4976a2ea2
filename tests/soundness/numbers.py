"""``python -m tests.soundness.numbers NAME [CORES]``: every number of a graph, exactly, built on so many cores.

NAME is an example, or ``population K`` as one word, ``population-K``: the mode and targets of that seed.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import Any

import numpy as np


def exact(value: Any) -> Any:
    """Floats as hexadecimal text, arrays as lists, the rest as it is."""
    if isinstance(value, float):
        return value.hex()
    if isinstance(value, np.ndarray | list | tuple):
        return [exact(v) for v in np.asarray(value, object).ravel().tolist()]
    if isinstance(value, dict) or hasattr(value, "items"):
        return {str(k): exact(v) for k, v in value.items()}
    return value


def told(verdict: Any) -> list[Any]:
    """What a verdict says."""
    numbers = [verdict.time, verdict.margin, verdict.energy, verdict.window, dict(verdict.slack), verdict.until]
    witness = None if verdict.witness is None else [verdict.witness.x0, verdict.witness.time, verdict.witness.kind]
    return [verdict.status.name, verdict.reason, *(exact(n) for n in numbers), exact(witness)]


def graph_of(name: str) -> Any:
    """The graph of an example, or of one system of the population."""
    import modegraph as mg
    from tests.soundness.examples import load
    from tests.soundness.population import HORIZON, case

    if name.startswith("population-"):
        made = case(int(name.partition("-")[2]))
        return mg.build([made.mode, *made.targets], horizon=HORIZON)
    module = load(name)
    return mg.build(module.modes, horizon=getattr(module, "horizon", None))


def numbers(name: str) -> dict[str, Any]:
    import modegraph as mg

    graph = graph_of(name)
    running = [i for i, mode in graph.modes.items() if not isinstance(mode, mg.Target)]
    out: dict[str, Any] = {f"check {i}": told(graph.check(i)) for i in running}
    for i in running:
        for j in graph.modes:
            try:
                out[f"{i} -> {j}"] = told(graph.verdict(i, j))
            except mg.ModegraphError:
                continue
    for switch in graph.switches:
        if not hasattr(switch.references, "relations"):
            continue
        out[f"R of {switch!r}"] = exact([v for pair in switch.references.sample(20, seed=1) for v in pair])
    return out


def elsewhere(name: str, cores: int, busy: bool = False) -> dict[str, Any]:
    """The numbers from a process of its own on the first ``cores`` cores; ``busy``: beside one that spins."""
    spin = subprocess.Popen([sys.executable, "-c", "while True: pass"]) if busy else None
    try:
        done = subprocess.run(
            [sys.executable, "-m", "tests.soundness.numbers", name, str(cores)], capture_output=True, text=True
        )
    finally:
        if spin is not None:
            spin.kill()
            spin.wait()
    assert done.returncode == 0, done.stderr[-2000:]
    found: dict[str, Any] = json.loads(done.stdout)
    return found


if __name__ == "__main__":
    if len(sys.argv) > 2:
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: int(sys.argv[2])])
    print(json.dumps(numbers(sys.argv[1])))
