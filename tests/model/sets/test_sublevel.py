"""Sublevel sets: exact membership, proved boxes around them, dimension taken from their use."""

import numpy as np
import pytest

import modegraph as mg
from modegraph.errors import ModegraphError
from modegraph.model.sets import Ball, Box, Ellipsoid, Sublevel, is_subset
from modegraph.model.sets.scaled import scaled


def disc(level=1.0, **more):
    return Sublevel(lambda x: x @ x, level, **more)


ANNULUS = Sublevel(lambda x: (x[0] ** 2 + x[1] ** 2 - 1) ** 2, 0.04)
SPIKE = Sublevel(lambda x: np.maximum(np.abs(x[0]) * (1 + 1e4 * np.maximum(x[1], 0)) - 1, np.abs(x[1]) - 1), 0.0)
PENDULUM = Sublevel(lambda x: np.maximum(1 - np.cos(x[0]) + 0.5 * x[1] ** 2 - 0.5, np.abs(x[0]) - 3), 0.0)
NORM = Sublevel(lambda x: np.linalg.norm(x - np.array([5.0, 1.0])), 0.1, dim=2)
SETS = {"annulus": ANNULUS, "spike": SPIKE, "pendulum": PENDULUM, "norm": NORM, "disc": disc(dim=2)}


@pytest.mark.parametrize("region", SETS.values(), ids=SETS)
def test_what_every_set_offers(region):
    assert region.dim == 2
    assert region.contains(region.center)
    assert not region.is_empty()
    assert region.is_bounded()
    points = region.sample(40, seed=3)
    assert points.shape == (40, 2)
    assert all(region.contains(x) for x in points)
    assert np.array_equal(points, region.sample(40, seed=3))
    lo, hi = region.bounding_box()
    assert ((lo <= points) & (points <= hi)).all()
    assert not region.contains([np.nan, 0.0])
    assert region.plot(dims=(0, 1)) is not None
    assert repr(region).startswith("Sublevel(")
    assert len({region, region, Sublevel(region.fn, region.level, 2)}) == 1
    with pytest.raises(ModegraphError, match="length 2"):
        Sublevel(region.fn, region.level, 2).contains([0.0, 0.0, 0.0])


def test_membership_is_exact_at_the_boundary():
    assert disc(1.0).contains([1.0, 0.0])
    assert not disc(1.0).contains([1.0, 1e-30])
    assert not disc(1.0).contains([np.nextafter(1.0, 2.0), 0.0])
    # The double 0.1 is above one tenth, and so is three times it above 0.3.
    assert not Sublevel(lambda x: x[0] + x[0] + x[0], 0.3).contains([0.1])
    assert Sublevel(lambda x: np.sin(x[0]), 0.0).contains([0.0])
    assert not Sublevel(lambda x: np.sin(x[0]) + 1e-300, 0.0).contains([0.0])
    assert Sublevel(lambda x: np.exp(x[0]), 2.8).contains([1.0])
    assert not Sublevel(lambda x: np.exp(x[0]), 2.7).contains([1.0])


def test_a_point_where_fn_is_undefined_is_not_in_the_set():
    assert not Sublevel(lambda x: -1 / x[0], 0.0).contains([0.0])
    assert not Sublevel(lambda x: x[0] / x[0], 2.0).contains([0.0])
    assert not Sublevel(lambda x: np.log(x[0]), 0.0).contains([-1.0])
    assert not is_subset(Box([-1.0], [1.0]), Sublevel(lambda x: x[0] / x[0], 2.0, dim=1))
    assert is_subset(Box([0.5], [1.0]), Sublevel(lambda x: x[0] / x[0], 2.0, dim=1))


@pytest.mark.parametrize("region", SETS.values(), ids=SETS)
def test_the_box_holds_the_set_and_is_near_it(region):
    lo, hi = region.bounding_box()
    rng = np.random.default_rng(0)
    grid = rng.uniform(2 * lo - hi, 2 * hi - lo, (20000, 2))
    inside = grid[region.function.values(grid) <= region.level]
    assert ((lo <= inside) & (inside <= hi)).all()
    assert ((inside.max(axis=0) - inside.min(axis=0)) >= 0.85 * (hi - lo)).all() or region is SPIKE


def test_the_thin_spike_is_not_lost():
    _, hi = SPIKE.bounding_box()
    assert hi[1] >= 1.0
    assert SPIKE.contains([0.0, 1.0])
    cells = SPIKE.hull_within(np.array([-1.0, 0.9]), np.array([1.0, 1.0]))
    assert cells is not None
    assert cells[1][0] < 0.2
    assert cells[0][0] <= -1 / 9001 <= 1 / 9001 <= cells[1][0]


def test_quadratic_boxes_are_exact():
    assert [side.tolist() for side in disc(1.0, dim=3).bounding_box()] == [[-1.0] * 3, [1.0] * 3]
    P = np.array([[2.0, 1.2], [1.2, 1.0]])
    tilted = Sublevel(lambda x: (x - 1) @ np.linalg.inv(P) @ (x - 1), 1.0, dim=2)
    _, hi = tilted.bounding_box()
    assert hi == pytest.approx(1 + np.sqrt([2.0, 1.0]), rel=1e-12)
    inner, outer = tilted.ellipsoids
    assert inner.shape == pytest.approx(P, rel=1e-9)
    for x in outer.sample(50, seed=1):
        assert tilted.contains(1 + (x - 1) * (1 - 1e-9))
    for x in inner.sample(50, seed=1):
        assert tilted.contains(x)
    assert ANNULUS.ellipsoids is None


