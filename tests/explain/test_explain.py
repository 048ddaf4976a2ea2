"""Explanations of switches whose closest approach and repairs are known in closed form."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.explain.explain import Explanation
from modegraph.explain.repairs import RepairSearch
from modegraph.report.tables import explanation_data
from tests.certify.class_graphs import double_integrators
from tests.graph.fakes import because
from tests.graph.fakes import graph as fake

CERTIFIED = mg.Status.CERTIFIED


def decay(start: mg.Set, *, to: float = 0.0, push: float = 0.0, name: str = "decay", **options: Any) -> mg.Mode:
    """x' = to - x + w, |w| <= push."""
    if push:
        box = mg.Box([-push], [push])
        plant = mg.System(lambda x, u, w: u + w, states="x", inputs="u", disturbance=box)
    else:
        plant = mg.System(lambda x, u: u, states="x", inputs="u")
    return mg.Mode(name, plant, controller=lambda x, r: r - x, reference=mg.setpoint([to]), start=start, **options)


def drift(constraints: Any = None, **options: Any) -> mg.Mode:
    """x' = 1 from [0, .1]."""
    plant = mg.System(lambda x, u: u, states="x", inputs="u", **options)
    return mg.Mode(
        "drift", plant, controller=lambda x: 1.0 + 0.0 * x, reference=mg.setpoint([0.0]),
        start=mg.Box([0.0], [0.1]), constraints=constraints,
    )  # fmt: skip


def home(lo: float = -0.1, hi: float = 0.1) -> mg.Target:
    return mg.Target("home", mg.Box([lo], [hi]))


def by_kind(told: mg.Explanation, horizon: float | None) -> dict[str, Any]:
    """Repairs by kind, each applied: a fresh build of the changed modes has the switch."""
    for repair in told.repairs:
        built = mg.build(repair.modes, horizon=horizon)
        verdict = built.verdict(told.source, told.target, told.r_i, told.r_j)
        assert verdict.status is CERTIFIED, (repair.text, verdict.reason)
        assert f"{repair.value:g}" == repr(repair.value).removesuffix(".0")
        assert repair.kind == "fix references" or f"{repair.value:g}" in str(told)
    return {repair.kind: repair for repair in told.repairs}


def test_a_horizon_too_short_with_all_three_repairs() -> None:
    """|x(t)| <= e^-t from [-1, 1]: a second is enough from e / 10, or into a target 10 / e times as large."""
    told = mg.build([decay(mg.Box([-1.0], [1.0])), home()], horizon=1.0).explain("decay", "home")
    assert told.verdict.status is mg.Status.REFUTED
    repairs = by_kind(told, 1.0)
    assert 0.99 * math.e / 10.0 <= repairs["shrink start"].value <= math.e / 10.0
    assert 10.0 / math.e <= repairs["grow target"].value <= 1.01 * 10.0 / math.e
    assert math.log(10.0) <= repairs["horizon"].value <= 1.01 * math.log(10.0)
    assert told.block is not None
    assert told.block.kind == "horizon"
    assert told.missing == repairs["horizon"].value - 1.0
    assert not told.notes
    # The counterexample starts at an end and comes as near as 10 / e target sizes.
    assert told.closest is not None
    assert told.worst_start_is == "counterexample"
    assert abs(float(told.worst_start[0])) == pytest.approx(1.0)  # type: ignore[index]
    assert told.closest.time == pytest.approx(1.0)
    assert told.closest.gauge == pytest.approx(10.0 / math.e, rel=1e-6)
    assert told.closest.missing == pytest.approx(1.0 / math.e - 0.1, rel=1e-6)
    assert told.closest.face in ("x <= 0.1", "x >= -0.1")


