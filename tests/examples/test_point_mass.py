"""The paper's first example: overshoot constants, balls of starts, and which switches they allow."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import modegraph as mg
from tests.soundness.examples import build, load


@pytest.fixture(scope="module")
def module() -> Any:
    return load("point_mass")


@pytest.fixture(scope="module")
def graph(module: Any) -> Any:
    return build(module)


@pytest.mark.parametrize("poles", [(-1.5 + 1j, -1.5 - 1j), (-3 + 2j, -3 - 2j), (-2.0, -2.0)])
def test_overshoot_constant_bounds_the_norm_closely(module: Any, poles: tuple[complex, complex]) -> None:
    k1, k2 = module.pole_placement(poles)
    A = np.array([[0.0, 1.0], [-k1, -k2]])
    assert np.allclose(np.sort_complex(np.linalg.eigvals(A)), np.sort_complex(np.array(poles, complex)), atol=1e-6)
    worst = max(np.linalg.norm(expm(A * t), 2) for t in np.linspace(0, 8, 2503))
    assert worst <= module.overshoot_constant(k1, k2) <= 1.01 * worst


def test_fast_overshoots_more_and_starts_inside_slow(module: Any) -> None:
    slow, fast = module.slow.start([0.0]), module.fast.start([0.0])
    assert fast.radius < slow.radius
    assert slow.radius <= 1.0


def test_limits_hold_for_all_time(graph: Any) -> None:
    for name in ("slow", "fast"):
        assert graph.check(name).status is mg.Status.CERTIFIED, graph.check(name).reason


def test_switches_between_stations(graph: Any, module: Any) -> None:
    for k, p in enumerate(module.STATIONS):
        for m, q in enumerate(module.STATIONS):
            far = abs(k - m)
            at_station = graph.verdict("slow", "fast", p, q)
            assert (at_station.status is mg.Status.CERTIFIED) == (far == 0), (p, q)
            neighbour = graph.verdict("fast", "slow", p, q)
            assert (neighbour.status is mg.Status.CERTIFIED) == (far <= 1), (p, q)
            if far:
                hop = graph.verdict("slow", "slow", p, q)
                assert (hop.status is mg.Status.CERTIFIED) == (far == 1), (p, q)


def test_starts_inside_starts_switch_at_once(graph: Any) -> None:
    assert graph.verdict("fast", "slow", [0.6], [0.6]).time == (0.0, 0.0)


def test_the_tasks(graph: Any, module: Any) -> None:
    settle = graph.plan(**module.tasks["settle"])
    assert settle.modes == ["slow", "fast"]
    travel = graph.plan(**module.tasks["travel"])
    stations = [float(r[0]) for r in travel.references]
    assert stations == sorted(stations)
    assert set(stations) == {0.0, 0.6, 1.2, 1.8}
    assert (travel.modes[0], travel.modes[-1]) == ("slow", "fast")
    run = travel.simulate([-0.3, 0.2])
    assert run.ok
    assert abs(run.x[-1, 0] - 1.8) < 0.1


@pytest.mark.parametrize(
    ("pair", "references"),
    [(("slow", "fast"), ([0.0], [0.6])), (("fast", "slow"), ([0.0], [1.2])), (("slow", "slow"), ([0.6], [1.8]))],
)
def test_repairs_of_absent_switches_hold(graph: Any, module: Any, pair: Any, references: Any) -> None:
    """A station off by d is entered by a ball a little larger than d; no smaller start moves where the mode rests."""
    told = graph.explain(*pair, *references)
    assert told.verdict.status is mg.Status.REFUTED
    (repair,) = told.repairs
    assert repair.kind == "grow target"
    radius = graph.modes[pair[1]].start([0.0]).radius
    gap = references[1][0] - references[0][0]
    assert told.missing == pytest.approx(gap - radius)
    assert gap < repair.value * radius < 1.05 * gap
    built = mg.build(repair.modes, horizon=module.horizon)
    assert built.verdict(*pair, *references).status is mg.Status.CERTIFIED
    assert any("shrink start" in note for note in told.notes)
