"""S_i(p) inside S_j(q) for classes of references: exact at touching, for formula and floats."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import modegraph as mg
from modegraph.certify.question import TargetSpec
from modegraph.certify.switching.zero_time import InZeroTime, ZeroTime, zero_time
from modegraph.certify.targets.region import Region
from modegraph.model.sets import Set, is_subset
from modegraph.model.sets.rational import rational_subset
from modegraph.reach.flow.flow import Order
from tests.certify.test_lasting import compiled

Start = Callable[[Any], Set]
PLANE = mg.System(lambda x, u: u, states="x y", inputs="u v")
REGION = mg.Box([-2.0, -2.0], [2.0, 2.0])
CERTIFIED = mg.Status.CERTIFIED

# Every number is a multiple of 1/64, so that on a grid of references the floats are the formula.
INNER: dict[str, Start] = {
    "box": lambda r: mg.Box([r[0] - 0.25, r[1] - 0.75], [r[0] + 0.25, r[1] + 0.75]),
    "growing box": lambda r: mg.Box([r[0] - 0.25, -0.5], [r[0] + 0.25 + r[1] ** 2 / 4, 0.5]),
    "ball": lambda r: mg.Ball(r, 0.5),
    "growing ball": lambda r: mg.Ball(r, 0.25 + r[0] ** 2 / 4),
    "ellipsoid": lambda r: mg.Ellipsoid(r, [[0.25, 0.0625], [0.0625, 0.125]]),
    "zonotope": lambda r: mg.Zonotope(r, [[0.25, 0.125], [0.125, -0.5]]),
    "growing zonotope": lambda r: mg.Zonotope(r, np.array([[0.25, 0.25 * r[0]], [r[1] * 0.25, 0.5]])),
}
OUTER: dict[str, Start | mg.Target] = {
    "box": lambda r: mg.Box([r[0] - 1.0, -0.875 + r[1]], [r[0] + 1.0, 0.875 + r[1]]),
    "ball": lambda r: mg.Ball(r, 1.25),
    "growing ball": lambda r: mg.Ball(r, 1.0 + r[1] / 4),
    "ellipsoid": lambda r: mg.Ellipsoid(r, [[2.0, 0.5], [0.5, 1.0]]),
    "zonotope": lambda r: mg.Zonotope(r, [[0.75, 0.5, 0.125], [0.25, -0.75, 0.5]]),
    "polytope": mg.Target("goal", mg.Polytope([[1, 2], [-1, 0.5], [0.25, -1]], [1.5, 1.0, 1.25])),
    "fixed box": mg.Target("goal", mg.Box([-1.0, -1.0], [1.0, 1.0])),
    "fixed ball": mg.Target("goal", mg.Ball([0.25, 0.0], 1.25)),
}


def mode(name: str, start: Any, region: Any = REGION, **more: Any) -> mg.Mode:
    return mg.Mode(
        name, PLANE, controller=lambda x, r: r - x, reference=mg.setpoint(region), start=start, **more
    )  # fmt: skip


def between(inner: Any, outer: Any) -> ZeroTime:
    """From a class of start sets to one of targets, or to a Target."""
    target = outer if isinstance(outer, mg.Target) else mode("outer", outer)
    if isinstance(target, mg.Target):
        target.settle(2)
    found = zero_time(mode("inner", inner), None, TargetSpec("outer", None, target))
    assert found is not None
    return found


KNOWN = {(a, b): between(INNER[a], OUTER[b]) for a in INNER for b in OUTER}


def target_rows(zero: ZeroTime, q: Any) -> np.ndarray:
    return np.asarray(q, float)[:, : zero.target.bounds()[0].shape[1]]


@pytest.mark.parametrize("pair", KNOWN, ids=str)
@settings(max_examples=15, deadline=None)
@given(numbers=st.lists(st.integers(-16, 16), min_size=32, max_size=32))
def test_on_a_grid_the_answer_is_that_for_single_references(pair: tuple[str, str], numbers: list[int]) -> None:
    zero = KNOWN[pair]
    z = np.array(numbers, float).reshape(-1, 4) / 16.0
    p, q = z[:, :2], target_rows(zero, z[:, 2:])
    wanted = [is_subset(zero.source.own(a), zero.target.own(b)) for a, b in zip(p, q, strict=True)]
    assert zero.decides(p, q).tolist() == wanted


@pytest.mark.parametrize("pair", KNOWN, ids=str)
def test_off_the_grid_a_yes_holds_for_the_formula_and_for_the_floats(pair: tuple[str, str]) -> None:
    zero = KNOWN[pair]
    rng = np.random.default_rng(3)
    p, q = rng.uniform(-1.0, 1.0, (200, 2)), rng.uniform(-1.0, 1.0, (200, 2))
    p[100:] = np.round(10.0 * p[100:]) / 10.0
    q[100:] = np.round(10.0 * q[100:]) / 10.0
    q = target_rows(zero, q)
    decided = zero.decides(p, q)
    for a, b, yes in zip(p, q, decided, strict=True):
        inner, outer = zero.source.exact(a), zero.target.exact(b)
        assert inner is not None
        assert outer is not None
        both = rational_subset(inner, outer) and is_subset(zero.source.own(a), zero.target.own(b))
        assert yes == both
    assert decided.any()
    assert not decided.all()


# Along x at y = 0 the inner set touches the outer one from inside at this distance, in numbers of a few bits.
TOUCHING: list[tuple[Start, Start, float]] = [
    (lambda r: mg.Box([r[0] - 0.25, -0.75], [r[0] + 0.25, 0.75]), INNER["box"], 0.0),
    (INNER["box"], OUTER["box"], 0.75),  # type: ignore[list-item]
    (INNER["box"], lambda r: mg.Ball(r, 1.25), 0.75),
    (INNER["ball"], lambda r: mg.Box(r - 1.0, r + 1.0), 0.5),
    (INNER["ball"], lambda r: mg.Ball(r, 1.25), 0.75),
    (lambda r: mg.Ellipsoid(r, [[0.25, 0.0], [0.0, 0.0625]]), lambda r: mg.Box(r - 1.0, r + 1.0), 0.5),
    (lambda r: mg.Zonotope(r, [[0.25, 0.25], [0.25, -0.25]]), lambda r: mg.Ball(r, 1.25), 0.75),
    (lambda r: mg.Zonotope(r, [[0.25, 0.25], [0.25, -0.25]]), lambda r: mg.Zonotope(r, [[1.0, 0], [0, 0.5]]), 0.5),
    (INNER["ellipsoid"], INNER["ellipsoid"], 0.0),
    (INNER["ball"], INNER["ball"], 0.0),
    (INNER["zonotope"], INNER["zonotope"], 0.0),
]


@pytest.mark.parametrize("case", range(len(TOUCHING)))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_touching_is_inside_and_one_unit_further_is_not(case: int, sign: float) -> None:
    inner, outer, distance = TOUCHING[case]
    zero = between(inner, outer)
    p = np.zeros((1, 2))
    assert zero.decides(p, np.array([[sign * distance, 0.0]]))[0]
    assert not zero.decides(p, np.array([[sign * math.nextafter(distance, math.inf), 0.0]]))[0]
    assert not zero.decides(p, np.array([[sign * (distance + 2.0**-40), 0.0]]))[0]
    if distance:
        assert zero.decides(p, np.array([[sign * (distance - 2.0**-40), 0.0]]))[0]
        near = np.array([[sign * math.nextafter(distance, 0.0), 0.0]])
        assert zero.decides(p, near)[0] == is_subset(zero.source.own(p[0]), zero.target.own(near[0]))


@pytest.mark.parametrize("pair", KNOWN, ids=str)
def test_a_box_of_pairs_counts_where_all_of_them_do(pair: tuple[str, str]) -> None:
    zero = KNOWN[pair]
    rng = np.random.default_rng(5)
    middle, half = rng.uniform(-1.0, 1.0, (4000, 4)), rng.uniform(0.0, 0.05, (4000, 4))
    lo, hi = middle - half, middle + half
    source, target = (lo[:, :2], hi[:, :2]), (target_rows(zero, lo[:, 2:]), target_rows(zero, hi[:, 2:]))
    whole, none = zero.boxes(source, target), zero.excludes(source, target)
    assert whole.any()
    assert none.any()
    some = []
    for _ in range(8):
        z = lo + (hi - lo) * rng.integers(0, 2, lo.shape)
        inside = zero.decides(z[:, :2], target_rows(zero, z[:, 2:]))
        some.append(inside)
        assert inside[whole].all()
        assert not inside[none].any()
    # Few boxes that are inside at some corners are lost.
    assert whole.sum() > 0.5 * np.all(some, axis=0).sum()


def test_references_outside_a_class_belong_to_no_pair() -> None:
    zero = KNOWN["ball", "ball"]
    beyond = np.array([[2.01, 0.0]])
    assert zero.decides(np.array([[2.0, 0.0]]), np.array([[2.0, 0.0]]))[0]
    assert not zero.decides(beyond, np.array([[2.0, 0.0]]))[0]
    assert not zero.decides(np.array([[2.0, 0.0]]), beyond)[0]
    assert not zero.boxes((np.array([[1.9, 0.0]]), beyond), (np.array([[1.9, 0.0]]), np.array([[1.95, 0.0]])))[0]


def test_numbers_that_are_not_rational_are_decided_by_an_inequality() -> None:
    zero = between(lambda r: mg.Ball([np.sin(r[0]), r[1]], 0.5), lambda r: mg.Ball([np.sin(r[0]), r[1]], 1.0))
    p = np.array([[0.3, 0.0]])
    assert zero.decides(p, np.array([[0.3, 0.499]]))[0]
    assert not zero.decides(p, np.array([[0.3, 0.5]]))[0]
    assert not zero.decides(p, np.array([[0.3, 0.501]]))[0]


def test_a_constant_that_floats_do_not_give_is_judged_by_the_floats() -> None:
    """(r + 4) - 4 - r + 1 is 1 for the formula; the sum is rounded, and so the set in floats is often another."""
    zero = between(
        lambda r: mg.Box([r[0] - 0.25, -((r[1] + 4.0) - 4.0 - r[1] + 1.0)], [r[0] + 0.25, 0.5]),
        lambda r: mg.Box([r[0] - 1.0, -1.0], [r[0] + 1.0, 1.0]),
    )
    rng = np.random.default_rng(1)
    p = rng.uniform(-0.25, 0.25, (200, 2))
    wanted = [is_subset(zero.source.own(a), zero.target.own(a)) for a in p]
    assert zero.decides(p, p).tolist() == wanted
    assert 10 < sum(wanted) < 190


def test_the_gauge_is_what_the_sets_reach() -> None:
    p, q = np.zeros((1, 2)), np.array([[0.25, 0.0]])
    assert KNOWN["ball", "ball"].gauges(p, q)[0] == pytest.approx(0.75 / 1.25, rel=1e-9)
    assert KNOWN["box", "box"].gauges(p, q)[0] == pytest.approx(0.75 / 0.875, rel=1e-9)
    # Sides that are met leave no margin.
    assert KNOWN["box", "box"].gauges(p, np.array([[0.25, 0.125]]))[0] == 1.0


def test_nothing_is_kept_where_no_pair_can_be_inside() -> None:
    wide, narrow = (mode(f"{a:g}", lambda r, a=a: mg.Ball(r, a)) for a in (0.5, 0.25))
    assert zero_time(wide, None, TargetSpec("narrow", None, narrow)) is None
    assert zero_time(narrow, None, TargetSpec("narrow", None, narrow)) is None
    assert zero_time(narrow, None, TargetSpec("wide", None, wide)) is not None
    size = mode("size", lambda r: mg.Ball([0.0, 0.0], 1.0 + r[0] / 4))
    assert zero_time(size, None, TargetSpec("size", None, size)) is not None


# -- in graphs ---------------------------------------------------------------------------------------

DRIFT = mg.System(lambda x, u: np.array([x[1], u[0]]), states="p v", inputs="u")


def drifting(name: str, half: float, **more: Any) -> mg.Mode:
    return mg.Mode(
        name, DRIFT, controller=lambda x, r: 0.0 * r, reference=mg.setpoint(mg.Box([-1.0], [1.0])),
        start=lambda r: mg.Box([r[0] - half, -0.05], [r[0] + half, 0.05]), **more,
    )  # fmt: skip


@pytest.fixture(scope="module")
def graph() -> mg.ModeGraph:
    return mg.build([drifting("wide", 0.15), drifting("narrow", 0.05)], horizon=10.0)


def test_the_same_bound_in_two_classes(graph: mg.ModeGraph) -> None:
    """Nothing holds v inside its bound later: the sets touch there, and only t = 0 counts."""
    verdict = graph.verdict("narrow", "wide")
    assert verdict.status is CERTIFIED
    assert graph.verdict("narrow", "narrow").status is not CERTIFIED
    single = graph.verdict("narrow", "wide", [0.25], [0.3])
    assert (single.status, single.time, single.energy, single.window, single.margin) == (CERTIFIED, (0, 0), 0, 0, 0)
    assert graph.verdict("narrow", "wide", [0.25], [0.375]).status is not CERTIFIED


def test_everything_a_graph_says_of_a_pair_agrees(graph: mg.ModeGraph) -> None:
    refs = graph.references("narrow", "wide")
    rng = np.random.default_rng(0)
    p = rng.uniform(-0.8, 0.8, (300, 1))
    q = p + rng.uniform(-0.2, 0.2, p.shape)
    known = (refs.statuses(p, q) == 1).tolist()
    assert known == (np.abs(p - q)[:, 0] < 0.1).tolist()
    assert [refs.contains(a, b) for a, b in zip(p, q, strict=True)] == known
    assert [
        graph.verdict("narrow", "wide", a, b).status is CERTIFIED for a, b in zip(p[:20], q[:20], strict=True)
    ] == known[:20]
    assert all(refs.contains(a, b) for a, b in refs.sample(20, seed=1))
    assert refs.cells
    for cell in refs.cells[:50]:
        assert max(abs(cell.source.hi - cell.target.lo), abs(cell.source.lo - cell.target.hi)) <= 0.1
    # |p - p'| <= .1 in a square of side 2.
    low, high = refs.volume
    assert low <= 4.0 - 1.9**2 <= high
    assert low > 0.9 * (4.0 - 1.9**2)
    assert not refs.decoupled


def test_a_plan_takes_a_switch_in_zero_time(graph: mg.ModeGraph) -> None:
    plan = graph.plan("narrow", "wide", minimize="time")
    assert plan.modes == ["narrow", "wide"]
    assert plan.time == (0.0, 0.0)
    assert plan.bound <= 0.0


def test_a_class_and_a_single_reference_agree_with_single_references() -> None:
    def two(reference: Any) -> tuple[mg.Mode, mg.Mode]:
        return tuple(
            mg.Mode(
                name, DRIFT, controller=lambda x, r: 0.0 * r, reference=mg.setpoint(reference),
                start=lambda r, half=half: mg.Box([r[0] - half, -0.05], [r[0] + half, 0.05]),
            )
            for name, half in (("narrow", 0.05), ("wide", 0.15))
        )  # fmt: skip

    finite = mg.Points([[0.0], [0.0625], [0.125]])
    narrow, wide = two(finite)
    whole_narrow, whole_wide = two(mg.Box([-1.0], [1.0]))
    single = mg.build([narrow, wide], horizon=1.0)
    mixed = mg.build([narrow, whole_wide], horizon=1.0)
    other = mg.build([whole_narrow, wide], horizon=1.0)
    for p in ([0.0], [0.0625], [0.125]):
        for q in ([0.0], [0.0625], [0.125]):
            wanted = single.verdict("narrow", "wide", p, q).status is CERTIFIED
            assert wanted == (abs(p[0] - q[0]) < 0.1)
            assert (mixed.verdict("narrow", "wide", p, q).status is CERTIFIED) == wanted
            assert (other.verdict("narrow", "wide", p, q).status is CERTIFIED) == wanted


def test_equal_sets_of_two_classes_are_found() -> None:
    modes = [mode(name, lambda r: mg.Ball(r, 0.5)) for name in ("one", "other")]
    still = mg.build([*modes], horizon=1e-3)
    assert still.verdict("one", "other").status is CERTIFIED
    assert still.references("one", "other").contains([0.3, 0.7], [0.3, 0.7])


def evidence(target: mg.Box, limit: float | None = None) -> InZeroTime:
    c = compiled(limit)
    return InZeroTime(c.one_start, c.flow(c.whole(), Order(1, 0)), Region(target))


def test_touching_is_inside() -> None:
    found = evidence(mg.Box([0.5], [1.0]), limit=1.25)
    assert (found.earliest, found.latest, found.window, found.energy) == (0.0, 0.0, 0.0, 0.0)
    assert found.margin == pytest.approx(0.0, abs=1e-15)
    assert found.slack["top"] == pytest.approx(0.25)
    assert evidence(mg.Box([0.0], [1.5])).margin == pytest.approx(2.0 / 3.0)


@pytest.mark.parametrize("lo, hi", [(np.nextafter(0.5, 1.0), 1.0), (0.5, np.nextafter(1.0, 0.0))])
def test_one_unit_in_the_last_place_is_outside(lo: float, hi: float) -> None:
    with pytest.raises(ValueError):
        evidence(mg.Box([lo], [hi]))


def test_a_start_that_breaks_a_limit_switches_nowhere() -> None:
    with pytest.raises(ValueError):
        evidence(mg.Box([0.0], [2.0]), limit=float(np.nextafter(1.0, 0.0)))
