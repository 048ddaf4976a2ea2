"""R^ij of a stable linear loop between balls around set-points: {|r_i - r_j| <= delta_j}, in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.continuous import ContinuousReferences
from tests.certify.class_graphs import double_integrators


@pytest.fixture(scope="module", params=[1, 2, 3])
def case(request: Any) -> tuple[int, ContinuousReferences]:
    dim = request.param
    graph = mg.build(double_integrators(dim), horizon=20.0)
    switch = next(s for s in graph.switches if (s.source, s.target) == ("wide", "narrow"))
    assert isinstance(switch.references, ContinuousReferences)
    return dim, switch.references


def near_the_boundary(dim: int, count: int, spread: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pairs of set-points in [-1, 1]^dim, and their distance about delta_j = .1."""
    rng = np.random.default_rng(dim)
    source = rng.uniform(-0.8, 0.8, (count, dim))
    way = rng.normal(size=(count, dim))
    way /= np.linalg.norm(way, axis=1)[:, None]
    target = source + way * (0.1 * (1.0 + rng.uniform(-spread, spread, (count, 1))))
    return source, target, np.linalg.norm(target - source, axis=1)


def test_no_certified_pair_lies_outside(case: tuple[int, ContinuousReferences]) -> None:
    dim, refs = case
    source, target, distance = near_the_boundary(dim, 100_000, 0.02)
    status = refs.statuses(source, target)
    assert not (status[distance > 0.1] == 1).any()
    assert not (status[distance < 0.1 * (1.0 - 1e-9)] == -1).any()


def test_nearly_every_pair_inside_is_certified_and_every_one_outside_refuted(
    case: tuple[int, ContinuousReferences],
) -> None:
    dim, refs = case
    source, target, distance = near_the_boundary(dim, 20_000, 0.02)
    status = refs.statuses(source, target)
    # The starts have shrunk to e^-20 of their size at the horizon.
    assert (status[distance < 0.1 * (1.0 - 1e-4)] == 1).all()
    assert (status[distance > 0.1 * (1.0 + 1e-4)] == -1).all()


def test_the_volume_is_that_of_the_closed_form(case: tuple[int, ContinuousReferences]) -> None:
    dim, refs = case
    rng = np.random.default_rng(9)
    source = rng.uniform(-1.0, 1.0, (400_000, dim))
    way = rng.normal(size=source.shape)
    way *= (0.1 * rng.uniform(size=(len(way), 1)) ** (1.0 / dim)) / np.linalg.norm(way, axis=1)[:, None]
    ball = {1: 0.2, 2: np.pi * 0.01, 3: 4.0 / 3.0 * np.pi * 1e-3}[dim]
    true = 2.0**dim * ball * float((np.abs(source + way) <= 1.0).all(axis=1).mean())
    lower, upper = refs.volume
    assert 0.97 * true <= lower <= 1.03 * true
    assert lower <= upper <= 1.05 * true
    if dim == 1:
        assert 0.99 * 0.39 <= lower <= 0.39 <= upper


def test_samples_are_certified_pairs_all_over_the_relation(case: tuple[int, ContinuousReferences]) -> None:
    _, refs = case
    pairs = refs.sample(200, seed=4)
    source = np.array([a for a, _ in pairs])
    target = np.array([b for _, b in pairs])
    assert (refs.statuses(source, target) == 1).all()
    assert all(pair in refs for pair in pairs[:10])
    assert (np.ptp(source, axis=0) > 1.0).all()
    assert np.linalg.norm(source - target, axis=1).max() > 0.07


def test_pairs_outside_the_classes_are_not_contained(case: tuple[int, ContinuousReferences]) -> None:
    dim, refs = case
    assert refs.contains([0.0] * dim, [0.0] * dim)
    assert not refs.contains([1.5] * dim, [1.5] * dim)
    assert not refs.contains([0.0] * (dim + 1), [0.0] * dim)
    assert not refs.contains(None, [0.0] * dim)
    assert not refs.decoupled
