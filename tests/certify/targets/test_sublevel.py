"""Sublevel targets: containment by composition, separation by branch and bound; traps of non-convex sets."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.question import TargetSpec
from modegraph.certify.switching.common_time import Reach, find_crossings
from modegraph.certify.targets.sublevel import SublevelRegion, target_region
from modegraph.certify.unit import certify_unit
from modegraph.certify.verdict import Status, Verdict
from modegraph.deadline import Deadline
from modegraph.enclosure.monomials import monomials
from modegraph.model.sets import Set
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.compiled import compile_mode
from modegraph.reach.flow.flow import Flow, Order
from modegraph.reach.reach_set import ReachSet, ReachSets
from modegraph.reach.start.piece import whole

C, R, U = Status.CERTIFIED, Status.REFUTED, Status.UNDECIDED

FUNCTIONS: dict[str, tuple[Callable[..., Any], float]] = {
    "disc": (lambda x: x @ x, 1.0),
    "annulus": (lambda x: (x[0] ** 2 + x[1] ** 2 - 1) ** 2, 0.1),
    "lobes": (lambda x: np.minimum((x[0] - 1) ** 2, (x[0] + 1) ** 2) + x[1] ** 2, 0.5),
    "waves": (lambda x: np.sin(3 * x[0]) * np.cos(2 * x[1]), 0.2),
    "cut": (lambda x: np.maximum(np.exp(x[0]) - 2, np.abs(x[1]) - 0.7), 0.0),
    "norm": (lambda x: np.linalg.norm(x), 1.0),
    "pole": (lambda x: 1 / (x[0] + 2) + x[1] ** 2, 0.8),
}


def region_of(name: str) -> SublevelRegion:
    region = target_region(mg.Sublevel(*FUNCTIONS[name], dim=2))
    assert isinstance(region, SublevelRegion)
    return region


def gauge(region: SublevelRegion, start: Set, G: np.ndarray | None = None, lost: Any = None) -> float:
    piece = whole(start, [])
    table = monomials((1,) * piece.variables, 1)
    p, _, slack = piece.polynomials(table.linear, table.size)
    box = np.zeros((2, 2, 1))
    box[[0, 1], [0, 1], 0] = slack
    every = box if G is None else np.concatenate([box, G[:, :, None]])
    bounds = PolynomialBounds(piece, table, table.size)
    radius = np.zeros(2) if lost is None else np.array(lost)
    return region.gauge(ReachSet(bounds, p, every, radius))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_gauge_of_one_and_separation_are_proofs(name: str) -> None:
    region = region_of(name)
    rng = np.random.default_rng(3)
    proved = apart = 0
    for size in (0.0, 1e-9, 0.03, 0.3):
        for _ in range(40):
            middle = rng.uniform(-1.8, 1.8, 2)
            lo, hi = middle - size, middle + size
            points = np.vstack([middle, lo, hi, rng.uniform(lo, hi, (30, 2))])
            inside = [region.set.contains(x) for x in points]
            if gauge(region, mg.Box(lo, hi)) <= 1.0:
                assert all(inside)
                proved += 1
            if gauge(region, mg.Ball(middle, size)) <= 1.0:
                assert all(region.set.contains(x) for x in mg.Ball(middle, size).sample(10, seed=1))
            if region.separated(lo[None], hi[None])[0]:
                assert not any(inside)
                apart += 1
    assert proved >= 10
    assert apart >= 10


@pytest.mark.parametrize("name", FUNCTIONS)
def test_generators_and_boxes_count(name: str) -> None:
    region = region_of(name)
    rng = np.random.default_rng(4)
    proved = 0
    for _ in range(80):
        middle, G, lost = rng.uniform(-1.2, 1.2, 2), rng.normal(size=(3, 2)) * 0.05, rng.uniform(0, 0.02, 2)
        if gauge(region, mg.Box(middle - 0.02, middle + 0.02), G, lost) <= 1.0:
            signs = rng.choice([-1.0, 1.0], (40, 3))
            points = middle + signs @ G + rng.choice([-1.0, 1.0], (40, 2)) * (0.02 + lost) * (1 - 1e-12)
            assert all(region.set.contains(x) for x in points)
            proved += 1
    assert proved >= 1


def test_generators_keep_what_coordinates_have_in_common() -> None:
    # Along the level lines of fn little changes, however long the generator.
    region = target_region(mg.Sublevel(lambda x: x[0] + x[1] + 1e-3 * x[0] ** 2 + 1e-3 * x[1] ** 4, 0.1))
    assert isinstance(region, SublevelRegion)
    assert gauge(region, mg.Box([0, 0], [0, 0]), np.array([[1.0, -1.0]])) <= 1.0
    assert gauge(region, mg.Box([0, 0], [0, 0]), np.array([[0.06, 0.06]])) > 1.0


def test_gauge_is_one_minus_the_margin() -> None:
    region = target_region(mg.Sublevel(lambda x: x[0] ** 2 + x[1] ** 4 + 1.0, 5.0))
    assert isinstance(region, SublevelRegion)
    assert region.set.lowest == pytest.approx(1.0, abs=1e-9)
    assert gauge(region, mg.Box([1.0, 0.0], [1.0, 0.0])) == pytest.approx(0.25, abs=1e-6)


@pytest.mark.parametrize("excess, inside", [(-1e-12, True), (1e-12, False)])
def test_a_tangential_touch_is_told_apart(excess: float, inside: bool) -> None:
    region = target_region(mg.Sublevel(lambda x: x[0] ** 2 + x[1] ** 2 + 0 * x[0] ** 3, 1.0, dim=2))
    assert isinstance(region, SublevelRegion)
    point = np.array([0.0, 1.0 + excess])
    assert (gauge(region, mg.Box(point, point)) <= 1.0) == inside
    # A box whose upper side touches the disc from inside, or crosses it.
    h = np.sqrt(1 - 0.9**2)
    assert (gauge(region, mg.Box([-h, 0.0], [h, 0.9 + excess])) <= 1.0) <= inside
    # Separated boxes touch at most.
    assert not region.separated(np.array([[-1.0, 1.0]]), np.array([[1.0, 2.0]]))[0]
    assert region.separated(np.array([[-1.0, 1.0 + 1e-6]]), np.array([[1.0, 2.0]]))[0]


def mode(start: Any, field: Callable[..., Any], w: Any = None, **more: Any) -> mg.Mode:
    plant = mg.System(field, states=2, inputs=0, disturbance=w)
    return mg.Mode("m", plant, controller=lambda x: np.zeros(0), reference=mg.setpoint([0.0]), start=start, **more)


def verdict(source: mg.Mode, target: Set, horizon: float = 4.0) -> Verdict:
    spec = TargetSpec("t", None, mg.Target("t", target))
    p = source.reference.parameters()[0]
    return certify_unit(source, p, [spec], horizon=horizon, deadline=Deadline(60.0)).verdicts[0]


def falling(x: Any) -> Any:
    return np.array([0 * x[0], -x[1]])


def lobes(level: float) -> mg.Sublevel:
    return mg.Sublevel(lambda x: np.minimum((x[0] - 1) ** 2, (x[0] + 1) ** 2) + x[1] ** 2, level)


@pytest.mark.parametrize("level, certified", [(0.5, False), (0.9, False), (1.01, True)])
def test_trap_the_reach_set_bridges_two_lobes(level: float, certified: bool) -> None:
    # All corners settle in a lobe; x[0] = 0 stays at distance 1 from both.
    found = verdict(mode(mg.Box([-1, 0], [1, 0.5]), falling), lobes(level))
    assert (found.status is C) == certified


@pytest.mark.parametrize("inner, certified", [(0.2, False), (0.02, False), (-0.1, True)])
def test_trap_the_reach_set_covers_the_hole_of_an_annulus(inner: float, certified: bool) -> None:
    ring = mg.Sublevel(lambda x: np.maximum(x @ x - 1.0, inner - x @ x), 0.0)
    found = verdict(mode(mg.Box([-0.5, 0], [0.5, 0.1]), falling), ring)
    assert (found.status is C) == certified


@pytest.mark.parametrize("level, certified", [(0.009, False), (0.02, True)])
def test_trap_the_hole_lies_between_the_samples(level: float, certified: bool) -> None:
    # fn > level only within a disc of radius ~ 0.01 around a point of the reach set.
    holed = mg.Sublevel(lambda x: np.maximum(x @ x - 1, 1e-6 / (1e-4 + (x[0] - 0.237) ** 2) - level), 0.0)
    found = verdict(mode(mg.Box([-0.4, 0], [0.4, 0.1]), falling), holed)
    assert (found.status is C) == certified


@pytest.mark.parametrize("width, certified", [(0.999, False), (1.01, True)])
def test_trap_a_saddle_meets_a_curved_target_in_passing(width: float, certified: bool) -> None:
    # x' = 1, y' = 0 from (-2, +-1/2): the strip |x y^2| is crossed, the disc of radius ~ 1/2 only touched.
    moving = mode(mg.Box([-2.0, 0.5], [-2.0, 0.5]), lambda x: np.array([1 + 0 * x[0], 0 * x[1]]))
    touched = mg.Sublevel(lambda x: np.linalg.norm(x), 0.5 * width, dim=2)
    found = verdict(moving, touched)
    assert (found.status is C) == certified
    if not certified:
        assert found.status is R


def test_a_disturbed_nonlinear_loop_enters_and_margins_are_not_above_the_truth() -> None:
    loop = mode(
        mg.Ball([0.5, 0.0], 0.1), lambda x, w: np.array([x[1], -np.sin(x[0]) - x[1] + w[0]]), mg.Box([-0.05], [0.05])
    )

    def energy(x: Any) -> Any:
        return 1 - np.cos(x[0]) + 0.5 * x[1] ** 2

    found = verdict(loop, mg.Sublevel(energy, 0.02), 12.0)
    assert found.status is C
    assert found.margin is not None
    assert 0.0 <= found.margin < 1.0
    assert verdict(loop, mg.Sublevel(energy, 1e-4), 12.0).status is not C


def test_the_window_does_not_rest_on_convexity() -> None:
    # Two instants inside different lobes do not mean that the way between them is inside.
    moving = mode(mg.Box([-1, 0], [-1, 0]), lambda x: np.array([1 + 0 * x[0], 0 * x[1]]))
    region = target_region(mg.Sublevel(lambda x: np.minimum((x[0] - 1) ** 2, (x[0] + 1) ** 2), 0.25, dim=2))
    compiled = compile_mode(moving, moving.reference.parameters()[0])
    flow = Flow(compiled.fields, compiled.whole(), np.zeros(0), np.zeros(0), Order(1, 0), names=["a", "b"])
    flow.run(3.0)
    crossings = find_crossings(Reach(flow, 3.0), region)
    assert isinstance(crossings, list)
    assert crossings[0].time == 0.0
    assert crossings[0].window <= 0.5
    ends = np.stack([np.array([[-1.0], [0.0]]), np.array([[1.0], [0.0]])])
    sets = ReachSets.of(flow.bounds, [ReachSet.of(flow.bounds, p) for p in ends], 2)
    assert region.gauges(sets).max() <= 1.0
    assert region.tube_gauges(sets, np.zeros((1, 2)))[0] > 1.0


def test_the_boxes_of_sets_count_on_the_way_too() -> None:
    region = region_of("norm")
    piece, table = whole(mg.Box([0, 0], [1, 1]), []), monomials((1, 1), 1)
    bounds = PolynomialBounds(piece, table, table.size)
    p = np.zeros((2, table.size))
    p[0, 0] = 0.5
    plain = ReachSet.of(bounds, p)
    for size, inside in ((0.4, True), (0.6, False)):
        reach = plain.plus_box(np.array([size, 0.0]))
        assert (region.gauge(reach) <= 1.0) == inside
        for order in ([reach, plain], [plain, reach]):
            gauges = region.tube_gauges(ReachSets.of(bounds, order, 2), np.zeros((1, 2)))
            assert (gauges[0] <= 1.0) == inside