def test_a_smaller_start_about_its_own_centre_may_not_help() -> None:
    """From [1, 2] the centre needs ln 15 s as well."""
    told = mg.build([decay(mg.Box([1.0], [2.0])), home()], horizon=2.0).explain("decay", "home")
    repairs = by_kind(told, 2.0)
    assert set(repairs) == {"horizon", "grow target"}
    assert math.log(20.0) <= repairs["horizon"].value <= 1.01 * math.log(20.0)
    assert 20.0 * math.exp(-2.0) <= repairs["grow target"].value <= 1.01 * 20.0 * math.exp(-2.0)
    assert any(note.startswith("shrink start: not even") for note in told.notes)


def test_an_equilibrium_outside() -> None:
    told = mg.build([decay(mg.Box([0.5], [1.5]), to=1.0), home()], horizon=9.0).explain("decay", "home")
    assert told.verdict.witness is not None
    assert told.verdict.witness.kind == "trapped"
    assert told.blocking == "x <= 0.1"
    assert told.missing == pytest.approx(0.9)
    assert told.block is not None
    assert told.block.unit == "x"
    repairs = by_kind(told, 9.0)
    assert set(repairs) == {"grow target"}
    assert 10.0 <= repairs["grow target"].value <= 10.1
    text = str(told)
    for part in ("decay -> home: refuted", "blocked by: x <= 0.1, 0.9 (x) missing", "shrink start: not even"):
        assert part in text


def test_an_unstable_equilibrium_is_looked_at_where_it_is() -> None:
    """1/3 is no double: from the double beside it the loop leaves, and passes the target."""
    plant = mg.System(lambda x, u: u, states="x", inputs="u")
    mode = mg.Mode(
        "flee", plant, controller=lambda x: 3.0 * x - 1.0, reference=mg.setpoint([0.0]), start=mg.Box([0.3], [0.4])
    )
    told = mg.build([mode, mg.Target("there", mg.Box([-9.0], [0.2]))], horizon=30.0).explain("flee", "there")
    assert told.verdict.status is mg.Status.REFUTED
    assert told.closest is not None
    if told.verdict.witness is not None and told.verdict.witness.time == 0.0:
        assert told.closest.time == 0.0
    assert told.closest.gauge > 1.0
    assert told.missing == pytest.approx(1.0 / 3.0 - 0.2)


def test_a_disturbance_that_keeps_starts_out() -> None:
    """|w| <= .2 holds a start at .2: the target must be twice as large, or all starts inside from the beginning."""
    told = mg.build([decay(mg.Box([-1.0], [1.0]), push=0.2), home()], horizon=9.0).explain("decay", "home")
    assert told.verdict.witness is not None
    assert abs(told.verdict.witness.w[0]) == 0.2
    assert told.closest is not None
    assert told.closest.gauge == pytest.approx(2.0)
    repairs = by_kind(told, 9.0)
    assert 2.0 < repairs["grow target"].value <= 2.05
    assert 0.099 <= repairs["shrink start"].value <= 0.1


def test_a_constraint_that_is_violated_on_the_way() -> None:
    target = mg.Target("there", mg.Box([1.5], [2.5]))
    told = mg.build([drift(lambda x: {"wall": x[0] <= 1.0}), target], horizon=5.0).explain("drift", "there")
    assert told.verdict.witness is not None
    assert told.verdict.witness.kind == "violates"
    assert told.block is not None
    assert told.block.kind == "constraint"
    assert told.blocking == "constraint 'wall'"
    assert told.missing is not None
    assert 0.0 < told.missing < 0.1
    assert told.block.time is not None
    assert 0.89 <= told.block.time <= 1.1
    # Entered before x = 1: the target about 2 must reach down to .9 + .1, with all of [0, .1] in it at once.
    repairs = by_kind(told, 5.0)
    assert set(repairs) == {"grow target"}
    assert 2.0 <= repairs["grow target"].value <= 2.3


