"""Start sets of a class as inequalities: membership, inner and outer numbers, what cannot be a target."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from modegraph.certify.targets.family import TargetClass, target_class
from tests.certify.class_graphs import one_integrator

REGION = mg.Box([-1.0, 0.0], [1.0, 2.0])
CASES = {
    "ball": lambda r: mg.Ball(r + 1.0, 0.3),
    "growing ball": lambda r: mg.Ball(r, 0.2 + 0.1 * r[1]),
    "box": lambda r: mg.Box([r[0] - 0.1, r[0] * r[1] - 0.2], [r[0] + 0.3, r[0] * r[1] + 0.2]),
    "ellipsoid": lambda r: mg.Ellipsoid([r[1], r[0]], [[0.04, 0.01], [0.01, 0.09]]),
    "zonotope": lambda r: mg.Zonotope(2.0 * r, [[0.2, 0.1], [0.0, 0.3]]),
    "one set for all": lambda r: mg.Ball([0.5, 0.5], 0.4),
}


def inside(target: TargetClass, p: np.ndarray, x: np.ndarray, outer: bool) -> np.ndarray:
    centre, radius, limits = target.at(p, outer=outer)
    y = (x - centre) @ target.rows.T
    off = radius @ np.abs(target.rows).T
    if outer:
        off = -off
    if target.round:
        return np.asarray(np.sqrt(((np.abs(y) + off) ** 2).sum(axis=1)) * target.grow <= limits[:, 0])
    return np.asarray((y + off <= limits).all(axis=1))


@pytest.mark.parametrize("start", CASES.values(), ids=CASES)
def test_inner_numbers_are_inside_and_outer_ones_outside(start: Any) -> None:
    mode = one_integrator(lambda r: r, start, REGION, "target")
    target = target_class(mode, None, 2)
    rng = np.random.default_rng(3)
    p = rng.uniform(REGION.lo, REGION.hi, (300, 2))
    sets = [start(v) for v in p]
    x = np.array([s.sample(1, seed=k)[0] for k, s in enumerate(sets)]) + rng.normal(size=(300, 2)) * 0.15
    true = np.array([s.contains(v) for s, v in zip(sets, x, strict=True)])
    inner, outer = inside(target, p, x, False), inside(target, p, x, True)
    assert not (inner & ~true).any()
    assert not (true & ~outer).any()
    # A few points in a million are closer to the boundary than the rounding allowed for.
    assert (inner == true).all()
    assert 30 < true.sum() < 290


def test_a_centre_is_affine_only_where_the_size_is_fixed_too() -> None:
    region = mg.Box([-1.0, -1.0], [1.0, 1.0])
    straight = target_class(one_integrator(lambda r: r, lambda r: mg.Ball(2.0 * r + 1.0, 0.1), region, "a"), None, 2)
    assert straight.affine is not None
    assert straight.affine[0] == pytest.approx([1.0, 1.0])
    assert straight.affine[1] == pytest.approx(2.0 * np.eye(2))
    growing = target_class(one_integrator(lambda r: r, lambda r: mg.Ball(r, 1.5 + r[0]), region, "b"), None, 2)
    assert growing.affine is None
    fixed = target_class(one_integrator(lambda r: r, lambda r: mg.Ball([0.0, 0.0], 1.0), region, "c"), None, 2)
    assert fixed.affine is not None
    assert fixed.affine[1].shape == (2, 2)


def test_sets_that_have_no_such_form_are_refused_by_name() -> None:
    region = mg.Box([-1.0, -1.0], [1.0, 1.0])
    turning = one_integrator(lambda r: r, lambda r: mg.Zonotope(r, [[0.2, 0.1 * r[0]], [0.0, 0.3]]), region, "turning")
    with pytest.raises(mg.ModegraphError, match=r"'turning'.*Zonotope"):
        target_class(turning, None, 2)
    level = mg.Target("level", mg.Sublevel(lambda x: x[0] ** 4 + x[1] ** 2, 1.0))
    with pytest.raises(mg.ModegraphError, match=r"'level'.*Sublevel"):
        target_class(level, None, 2)
