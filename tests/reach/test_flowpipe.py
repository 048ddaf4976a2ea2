"""Flowpipes: tight at the instants of the grid, containing everywhere, honest where they end."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import modegraph as mg
from modegraph.reach.flowpipe import Flowpipe

VDP_SPREAD = np.array([0.104, 0.436])
TOLERANCE = 1e-9


def field_mode(field: Any, states: str, start: mg.Box | mg.Ball, **more: Any) -> mg.Mode:
    """x' = field(x), without an input."""
    plant = mg.System(field, states=states, inputs="none", **more)
    return mg.Mode("loop", plant, controller=lambda x: 0.0, reference=mg.setpoint([0.0]), start=start)


def vdp_field(x: Any) -> Any:
    return np.array([x[1], (1 - x[0] ** 2) * x[1] - x[0]])


def van_der_pol(lo: Any = (1.25, 2.35), hi: Any = (1.55, 2.45)) -> mg.Mode:
    return field_mode(vdp_field, "x y", mg.Box(lo, hi))


def escaping() -> mg.Mode:
    """x' = x^2 from [.5, 1]: the largest start escapes at t = 1."""
    return field_mode(lambda x: x**2, "level", mg.Box([0.5], [1.0]))


def solutions(field: Any, starts: np.ndarray, until: float) -> list[Any]:
    found = [
        solve_ivp(
            lambda t, x: field(x),
            (0.0, until),
            x0,
            method="DOP853",
            rtol=1e-11,
            atol=1e-13,
            dense_output=True,
        )
        for x0 in starts
    ]
    return [run.sol for run in found]


def corners_and_inside(box: mg.Box, count: int) -> np.ndarray:
    edges = np.array(np.meshgrid(*zip(box.lo, box.hi, strict=True))).reshape(box.dim, -1).T
    return np.vstack([edges, box.sample(count, seed=3)])


def assert_contains(pipe: Flowpipe, runs: list[Any], until: float) -> None:
    rng = np.random.default_rng(11)
    for t in [*pipe.times[pipe.times <= until], *rng.uniform(0.0, until, 40)]:
        box = pipe.at(t)
        for run in runs:
            assert (run(t) >= box.lo - TOLERANCE).all()
            assert (run(t) <= box.hi + TOLERANCE).all()
    for a, b in pairwise(np.sort(rng.uniform(0.0, until, 12))):
        box = pipe.hull(a, b)
        for run in runs:
            for t in np.linspace(a, b, 25):
                assert (run(t) >= box.lo - TOLERANCE).all()
                assert (run(t) <= box.hi + TOLERANCE).all()


def test_van_der_pol_is_as_wide_as_its_spread(record_property: Any) -> None:
    pipe = mg.flowpipe(van_der_pol(), horizon=7.0)
    assert pipe.complete, pipe.reason
    box = pipe.at(7.0)
    ratio = (box.hi - box.lo) / VDP_SPREAD
    print(f"VDP at T = 7: width {box.hi - box.lo}, {ratio} of the sampled spread")
    record_property("ratio", ratio.tolist())
    assert (ratio < 1.03).all()
    assert "complete" in pipe.reason


def test_van_der_pol_contains_its_runs() -> None:
    mode = van_der_pol()
    pipe = mg.flowpipe(mode, horizon=7.0)
    assert_contains(pipe, solutions(vdp_field, corners_and_inside(mode.start, 20), 7.0), 7.0)


def test_pieces_together_contain_the_runs() -> None:
    mode = van_der_pol((0.5, 1.5), (2.0, 3.0))
    pipe = mg.flowpipe(mode, horizon=3.0)
    assert pipe.complete
    assert "2 pieces" in pipe.reason
    assert_contains(pipe, solutions(vdp_field, corners_and_inside(mode.start, 30), 3.0), 3.0)


def test_inside_a_step_the_chord_costs_little() -> None:
    pipe = mg.flowpipe(van_der_pol(), horizon=7.0)
    for a, b in pairwise(pipe.times[1:]):
        within, ends = pipe.at(0.5 * (a + b)), [pipe.at(a), pipe.at(b)]
        longest = np.max([e.hi - e.lo for e in ends], axis=0)
        assert (within.hi - within.lo <= longest + 0.08).all()


def test_a_ball_is_not_treated_as_its_box() -> None:
    """Rotation by 45 degrees: the box around the ball would become wider by sqrt(2)."""
    mode = field_mode(lambda x: np.array([x[1], -x[0]]), "x y", mg.Ball([2.0, 0.0], 0.5))
    pipe = mg.flowpipe(mode, horizon=np.pi / 4)
    box = pipe.at(np.pi / 4)
    np.testing.assert_allclose(box.hi - box.lo, 1.0, atol=1e-6)
    curved = field_mode(lambda x: np.array([x[1], -np.sin(x[0])]), "x y", mg.Ball([0.0, 0.0], 0.05))
    box = mg.flowpipe(curved, horizon=np.pi / 4).at(np.pi / 4)
    assert (box.hi - box.lo < 0.1001).all()