def test_a_constraint_that_cannot_be_proved() -> None:
    """Of the unknown limit only the middle value is tried, and that is kept: undecided, but for the constraint."""
    mode = drift(lambda x, d: {"limit": x[0] <= 3.0 - 2.0 * d["d"]}, unknowns={"d": (0.0, 1.2)})
    target = mg.Target("there", mg.Box([1.5], [1.7]))
    told = mg.build([mode, target], horizon=5.0).explain("drift", "there")
    assert told.verdict.status is mg.Status.UNDECIDED
    assert told.verdict.unproved is not None
    assert told.verdict.unproved.constraint == "limit"
    assert told.blocking == "constraint 'limit'"
    assert "blocked by: constraint 'limit'" in str(told)
    # In time for the limit .6, an interval around 1.6 must reach down to .5, and up to .6.
    assert 10.0 <= by_kind(told, 5.0)["grow target"].value <= 11.1


def test_a_face_alone_undecided() -> None:
    """One common time for all is wanted and there is none: [0, 1] moves at 1 past an interval .4 long."""
    plant = mg.System(lambda x, u, w: u + w, states="x", inputs="u", disturbance=mg.Box([-0.5], [0.5]))
    mode = mg.Mode(
        "drift", plant, controller=lambda x: 1.0 + 0.0 * x, reference=mg.setpoint([0.0]), start=mg.Box([0.0], [0.0])
    )
    target = mg.Target("strip", mg.Polytope([[2.0], [-1.0]], [2.2, -0.9]))
    told = mg.build([mode, target], horizon=5.0).explain("drift", "strip")
    assert told.verdict.status is mg.Status.UNDECIDED
    # [t / 2, 3 t / 2] in the strip [.9, 1.1] about 1: nearest at t = 1, .4 beyond both faces.
    assert told.blocking in ("x <= 1.1", "x >= 0.9")
    assert told.missing == pytest.approx(0.4, abs=0.02)
    assert told.closest is not None
    assert told.closest.time == pytest.approx(1.0, abs=0.05)
    assert told.closest is told.reach
    grow = by_kind(told, 5.0)["grow target"]
    assert 5.0 <= grow.value <= 5.1


def test_a_present_switch_tells_its_margin_and_nearest_face() -> None:
    told = mg.build([decay(mg.Box([-1.0], [1.0])), home(-0.1, 0.2)], horizon=3.0).explain("decay", "home")
    assert told.verdict.status is CERTIFIED
    assert told.repairs == ()
    assert told.notes == ()
    assert told.closest is not None
    assert told.closest.gauge == pytest.approx(1.0 - told.verdict.margin)
    assert told.blocking == "x >= -0.1"
    # .15 from the middle to a face.
    assert told.missing == pytest.approx(-0.15 * told.verdict.margin)
    assert "nearest face: x >= -0.1" in str(told)


def test_a_switch_in_zero_time() -> None:
    told = mg.build([decay(mg.Box([-0.05], [0.05])), home()], horizon=3.0).explain("decay", "home")
    assert told.closest is not None
    assert (told.closest.time, told.closest.gauge) == (0.0, pytest.approx(0.5))
    assert told.missing == pytest.approx(-0.05)


def hover(name: str, kp: float, radius: float, points: list[list[float]]) -> mg.Mode:
    plant = mg.System(lambda x, u: np.array([x[1], u[0]]), states="position speed", inputs="force")
    return mg.Mode(
        name, plant, controller=lambda x, r: -kp * (x[:1] - r) - 2.0 * math.sqrt(kp) * x[1:],
        reference=mg.setpoint(mg.Points(points)), start=lambda r: mg.Ball([r[0], 0.0], radius),
    )  # fmt: skip


def test_a_finite_class_changes_for_the_reference_it_is_about() -> None:
    """Hovering at 0 and entering the hover at .6 within .4: the balls must be half as large again."""
    modes = [hover("wide", 1.0, 0.4, [[0.0], [0.6], [5.0]])]
    graph = mg.build(modes, horizon=15.0)
    told = graph.explain("wide", "wide", [0.0], [0.6])
    assert told.blocking == "the ball of radius 0.4 around (0.6, 0)"
    assert told.missing == pytest.approx(0.2)
    assert told.r_i is not None
    assert told.r_i.tolist() == [0.0]
    grow = by_kind(told, 15.0)["grow target"]
    assert 1.5 <= grow.value <= 1.51
    changed = grow.source.start
    assert grow.source is grow.target
    sizes = [changed(grow.source.reference.at(0.0, p)).radius for p in grow.source.reference.parameters()]
    assert sizes == pytest.approx([0.4, 0.4 * grow.value, 0.4])
    # Existential: the pair that the verdict speaks of.
    assert "told of the references" in str(graph.explain("wide", "wide", seconds=0.0))