@pytest.mark.parametrize(
    "fn", [lambda x: x[0] * x[1], lambda x: x[0], lambda x: np.sin(x[0]) + x[1] ** 2, lambda x: (x[0] - x[1]) ** 2]
)
def test_unbounded_sets_say_what_to_do(fn):
    region = Sublevel(fn, 0.5, dim=2)
    assert not region.is_bounded()
    with pytest.raises(ModegraphError, match=r"intersect it with a box"):
        region.bounding_box()
    assert all(region.contains(x) for x in region.sample(5, seed=0))
    cut = Sublevel(lambda x: np.maximum(fn(x) - 0.5, np.max(np.abs(x) - 2.0)), 0.0, dim=2)
    assert cut.is_bounded()
    assert cut.bounding_box()[1].max() <= 2.0


def test_bounded_in_all_seen_parts_but_not_far_away():
    # Above the level for 2 <= |x| <= 1e6, and below it again far beyond.
    region = Sublevel(lambda x: np.minimum(x[0] ** 2, 1e14 - x[0] ** 2), 1.0, dim=1)
    assert not region.is_bounded()


def test_inclusion_is_proved_or_denied():
    assert is_subset(Box([-0.7, -0.7], [0.7, 0.7]), disc(1.0, dim=2))
    assert not is_subset(Box([-0.71, -0.71], [0.71, 0.71]), disc(1.0, dim=2))
    assert is_subset(disc(1.0, dim=2), Box([-1, -1], [1, 1]))
    assert not is_subset(disc(1.0, dim=2), Box([-1, -1], [1, 0.99]))
    assert is_subset(disc(1.0, dim=2), disc(1.5, dim=2))
    assert not is_subset(disc(1.5, dim=2), disc(1.0, dim=2))
    # The gap of the annulus is inside the box around its lobes.
    assert not is_subset(Box([-1.0, 0.0], [1.0, 0.0]), ANNULUS)
    assert is_subset(Box([0.95, -0.05], [1.04, 0.05]), ANNULUS)


def test_dimension_comes_from_fn_or_from_use():
    with pytest.raises(ModegraphError, match="dim="):
        disc().dim  # noqa: B018
    region = disc()
    region.settle(3)
    assert region.dim == 3
    fixed = Sublevel(lambda x: x[0] + x[3], 0.0)
    assert fixed.dim == 4
    with pytest.raises(ModegraphError, match="out of bounds"):
        fixed.settle(2)


@pytest.mark.parametrize(
    "make, match",
    [
        (lambda: Sublevel(3.0, 1.0), "function of x"),
        (lambda: Sublevel(lambda x: x[0], [1.0, 2.0]), "one number"),
        (lambda: Sublevel(lambda x: x[0], np.inf), "finite"),
        (lambda: Sublevel(lambda x: x[0], 1.0, dim=0), "dim"),
        (lambda: Sublevel(lambda x: x, 1.0, dim=2).center, "one number"),
        (lambda: Sublevel(lambda y: y[0], 1.0, dim=2).center, "'y'"),
        (lambda: disc(-1.0, dim=2).sample(3), "no point"),
    ],
)
def test_errors_name_what_is_wrong(make, match):
    with pytest.raises(ModegraphError, match=match):
        make()


def mode(start):
    plant = mg.System(lambda x, u: u, states=2, inputs=2)
    return mg.Mode("glide", plant, controller=lambda x: -x, reference=mg.setpoint([0.0]), start=start)


@pytest.mark.parametrize(
    "start, match",
    [
        (lambda r: disc(-1.0), r"mode 'glide': the start set is empty.*level"),
        (disc(-1.0), r"mode 'glide': the start set is empty"),
        (lambda r: Sublevel(lambda x: x[0], 0.0), r"mode 'glide': the start set is not proved to be bounded.*box"),
        (lambda r: Sublevel(lambda x: x[2], 0.0), r"mode 'glide', start"),
        (disc(1.0, dim=3), r"mode 'glide': the start set has 3 coordinates"),
    ],
)
def test_wrong_starts_are_errors_at_build(start, match):
    with pytest.raises(ModegraphError, match=match):
        mg.build([mode(start)])


def test_wrong_targets_are_errors_at_build():
    good = mode(mg.Ball([0, 0], 1.0))
    with pytest.raises(ModegraphError, match=r"target 'home': the set is empty"):
        mg.build([good, mg.Target("home", disc(-1.0))])
    with pytest.raises(ModegraphError, match=r"target 'home'"):
        mg.build([good, mg.Target("home", Sublevel(lambda x: x[5], 1.0))])


SHAPES = [
    Ball([0.1, 2.0], 0.3),
    Box([0.1, -2.0], [0.7, 1.0]),
    Ellipsoid([0.1, 2.0], [[2.0, 1.2], [1.2, 1.0]]),
    mg.Zonotope([0.1, 2.0], [[1.0, 0.3, 0.1], [0.2, 0.7, 0.3]]),
    mg.Polytope([[1, 0], [-1, 0.1], [0, 1], [0.3, -1]], [1, 1, 1, 1.5]),
    Sublevel(lambda x: (x[0] - 0.3) ** 2 + x[1] ** 4, 0.4),
]


@pytest.mark.parametrize("shape", SHAPES, ids=lambda s: type(s).__name__)
@pytest.mark.parametrize("factor", [0.3, 1.0, 7.1])
def test_scaling_is_about_the_centre_and_never_too_small(shape, factor):
    c = np.asarray(shape.chebyshev[0] if isinstance(shape, mg.Polytope) else shape.center)
    large = scaled(shape, factor)
    for x in shape.sample(60, seed=2):
        assert large.contains(c + (x - c) * factor * (1 - 1e-9))
    for x in large.sample(60, seed=2):
        assert shape.contains(c + (x - c) / factor * (1 - 1e-6))
