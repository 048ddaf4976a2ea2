"""Graphs with continuous classes of references: verdicts, relations, plans and runs."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.continuous import ContinuousReferences
from tests.certify.class_graphs import double_integrators, one_integrator

SQUARE = mg.Box([-1.0, -1.0], [1.0, 1.0])


def relation(graph: mg.ModeGraph, i: str, j: str) -> ContinuousReferences:
    refs = next(s for s in graph.switches if (s.source, s.target) == (i, j)).references
    assert isinstance(refs, ContinuousReferences)
    return refs


def pairs(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.0, 1.0, (count, 2)), rng.uniform(-1.0, 1.0, (count, 2))


@pytest.fixture(scope="module")
def line() -> mg.ModeGraph:
    plant = double_integrators(1)[0].system
    home = mg.Mode(
        "home", plant, controller=lambda x, r: -9.0 * (x[:1] - r) - 6.0 * x[1:], reference=mg.setpoint([0.9]),
        start=lambda r: mg.Ball([r[0], 0.0], 0.05),
    )  # fmt: skip
    return mg.build([*double_integrators(1), home], horizon=20.0)


def test_a_source_that_forgets_its_reference_gives_a_product() -> None:
    """Everything goes to the origin, where one start rests: R^ij is all of R_i times {|r_j| <= .5}."""
    source = one_integrator(lambda r: 0.0 * r, lambda r: mg.Ball([0.0, 0.0], 0.9), SQUARE, "source")
    target = one_integrator(lambda r: r, lambda r: mg.Ball(r, 0.5), SQUARE, "target")
    graph = mg.build([source, target], horizon=12.0)
    refs = relation(graph, "source", "target")
    r_i, r_j = pairs(4000)
    distance = np.linalg.norm(r_j, axis=1)
    status = refs.statuses(r_i, r_j)
    assert (status[distance < 0.499] == 1).all()
    assert not (status[distance > 0.5] == 1).any()
    assert refs.decoupled
    assert not relation(graph, "target", "target").decoupled


def test_a_source_that_turns_its_reference_couples_through_the_rotation() -> None:
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    source = one_integrator(lambda r: turn @ r, lambda r: mg.Ball(turn @ r, 0.3), SQUARE, "source")
    target = one_integrator(lambda r: r, lambda r: mg.Box(r - 0.2, r + 0.2), SQUARE, "target", rate=2.0)
    refs = relation(mg.build([source, target], horizon=12.0), "source", "target")
    r_i, r_j = pairs(20000, 1)
    gap = np.abs(r_i @ turn.T - r_j).max(axis=1)
    status = refs.statuses(r_i, r_j)
    assert (status[gap < 0.1999] == 1).all()
    assert (status[gap > 0.2001] == -1).all()
    assert not (status[gap > 0.2] == 1).any()


def test_edges_whose_references_never_meet_are_no_chain() -> None:
    """source -> middle only near the origin, middle -> goal only near (.9, 0)."""
    source = one_integrator(lambda r: 0.0 * r, lambda r: mg.Ball([0.0, 0.0], 0.05), SQUARE, "source")
    middle = one_integrator(lambda r: r, lambda r: mg.Ball(r, 0.1), SQUARE, "middle")
    goal = mg.Target("goal", mg.Ball([0.9, 0.0], 0.2))
    graph = mg.build([source, middle, goal], horizon=12.0)
    assert graph.verdict("source", "middle").status is mg.Status.CERTIFIED
    assert graph.verdict("middle", "goal").status is mg.Status.CERTIFIED
    with pytest.raises(mg.Unreachable):
        graph.plan("source", "goal", max_switches=2)
    # Walking by set-points within middle gets there.
    plan = graph.plan("source", "goal")
    assert len(plan.modes) > 4
    assert set(plan.modes[1:-1]) == {"middle"}


def test_a_class_that_can_never_be_entered_is_refuted() -> None:
    near = mg.Box([-1.0, -1.0], [-0.5, 1.0])
    far = mg.Box([0.5, -1.0], [1.0, 1.0])
    source = one_integrator(lambda r: r, lambda r: mg.Ball(r, 0.1), near, "source")
    target = one_integrator(lambda r: r, lambda r: mg.Ball(r, 0.1), far, "target")
    verdict = mg.build([source, target], horizon=12.0).verdict("source", "target")
    assert verdict.status is mg.Status.REFUTED
    assert verdict.witness is not None
    assert verdict.witness.kind == "trapped"


def test_verdicts_are_existential_over_what_is_not_named(line: mg.ModeGraph) -> None:
    assert line.verdict("wide", "narrow").status is mg.Status.CERTIFIED
    assert line.verdict("wide", "narrow", r_i=[0.2]).status is mg.Status.CERTIFIED
    assert line.verdict("wide", "home", r_i=[0.0]).status is mg.Status.REFUTED
    assert line.verdict("wide", "home").status is mg.Status.CERTIFIED
    # The figures of a switch hold for every certified pair, those of a verdict for the one it names.
    switch = next(s for s in line.switches if (s.source, s.target) == ("wide", "narrow"))
    assert switch.margin == 0.0
    pair = line.verdict("wide", "narrow", [0.2], [0.25])
    assert pair.status is mg.Status.CERTIFIED
    assert pair.time is not None
    assert 0.0 < pair.time[1] <= 20.0
    assert line.verdict("wide", "narrow", [0.2], [0.35]).status is mg.Status.REFUTED
    with pytest.raises(mg.ModegraphError, match="itself"):
        line.verdict("wide", "wide", [0.2], [0.2])
    with pytest.raises(mg.ModegraphError, match="class is"):
        line.verdict("wide", "narrow", [3.0], [0.2])


def test_every_certified_pair_holds_in_simulation(line: mg.ModeGraph) -> None:
    """Random certified pairs, random starts: exact solutions enter the target by the certified time."""
    refs = relation(line, "wide", "narrow")
    rng = np.random.default_rng(2)
    for r_i, r_j in refs.sample(60, seed=3):
        assert r_i is not None
        assert r_j is not None
        latest = line.verdict("wide", "narrow", r_i, r_j).time
        assert latest is not None
        way = rng.normal(size=2)
        e0, v0 = 0.5 * way / np.linalg.norm(way)
        t = np.linspace(0.0, latest[1], 2000)
        # x'' + 2 x' + x = r: critically damped.
        e = (e0 + (v0 + e0) * t) * np.exp(-t)
        v = (v0 - (v0 + e0) * t) * np.exp(-t)
        assert np.hypot(r_i[0] + e - r_j[0], v).min() <= 0.1


def test_a_plan_chooses_references_that_are_certified_pair_by_pair(line: mg.ModeGraph) -> None:
    for minimize in ("switches", "time", "distance"):
        plan = line.plan("wide", "narrow", r_start=[-0.9], r_goal=[0.8], minimize=minimize)
        references = [np.asarray(r) for r in plan.references]
        assert references[0] == pytest.approx([-0.9])
        assert references[-1] == pytest.approx([0.8])
        for i, j, r_i, r_j in zip(plan.modes, plan.modes[1:], references, references[1:], strict=False):
            assert relation(line, i, j).contains(r_i, r_j)
        run = plan.simulate([-0.9 + 0.2, 0.1])
        assert run.ok
        assert len(run.switch_times) == len(plan.switches)
    # No shorter way than the straight line; the walk along it has exactly that length.
    assert plan.cost == pytest.approx(1.7)


def test_a_plan_ends_in_a_finite_mode_and_starts_from_a_state(line: mg.ModeGraph) -> None:
    assert line.plan("wide", "home", r_start=[-0.9]).modes[-1] == "home"
    entered = dict(line.modes_at([0.3, 0.0]))
    assert set(entered) == {"wide", "narrow"}
    assert entered["narrow"].contains(None, [0.35])
    assert not entered["narrow"].contains(None, [0.5])
    plan = line.plan(x0=[0.3, 0.0], goal="home")
    assert plan.simulate().ok


def test_the_rest_of_the_graph_speaks_of_classes(line: mg.ModeGraph) -> None:
    assert "certified" in str(line.explain("wide", "narrow"))
    assert "equilibrium" in str(line.explain("wide", "home", r_i=[0.0]))
    assert line.check("wide").status is mg.Status.CERTIFIED
    names = {(s.source, s.target) for s in line.submodes}
    assert ("wide", "narrow") in names
    assert any(edge.kind == "stay" for edge in line.edges)
    data: Any = json.loads(line.plan("wide", "home", r_start=[0.5]).to_json())
    assert data["references"][0] == [0.5]


def test_nothing_is_certified_of_a_class_whose_limits_fail_on_the_way() -> None:
    """Starts at speeds up to .5 break a limit of .3; with room for them the same pairs are certified."""
    plant = double_integrators(1)[0].system

    def graph(limit: float) -> mg.ModeGraph:
        mode = mg.Mode(
            "held", plant, controller=lambda x, r: -(x[:1] - r) - 2.0 * x[1:],
            reference=mg.setpoint(mg.Box([-1.0], [1.0])), start=lambda r: mg.Ball([r[0], 0.0], 0.5),
            constraints=lambda x: {"speed": abs(x[1]) <= limit},
        )  # fmt: skip
        return mg.build([mode], horizon=6.0)

    strict, relaxed = graph(0.3), graph(0.6)
    assert strict.verdict("held", "held", [0.0], [0.1]).status is mg.Status.UNDECIDED
    assert strict.check("held").status is not mg.Status.CERTIFIED
    assert relaxed.verdict("held", "held", [0.0], [0.1]).status is mg.Status.CERTIFIED


def test_instants_before_a_limit_fails_may_be_used() -> None:
    plant = double_integrators(1)[0].system
    mode = mg.Mode(
        "early", plant, controller=lambda x, r: -(x[:1] - r) - 2.0 * x[1:],
        reference=mg.setpoint(mg.Box([-1.0], [1.0])), start=lambda r: mg.Ball([r[0], 0.0], 0.5),
        constraints=lambda x, t: {"in time": t <= 4.0, "speed": abs(x[1]) <= 0.6},
    )  # fmt: skip
    graph = mg.build([mode], horizon=12.0)
    verdict = graph.verdict("early", "early", [0.0], [0.2])
    assert verdict.status is mg.Status.CERTIFIED
    assert verdict.time is not None
    assert verdict.time[1] <= 4.0
    assert all(slack >= 0.0 for slack in verdict.slack.values())
    assert graph.verdict("early", "early", [0.0], [0.4999]).status is mg.Status.UNDECIDED


def scalar(controller: Any, region: mg.Box, radius: float, disturbance: mg.Box | None = None) -> mg.Mode:
    """x' = u + w around r."""
    if disturbance is None:
        plant = mg.System(lambda x, u: u, states="x", inputs="u")
    else:
        push = lambda x, u, w: u + np.minimum(2e17 * w, 1.0)
        plant = mg.System(push, states="x", inputs="u", disturbance=disturbance)
    around = lambda r: mg.Box(r - radius, r + radius)
    return mg.Mode("loop", plant, controller=controller, reference=mg.setpoint(region), start=around)