def test_a_disturbed_loop_contains_its_extremes() -> None:
    plant = mg.System(
        lambda x, u, w: np.array([x[1], -np.sin(x[0]) - x[1] + u[0] + w[0]]),
        states="angle rate",
        inputs="torque",
        disturbance=mg.Box([-0.1], [0.1]),
    )
    mode = mg.Mode(
        "hold",
        plant,
        controller=lambda x: -2.0 * x[0],
        reference=mg.setpoint([0.0]),
        start=mg.Box([0.2, -0.1], [0.4, 0.1]),
    )
    pipe = mg.flowpipe(mode, horizon=6.0)
    assert pipe.complete, pipe.reason
    for w in (-0.1, 0.1):
        field = lambda x, w=w: np.array([x[1], -np.sin(x[0]) - x[1] - 2.0 * x[0] + w])
        assert_contains(pipe, solutions(field, corners_and_inside(mode.start, 4), 6.0), 6.0)
    assert (pipe.at(6.0).hi < 0.2).all()


def test_a_finite_escape_is_incomplete_and_says_so() -> None:
    pipe = mg.flowpipe(escaping(), horizon=3.0)
    assert not pipe.complete
    assert 0.5 < pipe.times[-1] < 1.0
    for part in ("loop", "t = ", "'level'", "shrink"):
        assert part in pipe.reason
    box = pipe.at(pipe.times[-1])
    assert box.hi[0] >= 1.0 / (1.0 - pipe.times[-1])
    with pytest.raises(mg.ModegraphError, match="incomplete"):
        pipe.at(1.5)
    assert mg.flowpipe(escaping(), horizon=0.5).complete
    assert mg.flowpipe(escaping(), horizon=3.0, start=mg.Box([-2.0], [-1.0])).complete


def test_asking_outside_the_computed_time_is_an_error() -> None:
    pipe = mg.flowpipe(van_der_pol(), horizon=0.5)
    with pytest.raises(mg.ModegraphError, match=r"'loop'.*longer horizon"):
        pipe.at(np.nextafter(0.5, 1.0))
    with pytest.raises(mg.ModegraphError, match="time starts at 0"):
        pipe.hull(-0.1, 0.2)
    with pytest.raises(mg.ModegraphError, match="exchange"):
        pipe.hull(0.3, 0.2)
    for bad in (np.nan, "soon", None):
        with pytest.raises(mg.ModegraphError, match="time in seconds"):
            pipe.at(bad)


def follower(reference: Any, **more: Any) -> mg.Mode:
    plant = mg.System(lambda x, u: u, states="x", inputs="u")
    return mg.Mode(
        "follow",
        plant,
        controller=lambda x, r: r.dot - 2.0 * (x - r),
        reference=reference,
        start=mg.Box([-0.1], [0.1]),
        **more,
    )


def test_breakpoints_duration_and_horizon_are_instants() -> None:
    signal = lambda t: np.where(t < 0.3, t, np.where(t < 0.7, 0.3, 2.0 * t - 1.1))
    reference = mg.trajectory(signal, 1.1, breakpoints=[0.3, 0.7])
    pipe = mg.flowpipe(follower(reference), horizon=1.7)
    assert pipe.complete
    for t in (0.0, 0.3, 0.7, 1.1, 1.7):
        assert t in pipe.times
    expected = {0.3: 0.3, 0.7: 0.3, 1.1: 1.1, 1.7: 1.1}
    for t, value in expected.items():
        box = pipe.at(t)
        radius = 0.1 * np.exp(-2.0 * t)
        np.testing.assert_allclose([box.lo[0], box.hi[0]], [value - radius, value + radius], atol=1e-6)
        assert box.lo[0] <= value - radius
        assert box.hi[0] >= value + radius


def test_default_horizon() -> None:
    moving = mg.trajectory(lambda t: t, 1.25)
    assert mg.flowpipe(follower(moving)).times[-1] == 1.25
    assert mg.flowpipe(follower(moving, horizon=0.75)).times[-1] == 0.75
    assert mg.flowpipe(follower(mg.setpoint([0.0]))).times[-1] == 10.0


def test_hull_holds_every_instant_and_is_kept() -> None:
    pipe = mg.flowpipe(van_der_pol(), horizon=2.0)
    box = pipe.hull(0.31, 1.42)
    for t in [0.31, 1.42, *pipe.times[(pipe.times > 0.31) & (pipe.times < 1.42)]]:
        assert (pipe.at(t).lo >= box.lo).all()
        assert (pipe.at(t).hi <= box.hi).all()
    assert pipe.hull(0.31, 1.42) is box


def integrating(reset: Any, start: mg.Box) -> mg.Mode:
    plant = mg.System(lambda x, u: u, states="x", inputs="u")
    memory = mg.Memory("z", lambda x, r: x - r, reset)
    return mg.Mode(
        "integrate",
        plant,
        controller=lambda x, z, r: -3.0 * (x - r) - z,
        reference=mg.setpoint([0.5]),
        start=start,
        memory=memory,
    )


