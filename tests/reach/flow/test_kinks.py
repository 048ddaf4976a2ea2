"""When samples pass kinks, where that is known in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np

import modegraph as mg
from modegraph.reach.compiled import compile_mode
from modegraph.reach.flow.kinks import Kinks, Passage

LATE = 0.25


def passages(dynamics: Any, x: np.ndarray, longest: float = 9.0, step: float = 0.05) -> list[Passage] | None:
    plant = mg.System(dynamics, states=len(x), inputs="none")
    start = mg.Box([-1.0] * len(x), [1.0] * len(x))
    mode = mg.Mode("m", plant, controller=lambda x: 0.0, reference=mg.setpoint([0.0]), start=start)
    fld = compile_mode(mode, None, observed=False).fields[0]
    found = Kinks(fld).passages(x, np.zeros((fld.variables - len(x), x.shape[1])), step, longest, LATE)
    return None if found is None else list(found)


def row(*values: float) -> np.ndarray:
    return np.array([values])


def test_a_falling_level_meets_its_kink_at_its_height() -> None:
    """x' = -1 - max(x, 0) from x0: x0 + 1 = exp(t) at the kink."""
    x = row(0.5, 1.0, 1.5)
    found = passages(lambda x: -1.0 - np.maximum(x, 0.0), x)
    assert found is not None
    assert len(found) == 1
    np.testing.assert_allclose(found[0].seconds, np.log(1.0 + x[0]), atol=1e-7)


def test_two_kinks_in_one_order() -> None:
    """The first starts meet the second kink before the last ones meet the first."""
    field = lambda x: -1.0 - 0.0 * x + np.maximum(x - 1.0, 0.0) * 1e-9 + np.maximum(x, 0.0) * 1e-9
    x = row(1.2, 1.9, 2.6)
    found = passages(field, x)
    assert found is not None
    assert len(found) == 2
    np.testing.assert_allclose(found[0].seconds, x[0] - 1.0, atol=1e-7)
    np.testing.assert_allclose(found[1].seconds, x[0], atol=1e-7)


def test_an_absolute_value_and_its_opposite_have_one_kink() -> None:
    field = lambda x: -1.0 + 1e-9 * np.abs(x) + 1e-9 * np.maximum(-2.0 * x, 0.0)
    found = passages(field, row(0.5, 1.0))
    assert found is not None
    assert len(found) == 1


def test_none_where_only_some_pass() -> None:
    fall = lambda x: -1.0 - np.maximum(x, 0.0)
    assert passages(fall, row(-0.5, 0.5)) is None
    assert passages(fall, row(0.5, 50.0), longest=1.0) is None
    # A swing that turns back: the slow ones stay below 1.
    swing = lambda x: np.array([x[1], -x[0] - np.maximum(x[0] - 1.0, 0.0)])
    assert passages(swing, np.array([[0.0, 0.0], [0.9, 1.5]])) is None


def test_none_where_the_order_differs() -> None:
    field = lambda x: np.array([-1.0 - np.maximum(x[0], 0.0), -1.0 - np.maximum(x[1], 0.0)])
    assert passages(field, np.array([[0.5, 1.0], [1.0, 0.5]])) is None
