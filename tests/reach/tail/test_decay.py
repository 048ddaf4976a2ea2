"""Decay of quadratic norms: closed forms, and nothing proved that samples contradict."""

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.reach.compiled import compile_mode
from modegraph.reach.tail.decay import DecayRegion, Norm, SettledLoop


def settled(field: Any, n: int, w: mg.Box | None = None, unknowns: Any = None, constraints: Any = None) -> SettledLoop:
    plant = mg.System(field, states=n, inputs="none", disturbance=w, unknowns=unknowns)
    mode = mg.Mode(
        "m",
        plant,
        controller=lambda x: 0.0,
        reference=mg.setpoint([0.0]),
        start=mg.Ball(np.zeros(n), 0.1),
        constraints=constraints,
    )
    c = compile_mode(mode, mode.reference.parameters()[0])
    d = np.array(list(c.unknowns.values()), float).reshape(-1, 2)
    return SettledLoop(c.fields[-1], c.w_centre, c.w_radius, d[:, 0], d[:, 1])


def round_norm(n: int, scale: float = 1.0) -> Norm:
    norm = Norm.of(np.zeros(n), scale * np.eye(n))
    assert norm is not None
    return norm


def test_a_linear_loop_decays_at_its_rate_and_no_faster() -> None:
    # V = x^2 + y^2, V' = -2 x^2 - 3 y^2 <= -2 V.
    loop = settled(lambda x: np.array([-x[0], -1.5 * x[1]]), 2)
    region = DecayRegion(loop, round_norm(2), 1.0)
    assert region.negative(1.999 * np.eye(2))
    assert not region.negative(2.001 * np.eye(2))


@pytest.mark.parametrize("radius, holds", [(0.5, True), (0.95, True), (1.0, False), (1.1, False)])
def test_a_cubic_spring_decays_inside_its_unstable_points(radius: float, holds: bool) -> None:
    # x' = -x + x^3 / 3: the Jacobian -1 + x^2 is negative exactly for |x| < 1.
    loop = settled(lambda x: np.array([-x[0] + x[0] ** 3 / 3.0]), 1)
    assert DecayRegion(loop, round_norm(1), radius).negative(np.zeros((1, 1))) is holds


def test_unknowns_and_disturbances_in_the_jacobian_count_at_their_worst() -> None:
    # x' = -(d + w) x, d in [1, 2], |w| <= .5: the slowest rate is .5.
    loop = settled(lambda x, w, d: np.array([-(d["d"] + w[0]) * x[0]]), 1, mg.Box([-0.5], [0.5]), {"d": (1.0, 2.0)})
    region = DecayRegion(loop, round_norm(1), 1.0)
    assert region.negative(np.array([[0.99]]))
    assert not region.negative(np.array([[1.01]]))


def test_where_the_loop_is_not_defined_nothing_decays() -> None:
    loop = settled(lambda x: np.array([-x[0] + np.log(1.0 + x[0])]), 1)
    assert not DecayRegion(loop, round_norm(1), 1.5).negative(np.array([[-10.0]]))


def test_the_push_holds_the_rate_at_the_centre() -> None:
    loop = settled(
        lambda x, w, d: np.array([-x[0] + d["d"] * w[0] ** 2, w[0] - x[1]]), 2, mg.Box([-1.0], [2.0]), {"d": (1.0, 3.0)}
    )
    found = loop.push(np.zeros(2))
    assert found is not None
    columns, box = found
    reach = np.abs(columns).sum(axis=0) + box
    for d in (1.0, 2.0, 3.0):
        for w in np.linspace(-1.0, 2.0, 13):
            assert (np.abs([d * w * w, w]) <= reach).all()
    assert (reach <= [30.0, 2.1]).all()


@pytest.mark.parametrize("seed", range(6))
def test_no_proof_against_a_sample(seed: int) -> None:
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(3, 3)) - 2.0 * np.eye(3)
    b, c = rng.normal(size=3), rng.normal(size=3)

    def field(x: Any) -> Any:
        return A @ x + np.sin(x[0] * x[1]) * b + x[2] * np.cos(x[1]) * c

    loop = settled(field, 3)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0] * np.exp(0.3 * rng.normal(size=3))
    norm = Norm.of(np.zeros(3), axes)
    assert norm is not None
    region = DecayRegion(loop, norm, 0.7)
    xi = rng.normal(size=(4000, 3))
    xi /= np.linalg.norm(xi, axis=1)[:, None]
    x = 0.7 * (xi * rng.uniform(size=(4000, 1)) ** 0.3) @ axes.T
    worst = -np.inf
    for point in x:
        u, v = np.cos(point[0] * point[1]), np.cos(point[1])
        J = A + np.outer(b, u * np.array([point[1], point[0], 0.0]))
        J = J + np.outer(c, [0.0, -point[2] * np.sin(point[1]), v])
        K = np.linalg.solve(axes, J @ axes)
        worst = max(worst, float(np.linalg.eigvalsh(K + K.T).max()))
    assert not region.negative(-(worst - 1e-9) * np.eye(3))
    assert region.negative(-(worst + 0.1 * abs(worst) + 0.2) * np.eye(3))


@pytest.mark.parametrize("c, holds", [(0.03, True), (0.06, False)])
def test_what_a_polynomial_misses_counts(c: float, holds: bool) -> None:
    # The Jacobian -1 + c exp(3 x) changes sign in |x| <= 1 from c = .0498 on; its cubic, from c = .077 on.
    loop = settled(lambda x: np.array([-x[0] + c / 3.0 * (np.exp(3.0 * x[0]) - 1.0)]), 1)
    assert DecayRegion(loop, round_norm(1), 1.0).negative(np.zeros((1, 1))) is holds