def test_memory_follows_the_states() -> None:
    pipe = mg.flowpipe(integrating(lambda x: 0.5 * x, mg.Box([0.2], [0.4])), horizon=1.0)
    box = pipe.at(0.0)
    np.testing.assert_allclose(box.lo, [0.2, 0.1], atol=1e-12)
    np.testing.assert_allclose(box.hi, [0.4, 0.2], atol=1e-12)
    assert pipe.states == ("x", "z")
    both = mg.flowpipe(integrating(lambda x: 0.5 * x, mg.Box([0.2], [0.4])), horizon=1.0, start=mg.Box([0, 0], [1, 1]))
    np.testing.assert_allclose(both.at(0.0).hi, [1.0, 1.0], atol=1e-12)


def test_nothing_is_claimed_where_the_start_is_not_defined() -> None:
    pipe = mg.flowpipe(integrating(lambda x: np.log(x), mg.Box([-0.2], [1.0])), horizon=1.0)
    assert not pipe.complete
    assert "reset" in pipe.reason
    assert len(pipe.times) == 0
    with pytest.raises(mg.ModegraphError, match="nothing was computed"):
        pipe.at(0.0)


def test_bad_input() -> None:
    mode = van_der_pol()
    for bad in (0.0, -1.0, np.inf, np.nan, "long"):
        with pytest.raises(mg.ModegraphError, match=r"'loop'.*horizon"):
            mg.flowpipe(mode, horizon=bad)  # type: ignore[arg-type]
    with pytest.raises(mg.ModegraphError, match="takes a Mode"):
        mg.flowpipe([mode])  # type: ignore[arg-type]
    with pytest.raises(mg.ModegraphError, match=r"'loop'.*no reference"):
        mg.flowpipe(mode, r=[3.0])
    with pytest.raises(mg.ModegraphError, match=r"'loop.*3 coordinates"):
        mg.flowpipe(mode, start=mg.Box([0.0] * 3, [1.0] * 3))
    with pytest.raises(mg.ModegraphError, match=r"'loop.*start"):
        mg.flowpipe(mode, start=[0.0, 1.0])  # type: ignore[arg-type]
    assert mode.start.lo[0] == 1.25


def test_one_reference_of_several() -> None:
    mode = follower(mg.setpoint(mg.Points([[0.0], [2.0]])))
    with pytest.raises(mg.ModegraphError, match="2 references"):
        mg.flowpipe(mode)
    box = mg.flowpipe(mode, r=[2.0], horizon=8.0).at(8.0)
    np.testing.assert_allclose(box.center, [2.0], atol=1e-4)


def test_plot() -> None:
    import matplotlib.pyplot as plt

    pipe = mg.flowpipe(van_der_pol(), horizon=1.0)
    over_time = pipe.plot()
    assert len(over_time.patches) == 2
    single = pipe.plot(dims="y")
    assert single.get_ylabel() == "y"
    _, ax = plt.subplots()
    assert pipe.plot(ax, dims=(0, 1)) is ax
    assert ax.get_xlabel() == "x"
    times, parts = pipe.tubes()
    rows, lo, hi = parts[0]
    assert rows == slice(0, len(times) - 1)
    assert lo.shape == (len(times) - 1, 2)
    box = pipe.hull(float(times[3]), float(times[4]))
    assert (lo[3] <= box.lo).all()
    assert (hi[3] >= box.hi).all()
    for bad in ("speed", 2, (0, 1, 1)):
        with pytest.raises(mg.ModegraphError, match="dims"):
            pipe.plot(dims=bad)
    plt.close("all")


def test_sections_hold_what_is_reached_and_little_more() -> None:
    """A rotating disc stays a disc: its outlines are 64-gons around it."""
    plant = mg.System(lambda x: np.array([x[1], -x[0]]), states="a b", inputs=0)
    mode = mg.Mode("turn", plant, controller=lambda x: np.zeros(0), reference=mg.setpoint([0.0]),
                   start=mg.Ball([1.0, 0.0], 0.2))  # fmt: skip
    pipe = mg.flowpipe(mode, horizon=3.0)
    for t in (0.0, 1.0, 3.0):
        instant, (polygon,) = pipe.sections(t, ("a", "b"))
        centre = np.array([np.cos(instant), -np.sin(instant)])
        distance = np.linalg.norm(polygon - centre, axis=1)
        assert (distance >= 0.2 - 1e-9).all()
        assert (distance <= 0.2 / np.cos(np.pi / 64.0) + 1e-6).all()
    with pytest.raises(mg.ModegraphError, match="two states"):
        pipe.sections(1.0, ("a",))
    axes = pipe.plot(dims=("a", "b"), sections=[0.0, 1.0], target=mg.Ball([0.0, -1.0], 0.5))
    assert len(axes.patches) == 3
    with pytest.raises(mg.ModegraphError, match="give dims"):
        pipe.plot(sections=[0.0])
