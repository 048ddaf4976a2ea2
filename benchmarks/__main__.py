"""Print the figures: python -m benchmarks (or make bench); with words, the cases whose names hold one of them."""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Sequence

from benchmarks import measure, table
from benchmarks.cases import CASES
from benchmarks.figures import CLASSES, FIGURES, GOALS


def row(what: str, value: float, goal: tuple[float, str]) -> None:
    limit, unit = goal
    asked = f" goal {limit:g} {unit}" if math.isfinite(limit) else ""
    print(f"{what:44s} {value:9.2f} {unit:3s}{asked}{'' if value <= limit else '   over'}")


def builds() -> None:
    what = list(GOALS)
    row(what[0], measure.import_seconds(), GOALS[what[0]])
    cold = measure.build("two_link_arm", cold=True)
    warm = min((measure.build("two_link_arm") for _ in range(2)), key=lambda run: float(run["seconds"]))
    row(what[1], warm["seconds"], GOALS[what[1]])
    row(what[2], warm["megabytes"], GOALS[what[2]])
    row(what[3], cold["total"] - warm["total"], GOALS[what[3]])
    small = measure.build("point_mass")
    print(f"{'build point_mass.py, kernels compiled':44s} {small['seconds']:9.2f} s")
    for name, run in (("two_link_arm", warm), ("point_mass", small)):
        pairs, checks = Counter(run["statuses"]), Counter(run["checks"])
        print(f"    {name}: pairs {dict(pairs)}, checks {dict(checks)}")
    print()


def questions() -> None:
    """Plans for fresh references and look-ups in R^ij, with the graph in memory."""
    nothing = float("inf")
    for example, goals in CLASSES.items():
        seen = measure.queries(example)
        row(f"{example}: build", seen["build"], (goals.get("build", nothing), "s"))
        for minimize in ("switches", "time"):
            median, worst = (1e3 * seen[minimize][what] for what in ("median", "worst"))
            row(f"{example}: plan, {minimize}, median", median, (goals.get("plan", nothing), "ms"))
            print(f"    worst {worst:.2f} ms, {seen[minimize]['unreachable']} without a plan")
        row(f"{example}: contains, median", 1e6 * seen["contains"], (goals.get("contains", nothing), "us"))
    print()


def flowpipes(words: Sequence[str]) -> None:
    print(table.HEADER)
    for case in CASES:
        if not words or any(word in case.name for word in words):
            print(table.row(case.name, FIGURES[case.name], measure.figures(case.name)), flush=True)


if __name__ == "__main__":
    if len(sys.argv) == 1:
        builds()
        questions()
    flowpipes(sys.argv[1:])
