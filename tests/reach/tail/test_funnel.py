"""Funnels: every sampled trajectory sinks as fast as promised."""

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.reach.tail.funnel import Funnel, FunnelBuilder, NoFunnel, Rung, usable
from tests.reach.tail.test_decay import round_norm, settled


def ring(n: int, radius: float, count: int = 60) -> np.ndarray[Any, Any]:
    points = np.random.default_rng(0).normal(size=(count, n))
    return radius * points / np.linalg.norm(points, axis=1)[:, None]


def build(loop: Any, points: Any, **kwargs: Any) -> Funnel | NoFunnel:
    enough = kwargs.get("enough", lambda s: False)
    return FunnelBuilder(loop).build(points, np.abs(points).max(axis=0), enough)


def rung(alpha: float = 1.0, mu: float = 0.01, faces: Any = (), power: float = 0.0) -> Rung:
    return Rung(round_norm(1), 1.0, 0.5, alpha, mu, np.array(faces, float), power, np.zeros(0))


def test_times_of_a_rung_are_those_of_the_comparison_equation() -> None:
    r = rung()
    # V' = -V + .01 from 1 to .25.
    exact = np.log((1.0 - 0.01) / (0.25 - 0.01))
    assert exact <= r.seconds(1.0, 0.5) <= exact * (1.0 + 1e-6)
    after = np.sqrt(0.01 + 0.99 * np.exp(-0.7))
    assert after <= r.after(1.0, 0.7) <= after * (1.0 + 1e-6)
    assert r.seconds(1.0, 0.1) == np.inf
    assert r.seconds(0.3, 0.5) == 0.0


@pytest.mark.parametrize("size", [0.4, 0.8])
def test_trajectories_sink_as_promised(size: float) -> None:
    def field(x: Any, w: Any) -> Any:
        return np.array([x[1], -np.sin(x[0]) - 1.2 * x[1] + w[0]])

    loop = settled(field, 2, mg.Box([-0.05], [0.05]))
    funnel = build(loop, ring(2, size))
    assert isinstance(funnel, Funnel)
    rng = np.random.default_rng(1)
    first = funnel.rungs[0]
    xi = rng.normal(size=(400, 2))
    x = first.norm.centre + first.radius * (xi / np.linalg.norm(xi, axis=1)[:, None]) @ first.norm.axes.T
    h = 0.002
    for r in funnel.rungs:
        quadric = np.linalg.inv(r.norm.axes)
        assert (np.linalg.norm((x - r.norm.centre) @ quadric.T, axis=1) <= r.radius * (1.0 + 1e-6)).all()
        duration = r.seconds(r.radius, r.lower)
        for _ in range(int(np.ceil(duration / h))):
            # The disturbance pushes outward in the norm of the rung, as hard as it may.
            grad = ((x - r.norm.centre) @ quadric.T) @ quadric
            w = 0.05 * np.sign(grad[:, 1])
            k1 = np.array([x[:, 1], -np.sin(x[:, 0]) - 1.2 * x[:, 1] + w]).T
            y = x + 0.5 * h * k1
            x = x + h * np.array([y[:, 1], -np.sin(y[:, 0]) - 1.2 * y[:, 1] + w]).T
        assert (np.linalg.norm((x - r.norm.centre) @ quadric.T, axis=1) <= r.lower * (1.0 + 1e-4)).all()


def test_no_funnel_around_a_saddle_or_beyond_the_basin() -> None:
    assert isinstance(build(settled(lambda x: np.array([x[0], -x[1]]), 2), ring(2, 0.1)), NoFunnel)
    cubic = settled(lambda x: np.array([-x[0] + x[0] ** 3]), 1)
    assert isinstance(build(cubic, np.linspace(-1.05, 1.05, 21)[:, None]), NoFunnel)
    assert isinstance(build(cubic, np.linspace(-0.5, 0.5, 21)[:, None]), Funnel)


def test_the_floor_is_no_lower_than_what_the_disturbance_can_hold() -> None:
    # x' = -x + w, |w| <= .1: the disturbance keeps |x| = .1 for ever.
    loop = settled(lambda x, w: np.array([-x[0] + w[0]]), 1, mg.Box([-0.1], [0.1]))
    funnel = build(loop, np.linspace(-1.0, 1.0, 21)[:, None])
    assert isinstance(funnel, Funnel)
    lo, hi = funnel.end.box()
    assert hi[0] > 0.1
    assert lo[0] < -0.1
    assert hi[0] < 0.2


GOOD, BAD, UNBOUNDED = rung(faces=(-1.0, 0.0)), rung(faces=(-1.0, 1e-9)), rung(power=np.inf)
UNDEFINED = rung(faces=(np.nan,))


@pytest.mark.parametrize(
    "rungs, kept",
    [
        ([GOOD, GOOD], slice(0, 2)),
        ([BAD, UNBOUNDED, UNDEFINED, GOOD, GOOD], slice(3, 5)),
        ([GOOD, BAD, GOOD], slice(0, 1)),
        ([UNBOUNDED, GOOD, GOOD, UNDEFINED, GOOD], slice(1, 3)),
        ([BAD, UNBOUNDED], slice(0, 0)),
        ([], slice(0, 0)),
    ],
)
def test_a_funnel_ends_before_a_rung_that_breaks_a_constraint(rungs: list[Rung], kept: slice) -> None:
    found = usable(rungs)
    assert len(found) == len(rungs[kept])
    assert all(a is b for a, b in zip(found, rungs[kept], strict=True))


def test_a_later_norm_may_reach_further_than_the_one_before() -> None:
    A = np.array([[-2.0, 3.5], [0.1, -0.7]])

    def built(constraints: Any) -> Funnel:
        loop = settled(lambda x, w: A @ x + np.array([w[0], 0.0]), 2, mg.Box([-0.02], [0.02]), None, constraints)
        funnel = build(loop, ring(2, 0.5))
        assert isinstance(funnel, Funnel)
        return funnel

    free = built(None)
    tops = [float(free.ball(k, r.radius).box()[1][0]) for k, r in enumerate(free.rungs)]
    gap = next(k for k in range(1, len(tops)) if tops[k] > 1.01 * min(tops[:k]))
    limit = 1.005 * tops[gap - 1]
    first = next(k for k, top in enumerate(tops) if top < limit)
    bound = built(lambda x: {"side": x[0] <= limit})
    assert len(bound.rungs) == gap - first
    assert all((r.face_upper <= 0.0).all() for r in bound.rungs)


def test_enough_ends_the_search() -> None:
    loop = settled(lambda x: np.array([-x[0]]), 1)
    short = build(loop, np.linspace(-1.0, 1.0, 21)[:, None], enough=lambda s: True)
    long = build(loop, np.linspace(-1.0, 1.0, 21)[:, None])
    assert isinstance(short, Funnel)
    assert isinstance(long, Funnel)
    assert len(short.rungs) == 1 < len(long.rungs)
