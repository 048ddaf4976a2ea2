"""Bounds of what is observed along a step."""

import numpy as np
import pytest

import modegraph as mg
from modegraph.enclosure.monomials import monomials
from modegraph.enclosure.observe import observed_bounds
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.start.piece import whole

TABLE = monomials((1, 1), 2)
BOUNDS = PolynomialBounds(whole(mg.Box([-1.0, -1.0], [1.0, 1.0]), []), TABLE, TABLE.size)
FACES = 2


def ends() -> np.ndarray:
    """Two faces, the energy, and an error: at the start, at the end, and on average."""
    values = np.zeros((3, FACES + 2, TABLE.size))
    values[0, 0, :3], values[1, 0, :3] = (-3.0, 1.0, 0.5), (-2.0, 1.0, 0.5)
    values[0, 1, 0] = values[1, 1, 0] = -1.0
    values[0, 3, 0], values[1, 3, 0] = 0.25, -4.0
    return values


def test_the_worse_end_counts_and_errors_have_two_sides() -> None:
    slack = np.full((FACES + 2, 2), 0.125)
    upper, sizes = observed_bounds(ends(), slack, np.int64(FACES), *BOUNDS.arrays)
    assert upper == pytest.approx([-2.0 + 1.5 + 0.125, -1.0 + 0.125], rel=1e-12)
    assert (upper >= [-0.375, -0.875]).all()
    assert sizes == pytest.approx([4.125], rel=1e-12)
    assert sizes[0] >= 4.125


@pytest.mark.parametrize("output", [0, 1, 3])
@pytest.mark.parametrize("where", ["start", "end", "slack"])
def test_what_is_no_number_has_no_bound(output: int, where: str) -> None:
    values, slack = ends(), np.full((FACES + 2, 2), 0.125)
    if where == "slack":
        slack[output, 0] = np.nan
    else:
        values[0 if where == "start" else 1, output, 1] = np.nan
    upper, sizes = observed_bounds(values, slack, np.int64(FACES), *BOUNDS.arrays)
    found = [*upper, np.nan, *sizes]
    assert found[output] == np.inf
    assert np.isfinite([found[k] for k in (0, 1, 3) if k != output]).all()
