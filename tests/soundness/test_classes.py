"""Flowpipes of continuous classes of references hold every run, and so does their restriction to one reference."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import modegraph as mg
from tests.soundness.families import FAMILIES, Family, references, runs

RUNS, EACH, SOME = 2500, 100, 5
"""Runs under as many references; runs under each of some references."""
TOLERANCE = 2e-9


def pipe_of(family: Family) -> mg.Flowpipe:
    pipe = mg.flowpipe(family.mode, horizon=family.until)
    assert pipe.complete, pipe.reason
    return pipe


def escape(box: mg.Box, x: np.ndarray) -> float:
    """The furthest that states (n, runs) are outside a box."""
    return float(np.maximum(box.lo[:, None] - x, x - box.hi[:, None]).max())


@pytest.mark.parametrize("name", FAMILIES)
def test_every_run_is_inside(name: str) -> None:
    family = FAMILIES[name]()
    pipe = pipe_of(family)
    rng = np.random.default_rng(11)
    cells = np.linspace(0.0, family.until, 9)
    times = np.unique([*cells[1:], *rng.uniform(0.0, family.until, 24)])
    x = runs(family, references(family, RUNS, rng), times, rng)
    for t, states in zip(times, x, strict=True):
        assert escape(pipe.at(t), states) <= TOLERANCE, f"t = {t}"
    for a, b in pairwise(cells):
        inside = (times >= a) & (times <= b)
        assert escape(pipe.hull(a, b), np.concatenate(x[inside], axis=1)) <= TOLERANCE


@pytest.mark.parametrize("name", FAMILIES)
def test_every_run_is_inside_its_own_reference(name: str) -> None:
    family = FAMILIES[name]()
    pipe = pipe_of(family)
    rng = np.random.default_rng(12)
    times = np.unique([*np.linspace(0.0, family.until, 5)[1:], *rng.uniform(0.0, family.until, 6)])
    for p in references(family, SOME, rng):
        x = runs(family, np.repeat(p[None], EACH, axis=0), times, rng)
        for t, states in zip(times, x, strict=True):
            assert escape(pipe.at(t, r=p), states) <= TOLERANCE, f"t = {t}, p = {p}"
        for a, b in pairwise((0.0, *times)):
            assert escape(pipe.hull(a, b, r=p), x[times == b][0]) <= TOLERANCE


@pytest.mark.parametrize("name", FAMILIES)
def test_one_reference_is_narrower_than_the_class(name: str) -> None:
    """... and nearly as narrow as its own flowpipe: the parameters are not lost on the way."""
    family = FAMILIES[name]()
    pipe = pipe_of(family)
    p = family.region.center
    own = mg.flowpipe(family.mode, r=p, horizon=family.until)
    for t in np.linspace(0.0, family.until, 4):
        box, alone, every = pipe.at(t, r=p), own.at(t), pipe.at(t)
        width = alone.hi - alone.lo
        assert (box.hi - box.lo <= 1.3 * width + 1e-3).all()
        assert (box.lo >= every.lo - 1e-9).all()
        assert (box.hi <= every.hi + 1e-9).all()


def test_runs_do_fill_the_restriction() -> None:
    """The check above would see a set that is too small by a tenth."""
    family = FAMILIES["pendulum"]()
    pipe = pipe_of(family)
    rng = np.random.default_rng(13)
    p = np.array([0.6])
    t = float(pipe.times[np.searchsorted(pipe.times, 0.5)])
    x = runs(family, np.repeat(p[None], 1500, axis=0), np.array([t]), rng)[0]
    box = pipe.at(t, r=p)
    assert (np.ptp(x, axis=1) > 0.9 * (box.hi - box.lo)).all()
