"""Sublevel starts: pieces cover the set, leave out what is outside, and thin parts are not lost."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.verdict import Status
from modegraph.reach.cover import cutting
from modegraph.reach.start.piece import Piece, whole

SETS = {
    "annulus": mg.Sublevel(lambda x: (x[0] ** 2 + x[1] ** 2 - 1) ** 2, 0.04),
    "lobes": mg.Sublevel(lambda x: np.minimum((x[0] - 2) ** 2, (x[0] + 2) ** 2) + x[1] ** 4, 0.3),
    "spike": mg.Sublevel(
        lambda x: np.maximum(np.abs(x[0]) * (1 + 1e4 * np.maximum(x[1], 0)) - 1, np.abs(x[1]) - 1), 0.0
    ),
    "far": mg.Sublevel(lambda x: np.maximum((x[0] - 1e4) ** 4, np.abs(x[1] - x[0] + 1e4) - 0.1) - 1e-4, 0.0),
}


def leaves(piece: Piece, depth: int) -> list[Piece]:
    if depth == 0:
        return [piece]
    return [leaf for child in piece.split(depth % 2) for leaf in leaves(child, depth - 1)]


def covered(pieces: list[Piece], x: np.ndarray) -> bool:
    for piece in pieces:
        lo, hi = piece.chart.box(piece.lo, piece.hi)
        if ((lo <= x) & (x <= hi)).all():
            return True
    return False


@pytest.mark.parametrize("name", SETS)
def test_pieces_cover_the_set(name: str) -> None:
    region = SETS[name]
    first = whole(region, [])
    parts = leaves(first, 7)
    points = region.sample(300, seed=1)
    assert all(covered(parts, x) for x in points)
    size = sum(float(np.prod(p.hi - p.lo)) for p in parts)
    full = float(np.prod(first.hi - first.lo))
    assert size < 0.85 * full or name == "far"
    for piece in parts:
        lo, hi = piece.chart.box(piece.lo, piece.hi)
        at = piece.chart.centre + piece.chart.axes @ (piece.middle + piece.radius * piece.points).T[:, :1].T[0]
        assert ((lo <= at) & (at <= hi)).all()


def test_the_tip_of_the_spike_is_in_a_piece() -> None:
    parts = leaves(whole(SETS["spike"], []), 8)
    for height in (0.2, 0.7, 1.0):
        assert covered(parts, np.array([0.0, height]))


def test_the_gap_between_the_lobes_is_left_out() -> None:
    parts = leaves(whole(SETS["lobes"], []), 4)
    assert not covered(parts, np.array([0.0, 0.0]))


def test_an_ellipsoid_in_disguise_is_round() -> None:
    piece = whole(mg.Sublevel(lambda x: 2 * x[0] ** 2 + x[0] * x[1] + x[1] ** 2, 3.0), [])
    assert piece.chart.round
    assert piece.chart.sublevel is None


def test_later_sets_are_not_cut_to_the_starts() -> None:
    chart = whole(SETS["annulus"], []).chart
    assert chart.sublevel is not None
    assert chart.around(np.zeros(2), np.eye(2), original=False).sublevel is None


def still(start: Any, top: float) -> mg.Mode:
    plant = mg.System(lambda x: np.array([-x[0], -x[1]]), states=2, inputs=0)
    return mg.Mode(
        "fall", plant, controller=lambda x: np.zeros(0), reference=mg.setpoint([0.0]), start=start,
        constraints=lambda x: {"top": x[1] <= top},
    )  # fmt: skip


@pytest.mark.parametrize("top, certified", [(0.98, False), (1.01, True)])
def test_trap_a_start_set_with_a_thin_spike(top: float, certified: bool) -> None:
    # Nearly all of the set is below 0; the spike, a thousandth wide, reaches 1.
    graph = mg.build([still(SETS["spike"], top), mg.Target("low", mg.Box([-2, -2], [2, 0.5]))], horizon=4.0)
    assert (graph.check("fall").status is Status.CERTIFIED) == certified
    assert (graph.verdict("fall", "low").status is Status.CERTIFIED) == certified
    if certified:
        # exp(-t) = 1/2 from the tip.
        assert graph.verdict("fall", "low").time[1] >= np.log(2.0)


@pytest.mark.parametrize("top, certified", [(1.05, False), (1.15, True)])
def test_the_corners_of_the_box_around_the_set_do_not_count(top: float, certified: bool) -> None:
    plant = mg.System(lambda x: np.array([-x[0], -x[1]]), states=2, inputs=0)
    mode = mg.Mode(
        "fall", plant, controller=lambda x: np.zeros(0), reference=mg.setpoint([0.0]),
        start=mg.Sublevel(lambda x: np.sqrt(x[0] ** 4 + x[1] ** 4 + 1) - np.sqrt(2.0), 0.0),
        constraints=lambda x: {"sum": x[0] + x[1] <= 1.7 * top},
    )  # fmt: skip
    # The sum is at most 2^(3/4) = 1.68 in the set, and 2 in the box.
    graph = mg.build([mode])
    assert (graph.check("fall").status is Status.CERTIFIED) >= certified
    lower = mg.build([still(SETS["annulus"], 0.5 * top)])
    assert lower.check("fall").status is Status.REFUTED


def test_an_edge_between_two_modes_with_sublevel_starts() -> None:
    plant = mg.System(lambda x, u: np.array([x[1], u[0]]), states="position speed", inputs="force")

    def pd(kp: float, kd: float) -> Any:
        return lambda x, r: -kp * (x[:1] - r) - kd * x[1:]

    def near(level: float) -> Any:
        return lambda r: mg.Sublevel(lambda x: 2 * (x[0] - r[0]) ** 2 + (x[0] - r[0]) * x[1] + x[1] ** 2, level)

    modes = [
        mg.Mode("gentle", plant, controller=pd(1, 2), reference=mg.setpoint([0.5]), start=near(0.2)),
        mg.Mode("brisk", plant, controller=pd(9, 6), reference=mg.setpoint([0.5]), start=near(0.01)),
    ]
    graph = mg.build(modes, horizon=20.0)
    assert graph.verdict("gentle", "brisk").status is Status.CERTIFIED
    assert graph.verdict("brisk", "gentle").time == (0.0, 0.0)
    run = graph.plan("gentle", "brisk").simulate([0.6, 0.1])
    assert run.ok


@pytest.fixture
def late(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only boxes narrower than 1/2 are seen to be empty: a piece may turn out to hold no start when it is cut."""
    known = mg.Sublevel.hull_within

    def hull(self: mg.Sublevel, lo: np.ndarray, hi: np.ndarray) -> Any:
        return (lo, hi) if (hi - lo).max() > 0.5 else known(self, lo, hi)

    monkeypatch.setattr(mg.Sublevel, "hull_within", hull)