def test_shrinking_one_reference_of_a_mode_that_is_followed_by_itself() -> None:
    """x' = 1 + w, |w| <= .15, into [.8, 1.2]: from -a in time at once only if (1.2 + a) / 1.15 >= (.8 + a) / .85."""
    plant = mg.System(lambda x, u, w: u + w, states="x", inputs="u", disturbance=mg.Box([-0.15], [0.15]))
    mode = mg.Mode(
        "belt", plant, controller=lambda x: 1.0 + 0.0 * x, reference=mg.setpoint(mg.Points([[0.0], [1.0]])),
        start=lambda r: mg.Box(r - 0.4 + 0.2 * r, r + 0.4 - 0.2 * r),
    )  # fmt: skip
    told = mg.build([mode], horizon=3.0).explain("belt", "belt", [0.0], [1.0])
    assert told.verdict.status is not CERTIFIED
    repairs = by_kind(told, 3.0)
    assert 0.7 <= repairs["shrink start"].value <= 1.0 / 3.0 / 0.4
    start = repairs["shrink start"].source.start
    assert start(repairs["shrink start"].source.reference.at(0.0, np.array([1.0]))).hi[0] == pytest.approx(1.2)


@pytest.fixture(scope="module")
def line() -> mg.ModeGraph:
    return mg.build(double_integrators(1), horizon=20.0)


def test_a_continuous_class_under_the_references_given(line: mg.ModeGraph) -> None:
    told = line.explain("wide", "narrow", [0.2], [0.35])
    assert told.verdict.status is mg.Status.REFUTED
    assert told.missing == pytest.approx(0.05)
    grow = by_kind(told, 20.0)["grow target"]
    assert 1.5 <= grow.value <= 1.51
    assert grow.source.reference.region is None
    assert [p.tolist() for p in grow.target.reference.parameters()] == [[0.35]]


def test_a_continuous_class_under_the_closest_references(line: mg.ModeGraph) -> None:
    told = line.explain("wide", "narrow", r_i=[1.0])
    assert told.verdict.status is CERTIFIED
    assert told.r_j is not None
    assert abs(told.r_j[0] - 1.0) <= 0.1
    assert told.closest is not None
    assert told.closest.gauge <= 1.0
    assert told.blocking.startswith("the ball of radius 0.1 around")


def test_references_that_are_certified_by_themselves() -> None:
    """A relation looks at few instants; the belt is in the strip for a tenth of a second."""
    plant = mg.System(lambda x, u: u, states="x", inputs="u")
    belt = mg.Mode(
        "belt", plant, controller=lambda x: 1.0 + 0.0 * x, reference=mg.setpoint(mg.Box([0.0], [1.0])),
        start=lambda r: mg.Box(r - 0.05, r + 0.05),
    )  # fmt: skip
    graph = mg.build([belt, mg.Target("strip", mg.Box([7.9], [8.1]))], horizon=20.0)
    told = graph.explain("belt", "strip", [0.0])
    assert told.verdict.status is not CERTIFIED
    assert by_kind(told, 20.0)["fix references"].source.reference.parameters()[0] == 0.0
    assert set(by_kind(told, 20.0)) == {"fix references"}