@pytest.mark.parametrize(("low", "answer"), [(0.0, mg.Status.REFUTED), (1e-17, mg.Status.CERTIFIED)])
def test_a_start_rests_only_where_the_disturbance_can_be_exactly_zero(low: float, answer: mg.Status) -> None:
    """With w >= 1e-17 the rate is 1 for every w: all starts are in the target after a second."""
    region = mg.Box([-0.1], [0.1])
    mode = scalar(lambda x, r: 0.0 * x, region, 0.1, mg.Box([low], [1.0]))
    verdict = mg.build([mode, mg.Target("goal", mg.Box([0.5], [1.5]))], horizon=3.0).verdict("loop", "goal", [0.0])
    assert verdict.status in (answer, mg.Status.UNDECIDED)
    assert (verdict.status is mg.Status.REFUTED) == (low == 0.0)


@pytest.mark.parametrize(
    "controller",
    [
        lambda x, r: (r - x) * np.sqrt(r) ** 2,
        lambda x, r: (r - x) * (r - 0.3) / (r - 0.3),
        lambda x, r: (r - x) * (x - 0.3) / (x - 0.3),
    ],
    ids=["a root", "a pole in r", "a pole in x"],
)
def test_nothing_is_said_where_the_loop_is_not_defined(controller: Any) -> None:
    mode = scalar(controller, mg.Box([-0.5], [1.0]), 0.1)
    graph = mg.build([mode, mg.Target("goal", mg.Box([2.0], [2.5]))], horizon=2.0)
    assert graph.verdict("loop", "goal", [0.3]).status is mg.Status.UNDECIDED
    relaxed = scalar(lambda x, r: (r - x) * (r + 1.0) / (r + 1.0), mg.Box([-0.5], [1.0]), 0.1)
    graph = mg.build([relaxed, mg.Target("goal", mg.Box([2.0], [2.5]))], horizon=2.0)
    assert graph.verdict("loop", "goal", [0.3]).status is mg.Status.REFUTED


