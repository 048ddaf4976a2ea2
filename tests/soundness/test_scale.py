"""Flowpipes of many random plants hold a thousand runs each, start by start and not only in their boxes.

A box around a set hides small errors: what is tested as well is that the run from the start xi is in the set
of that very xi, p(xi) + sum_g G_g(xi) zeta_g, whose size is often below 1e-9.
"""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.reach.compiled import compile_mode
from modegraph.reach.flow.flow import Flow, Order
from tests.soundness.batch import Runs, runs
from tests.soundness.plants import KINDS, PUSHES, UNTIL, Plant, plant

PLANTS = 240
BLOCK = 12
INSTANTS = 50
ORDERS = (Order(4, 3), Order(3, 2), Order(2, 1), Order(5, 3))


def same_start_escapes(made: Plant, count: int, rng: np.random.Generator) -> tuple[list[str], float]:
    """Runs outside the set of their own start, at the ends of steps and inside them; and how far was looked."""
    c = compile_mode(made.mode, None)
    order = ORDERS[made.seed % len(ORDERS)]
    flow = Flow(c.fields, c.whole(), c.w_centre, c.w_radius, order, names=c.loop.names)
    flow.run(UNTIL)
    while flow.steps and not np.isfinite(flow.steps[-1].G).all():
        flow.steps.pop()
    if not flow.steps:
        return [], 0.0
    until = flow.steps[-1].end
    ends = np.unique(np.append(rng.integers(len(flow.steps), size=INSTANTS // 2), len(flow.steps) - 1))
    inner = rng.integers(len(flow.steps), size=INSTANTS - len(ends))
    times = [flow.steps[k].end for k in ends]
    times += [flow.steps[k].start + rng.random() * (flow.steps[k].end - flow.steps[k].start) for k in inner]
    found = runs(made, count, until, np.array(times), rng)
    powers = np.prod(found.variables[:, None, :] ** flow.table.exponents.T[:, :, None], axis=0)
    escapes = []
    for i, k in enumerate(ends):
        escapes += _outside_the_set(flow, int(k), found, i, powers, rng)
    for i, k in enumerate(inner, start=len(ends)):
        escapes += _outside_the_tube(flow, int(k), found, i, powers)
    return escapes, until


def _outside_the_set(
    flow: Flow, k: int, found: Runs, i: int, powers: np.ndarray, rng: np.random.Generator
) -> list[str]:
    step = flow.steps[k]
    n, size = step.p.shape[0], step.G.shape[2]
    rest = found.x[i] - step.p @ powers
    rounding = 1e-15 * powers.shape[0] * np.abs(step.p).sum(axis=1)[:, None]
    directions = np.vstack([np.eye(n), rng.normal(size=(4, n))])
    room = np.zeros((len(directions), powers.shape[1]))
    for row, d in enumerate(directions):
        room[row] = np.abs(np.einsum("n,gnq->gq", d, step.G) @ powers[:size]).sum(axis=0)
    allowed = room * (1.0 + 1e-9) + np.abs(directions) @ (found.error[i] + rounding)
    return _report(np.abs(directions @ rest) - allowed, step.end)


def _outside_the_tube(flow: Flow, k: int, found: Runs, i: int, powers: np.ndarray) -> list[str]:
    step = flow.steps[k]
    share = (found.times[i] - step.start) / (step.end - step.start)
    p = (1.0 - share) * flow.set_at(k).p + share * step.p
    rounding = 1e-15 * powers.shape[0] * np.abs(p).sum(axis=1)[:, None]
    return _report(np.abs(found.x[i] - p @ powers) - flow.swell(step)[:, None] - found.error[i] - rounding, step.end)


def _report(over: np.ndarray, t: float) -> list[str]:
    row, run = np.unravel_index(int(np.argmax(over)), over.shape)
    if over[row, run] > 0.0:
        return [f"t = {t:.6g}: run {run} is {over[row, run]:.3g} outside in direction {row}"]
    return [f"t = {t:.6g}: no number"] if not np.isfinite(over).all() else []


def box_escapes(made: Plant, count: int, rng: np.random.Generator) -> tuple[list[str], float]:
    """Runs outside the boxes of the public flowpipe: pieces, restarts and coordinates of the modes included."""
    pipe: Any = mg.flowpipe(made.mode, horizon=UNTIL)
    if len(pipe.times) < 2:
        return [], 0.0
    until = float(pipe.times[-1])
    grid = rng.choice(pipe.times[1:], min(INSTANTS // 5, len(pipe.times) - 1), replace=False)
    times = np.concatenate([[0.0, until], grid, rng.uniform(0.0, until, INSTANTS - 2 - len(grid))])
    found = runs(made, count, until, times, rng)
    escapes = []
    for i, t in enumerate(times):
        box = pipe.at(float(t))
        over = np.maximum(box.lo[:, None] - found.x[i], found.x[i] - box.hi[:, None])
        escapes += _report(over - found.error[i], float(t))
    return escapes, until


def examine(seed: int, count: int) -> tuple[list[str], float, float]:
    """Escapes, and how far the one flow and the flowpipe reach."""
    made = plant(seed)
    rng = np.random.default_rng(seed)
    same, reached = same_start_escapes(made, count, rng)
    boxes, far = box_escapes(made, count, rng)
    return [f"{made.label}, {text}" for text in same + boxes], reached, far


@pytest.mark.parametrize("seed", [1, 8, 17, 24, 27, 79, 86, 130])
def test_quick(seed: int) -> None:
    escapes, reached, far = examine(seed, 40)
    assert not escapes
    assert max(reached, far) > 0.2


def test_the_plants_are_as_promised() -> None:
    made = [plant(seed) for seed in range(PLANTS)]
    assert len(made) >= 200
    assert {p.mode.start.dim for p in made} == {1, 2, 3, 4, 5, 6}
    assert min(Counter(p.kind for p in made)[kind] for kind in KINDS) >= 40
    disturbed = [p for p in made if p.mode.system.disturbance is not None]
    assert len(disturbed) >= 100
    assert min(Counter(p.push for p in disturbed).values()) >= 20
    assert len({p.push for p in disturbed}) == len(PUSHES)
    assert sum(p.unknown is not None for p in made) >= 20


def test_an_escape_is_seen() -> None:
    """A flow whose remainder is left out does not hold its runs."""
    made, rng = plant(8), np.random.default_rng(0)
    c = compile_mode(made.mode, None)
    flow = Flow(c.fields, c.whole(), c.w_centre, c.w_radius, Order(2, 1), names=c.loop.names)
    assert flow.run(0.5)
    found = runs(made, 40, 0.5, np.array([0.5]), rng)
    powers = np.prod(found.variables[:, None, :] ** flow.table.exponents.T[:, :, None], axis=0)
    assert not _outside_the_set(flow, len(flow.steps) - 1, found, 0, powers, rng)
    flow.steps[-1].G *= 1e-3
    assert _outside_the_set(flow, len(flow.steps) - 1, found, 0, powers, rng)


@pytest.mark.campaign
@pytest.mark.parametrize("block", range(PLANTS // BLOCK))
def test_campaign(block: int, record_property: Any) -> None:
    """1,000 runs of every plant, each looked at at 50 instants of the one flow and 50 of the flowpipe."""
    escapes, complete = [], 0
    for seed in range(block * BLOCK, (block + 1) * BLOCK):
        found, reached, far = examine(seed, 1000)
        escapes += found
        complete += max(reached, far) >= UNTIL
    record_property(
        "campaign",
        f"plants {block * BLOCK} to {(block + 1) * BLOCK - 1}: {complete} flowpipes complete, "
        f"{2000 * BLOCK} runs, {len(escapes)} escapes",
    )
    assert not escapes, "\n".join(escapes)
    assert complete >= BLOCK // 3