def test_a_class_of_trajectories_is_narrowed_to_one() -> None:
    plant = mg.System(lambda x, u: u, states="x", inputs="u")
    ramp = mg.trajectory(lambda t, p: np.array([p[0] * t]), 1.0, over=mg.Box([0.5], [2.0]))
    mode = mg.Mode(
        "ramp", plant, controller=lambda x, r: r.dot - 5.0 * (x - r), reference=ramp, start=mg.Box([-0.1], [0.1])
    )
    graph = mg.build([mode, mg.Target("end", mg.Box([1.25], [1.35]))], horizon=3.0)
    told = graph.explain("ramp", "end", [1.2])
    grow = by_kind(told, 3.0)["grow target"]
    # Held at 1.2, .1 from 1.3.
    assert 2.0 <= grow.value <= 2.02
    assert grow.source.reference.parameters()[0].tolist() == [1.2]


def test_a_memory_and_its_reset() -> None:
    plant = mg.System(lambda x, u: u, states="x", inputs="u")
    mode = mg.Mode(
        "lag", plant, controller=lambda x, z: -x + 0.0 * z, reference=mg.setpoint([0.0]), start=mg.Box([-1.0], [1.0]),
        memory=mg.Memory("z", lambda x, z: -z, lambda x: x),
    )  # fmt: skip
    told = mg.build([mode, home()], horizon=1.0).explain("lag", "home")
    repairs = by_kind(told, 1.0)
    assert 0.99 * math.e / 10.0 <= repairs["shrink start"].value <= math.e / 10.0


def test_without_time_the_rest_is_told() -> None:
    graph = mg.build([decay(mg.Box([0.5], [1.5]), to=1.0), home()], horizon=9.0)
    told = graph.explain("decay", "home", seconds=0.0)
    assert told.repairs == ()
    assert told.worst_start is not None
    assert any("no time was allowed" in note for note in told.notes)
    assert told.blocking == "x <= 0.1"
    broken = mg.build([drift(lambda x: {"wall": x[0] <= 1.0}), mg.Target("t", mg.Box([1.5], [2.5]))], horizon=5.0)
    assert broken.explain("drift", "t", seconds=0.0).blocking == "constraint 'wall'"
    for wrong in (-1.0, math.nan, True, "long"):
        with pytest.raises(mg.ModegraphError, match="seconds"):
            graph.explain("decay", "home", seconds=wrong)  # type: ignore[arg-type]


def test_an_interrupt_keeps_what_was_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(self: RepairSearch) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(RepairSearch, "smaller", interrupted)
    told = mg.build([decay(mg.Box([-1.0], [1.0])), home()], horizon=1.0).explain("decay", "home")
    assert {repair.kind for repair in told.repairs} == {"horizon", "grow target"}
    assert any("interrupted" in note for note in told.notes)


def test_what_build_does_not_confirm_is_not_told(monkeypatch: pytest.MonkeyPatch) -> None:
    from modegraph.explain.pair import Pair

    undecided = mg.Verdict(mg.Status.UNDECIDED, because("lost"))
    monkeypatch.setattr(Pair, "built", lambda self, deadline: undecided)
    told = mg.build([decay(mg.Box([-1.0], [1.0])), home()], horizon=1.0).explain("decay", "home")
    assert told.repairs == ()
    assert sum("not by a whole build" in note for note in told.notes) == 3


def test_a_hand_made_graph_is_explained_as_far_as_it_goes() -> None:
    g = fake("ab", {("a", "b"): mg.Verdict(mg.Status.UNDECIDED, because("the budget ended"))})
    told: Explanation = g.explain("a", "b")
    assert any("examined by itself the switch is certified" in note for note in told.notes)


def test_as_data() -> None:
    told = mg.build([decay(mg.Box([0.5], [1.5]), to=1.0), home()], horizon=9.0).explain("decay", "home")
    data = explanation_data(told)
    assert data["status"] == "refuted"
    assert data["missing"] == told.missing
    assert data["block"]["kind"] == "face"
    assert data["closest"]["face"] == told.blocking
    (repair,) = data["repairs"]
    assert repair["kind"] == "grow target"
    assert repair["verdict"]["status"] == "certified"