def test_a_reference_and_itself_are_no_pair(line: mg.ModeGraph) -> None:
    with pytest.raises(mg.ModegraphError, match="itself"):
        line.verdict("wide", "wide", [0.0], [-0.0])
    refs = relation(line, "wide", "wide")
    assert refs.cells
    assert all(refs.contains(cell.source.center, cell.target.center) for cell in refs.cells[:20])
    for cell in refs.cells:
        assert (cell.source.hi < cell.target.lo).any() or (cell.target.hi < cell.source.lo).any()


def test_every_pair_of_a_cell_is_certified(line: mg.ModeGraph) -> None:
    refs = relation(line, "wide", "narrow")
    for cell in refs.cells[:50]:
        corners = [(a, b) for a in (cell.source.lo, cell.source.hi) for b in (cell.target.lo, cell.target.hi)]
        assert all(refs.contains(a, b) for a, b in corners)
        assert max(abs(float(a[0] - b[0])) for a, b in corners) <= 0.1


def test_statuses_want_arrays_of_the_right_shape(line: mg.ModeGraph) -> None:
    with pytest.raises(mg.ModegraphError, match="statuses: give references"):
        relation(line, "wide", "narrow").statuses(np.zeros((3, 2)), np.zeros((3, 1)))


def test_nothing_is_said_of_references_outside_the_classes(line: mg.ModeGraph) -> None:
    refs = relation(line, "wide", "narrow")
    assert refs.statuses([[1.0]], [[1.0]])[0] == 1
    assert refs.statuses([[1.0], [1.01], [0.0]], [[1.01], [1.0], [2.0]]).tolist() == [0, 0, 0]
