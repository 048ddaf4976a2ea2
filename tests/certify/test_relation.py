"""R^ij of a stable linear loop between balls around set-points: {|r_i - r_j| <= delta_j}, in closed form."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.continuous import ContinuousReferences
from modegraph.certify.moments import at_state
from modegraph.certify.relation import Part, Relation, whole_relation
from modegraph.certify.targets.family import target_class
from tests.certify.class_graphs import double_integrators, one_integrator


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


def bent() -> mg.ModeGraph:
    """Neither the middle of the starts nor the centre of the target is affine in the reference; R^ij is known."""
    square = mg.Box([-1.0, -1.0], [1.0, 1.0])
    bend = lambda r: np.stack([r[0] + 0.3 * np.sin(2.0 * r[1]), r[1] + 0.2 * r[0] ** 2])
    first = one_integrator(bend, lambda r: mg.Box(bend(r) - 0.4, bend(r) + 0.4), square, "first")
    second = one_integrator(bend, lambda r: mg.Ball(bend(r), 0.3), square, "second")
    return mg.build([first, second], horizon=12.0)


def swung() -> mg.ModeGraph:
    """A pendulum held at any angle of a wide class: what is reached is curved in the reference."""
    plant = mg.System(lambda x, u: np.array([x[1], -np.sin(x[0]) + u[0]]), states="a b", inputs="u")
    modes = [
        mg.Mode(
            name, plant, controller=lambda x, r, kp=kp, kd=kd: -kp * (x[:1] - r) - kd * x[1:] + np.sin(r),
            reference=mg.setpoint(mg.Box([-2.0], [2.0])), start=lambda r, size=size: mg.Ball([r[0], 0.0], size),
        )
        for name, kp, kd, size in (("first", 3.0, 1.5, 0.5), ("second", 9.0, 5.0, 0.25))
    ]  # fmt: skip
    return mg.build(modes, horizon=5.0)


@pytest.mark.parametrize("make", [bent, swung])
def test_cells_of_what_is_curved_hold_only_what_they_say(make: Any) -> None:
    graph = make()
    for i, j in (("first", "second"), ("second", "first")):
        (relation,) = graph.references(i, j).relations.values()
        rng = np.random.default_rng(4)
        k = relation.source
        # Near the diagonal, where something is certified, and all over.
        centre = rng.uniform(-0.95, 0.95, (4000, k))
        near = np.clip(centre + rng.uniform(-0.6, 0.6, centre.shape), -0.95, 0.95)
        width = rng.uniform(0.0, 0.05, (4000, 1))
        lo, hi = (centre - width, near - width), (centre + width, near + width)
        yes, no = relation.cells(lo, hi)
        assert yes.sum() > 50
        assert no.sum() > 50
        for _ in range(8):
            source, target = (rng.uniform(a, b) for a, b in zip(lo, hi, strict=True))
            assert relation.certified(source, target)[yes].all()
            assert relation.refuted(source, target)[no].all()


def test_the_volume_of_what_is_curved_is_proved_by_cells() -> None:
    refs = swung().references("first", "second")
    lower, upper = refs.volume
    rng = np.random.default_rng(8)
    source, target = rng.uniform(-2.0, 2.0, (2, 40_000, 1))
    share = float((refs.statuses(source, target) == 1).mean()) * 16.0
    assert 0.9 * share <= lower <= 1.03 * share
    # A start rests at every reference: nothing farther than the radius .25 of the target can be certified.
    assert upper <= 1.04 * (16.0 - (4.0 - 0.25) ** 2)


def test_the_part_and_the_instant_that_decide_a_pair_are_those_told(case: tuple[int, ContinuousReferences]) -> None:
    """Shrinking all the way, a set from which r_j is too far is nearest at the end of the horizon."""
    dim, refs = case
    relation = refs.relations[0, 0]
    source, target = np.zeros((1, dim)), np.full((1, dim), 0.5)
    part, when = relation.worst(source, target)
    assert 0 <= part < len(relation.parts)
    assert when == pytest.approx(20.0)
    alone = Relation(relation.region, relation.goal, (relation.parts[part],), None)
    assert alone.crossings(source, target).gauge[0] == relation.crossings(source, target).gauge[0] > 1.0


INTERVAL = target_class(mg.Target("interval", mg.Box([-1.0], [1.0])), None, 1)


def reached(*looks: tuple[float, float]) -> Part:
    """A part that is at x after so many seconds, for looks (seconds, x)."""
    flows = [replace(at_state(np.array([x]), INTERVAL), times=np.array([t]), energy=np.array([t])) for t, x in looks]
    return Part(tuple(flows))


NONE = np.zeros((1, 0)), np.zeros((1, 0))
EARLY, LATE, NEVER_THERE = reached((1.0, 0.5)), reached((1.0, 5.0), (3.0, 0.5)), reached((1.0, 5.0), (3.0, 4.0))


@pytest.mark.parametrize("parts", [(EARLY, LATE), (LATE, EARLY)])
def test_all_parts_are_there_when_the_last_is(parts: tuple[Part, ...]) -> None:
    found = whole_relation(None, INTERVAL, parts, None).crossings(*NONE)
    assert found.certified[0]
    assert found.latest[0] == 3.0
    assert found.energy[0] == 3.0


@pytest.mark.parametrize(
    "parts", [(EARLY, None), (None, EARLY), (EARLY, NEVER_THERE), (NEVER_THERE, EARLY), (None, None), ()]
)
def test_one_part_that_is_not_there_is_enough_for_nothing(parts: tuple[Part | None, ...]) -> None:
    relation = whole_relation(None, INTERVAL, parts, None)
    assert not relation.certified(*NONE)[0]
    assert not relation.crossings(*NONE).certified[0]