def lobes(field: Any, fn: Any, n: int, **more: Any) -> mg.Mode:
    plant = mg.System(field, states=n, inputs=0)
    return mg.Mode(
        "lobes", plant, controller=lambda x: np.zeros(0), reference=mg.setpoint([0.0]),
        start=mg.Sublevel(fn, 0.04), **more,
    )  # fmt: skip


@pytest.mark.usefixtures("late")
@pytest.mark.parametrize("least, certified", [(0.7, True), (0.82, False)])
def test_a_piece_that_turns_out_empty_is_no_obstacle_to_a_proof(least: float, certified: bool) -> None:
    # Starts have x^2 >= .8; the pieces between the lobes do not.
    mode = lobes(
        lambda x: np.array([-0.01 * x[0]]), lambda x: (x[0] ** 2 - 1.0) ** 2, 1,
        constraints=lambda x: {"hollow": x[0] ** 2 >= least},
    )  # fmt: skip
    graph = mg.build([mode, mg.Target("all", mg.Box([-3.0], [3.0]))], horizon=1.0)
    assert (graph.verdict("lobes", "all").status is Status.CERTIFIED) == certified


@pytest.mark.usefixtures("late")
def test_the_flowpipe_leaves_out_a_piece_that_turns_out_empty(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cutting, "PROGRESS", 0.0)
    # From x0 = 0, between the lobes, the other state escapes at t = .3; from the lobes it grows by 15 % at most.
    mode = lobes(
        lambda x: np.array([0.0, 3.0 * (x[0] ** 2 - 1.0) ** 2 * x[1] ** 2]),
        lambda x: np.maximum((x[0] ** 2 - 1.0) ** 2, np.abs(x[1] - 1.0) - 0.06), 2,
    )  # fmt: skip
    pipe = mg.flowpipe(mode, horizon=1.0)
    assert pipe.complete, pipe.reason
    box = pipe.at(1.0)
    assert (box.lo <= [-np.sqrt(1.2), 0.9]).all()
    assert (box.hi >= [np.sqrt(1.2), 1.1]).all()
    assert box.hi[1] < 1.4
