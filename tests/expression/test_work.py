"""Work is counted, not timed: what comes out depends on the model alone."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modegraph.expression import Expr, Graph, TracedArray, compile_tape, simplify
from modegraph.expression import conditional as choices
from modegraph.expression.polynomials import Ring
from modegraph.expression.residual import residual
from modegraph.expression.work import TooBig, Work

ROOT = Path(__file__).parents[2]

PROGRAM = """
import hashlib, runpy, sys
import modegraph as mg
from modegraph.reach.compiled import compile_mode

digest = hashlib.sha256()
for mode in runpy.run_path(sys.argv[1])["modes"]:
    for field in compile_mode(mode, mode.reference.parameters()[0]).framed_fields:
        for tape in (field.rates, field.jacobian):
            digest.update(tape.ops.tobytes() + tape.const.tobytes() + tape.outputs.tobytes())
            digest.update(repr(tape.labels).encode())
print(digest.hexdigest())
"""


def loop(graph: Graph, links: int = 2) -> tuple[list[Expr], list[Expr]]:
    """An arm whose controller inverts its model, pushed by a force on the first joint."""
    x = TracedArray(graph.variables([f"x{k}" for k in range(2 * links)]))
    w = graph.variable("w")
    q, qd = x[:links], x[links:]
    far = range(links)
    inertia = np.array([[(links - max(i, j)) * np.cos(q[i] - q[j]) + (i == j) for j in far] for i in far])
    swing = np.array([sum((links - max(i, j)) * np.sin(q[i] - q[j]) * qd[j] ** 2 for j in far) for i in far])
    u = inertia @ (-4 * q - 3 * qd) + swing
    push = np.array([w, *[0.0] * (links - 1)])
    return [*qd, *np.linalg.solve(inertia, u - swing + push)], [*x, w]


def compiled(work: float = 1e6) -> tuple[Any, ...]:
    exprs, variables = loop(Graph())
    result = simplify(exprs, work=work)
    typical = np.random.default_rng(0).uniform(0.2, 1.0, (len(variables), 8))
    rates = residual(result.exprs, variables, typical, [], work=work)
    tape = compile_tape([*rates, *result.dropped, *result.guards], variables)
    return tape.ops.tolist(), tape.const.tolist(), tape.outputs.tolist(), tape.labels


def test_work_counts_until_nothing_is_left() -> None:
    work = Work(10.0)
    work.require(6.0)
    with pytest.raises(TooBig):
        work.require(5.0)
    assert (work.spent, work.left, work.over) == (6.0, 4.0, False), "what is refused is not counted"
    work.require(4.0)
    assert work.over
    work.add(3.0)
    assert (work.spent, work.left) == (13.0, 0.0)


def test_a_share_counts_twice_and_ends_with_the_whole() -> None:
    work = Work(10.0)
    share = work.share(0.6)
    share.require(5.0)
    assert (work.spent, share.left) == (5.0, 1.0)
    with pytest.raises(TooBig):
        share.require(2.0)
    work.add(4.5)
    assert share.left == 0.5
    assert work.share(0.5).left == 0.25


def test_without_work_the_expression_is_used_as_written() -> None:
    exprs, _ = loop(Graph())
    assert all(new.same(old) for new, old in zip(simplify(exprs, work=0.0).exprs, exprs, strict=True))


def test_more_work_simplifies_more() -> None:
    sizes = [len(compiled(work)[0]) for work in (0.0, 1e6)]
    assert sizes[1] < sizes[0]


@pytest.mark.parametrize("work", [300.0, 2e3, 1e6])
def test_slow_arithmetic_and_a_clock_that_jumps_change_nothing(work: float, monkeypatch: pytest.MonkeyPatch) -> None:
    quiet = compiled(work)
    clock, times = iter(range(0, 10**9, 1000)), Ring.times

    def slowly(ring: Ring, p: Any, q: Any) -> Any:
        time.sleep(2e-4)
        return times(ring, p, q)

    monkeypatch.setattr(Ring, "times", slowly)
    for name in ("monotonic", "perf_counter", "process_time", "time"):
        monkeypatch.setattr(time, name, lambda: float(next(clock)))
    busy = compiled(work)
    monkeypatch.undo()
    assert busy == quiet


def test_tapes_do_not_depend_on_the_order_of_sets() -> None:
    def digest(seed: str) -> str:
        environment = os.environ | {"PYTHONHASHSEED": seed}
        command = [sys.executable, "-c", PROGRAM, str(ROOT / "examples" / "two_link_arm.py")]
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout

    first = digest("1")
    assert len(first.strip()) == 64
    assert digest("2") == first


def test_a_choice_that_takes_too_much_work_stays_a_choice(monkeypatch: pytest.MonkeyPatch) -> None:
    # Wherever the work is used up, no error comes out of the function that is traced.
    joined = []
    for work in range(0, 900, 5):
        monkeypatch.setattr(choices, "WORK", float(work))
        x, y = Graph().variables("xy")
        text = np.where(x > y, (x**2 - y**2) / (1 + x**2 + y**2) + y, y).text(400)
        assert ("where(" in text) != ("maximum(" in text)
        joined.append("maximum(" in text)
    assert joined == sorted(joined)
    assert joined[0] != joined[-1]


def test_the_work_of_a_large_loop_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    x = TracedArray(Graph().variables([f"x{k}" for k in range(8)]))
    e = list(x)
    for k in range(150):
        e[k % 8] = np.sin(e[(k + 1) % 8]) * 0.9 + e[(k + 3) % 8] / (2 + e[(k + 5) % 8] ** 2)
    made: list[Work] = []
    begin = Work.__init__

    def remember(work: Work, limit: float, whole: Work | None = None) -> None:
        begin(work, limit, whole)
        made.append(work)

    monkeypatch.setattr(Work, "__init__", remember)
    spent = []
    for limit in (2e4, 1e5, 2e5):
        made.clear()
        simplify(e, work=limit)
        spent.append(made[0].spent)
    # Nodes are rebuilt in any case, and obligations kept: so much more than the limit, whatever that is.
    assert [s - limit < 6e4 for s, limit in zip(spent, (2e4, 1e5, 2e5), strict=True)] == [True] * 3
    assert spent == sorted(spent)
