"""Boxes around generators."""

import numpy as np
import pytest

from modegraph.reach.framing import generator_box, thinned


@pytest.mark.parametrize("seed", range(5))
def test_thinned_generators_hold_the_same_sets(seed: int) -> None:
    rng = np.random.default_rng(seed)
    G = rng.normal(size=(7, 3, 15)) * np.exp(rng.normal(size=15))
    few = thinned(G, 4)
    assert few.shape == (10, 3, 4)
    # For every row and any coefficients the range over all zeta and xi in the unit box is no smaller.
    for row in (*np.eye(3), *rng.normal(size=(20, 3))):
        assert np.abs(few.transpose(0, 2, 1) @ row).sum() >= np.abs(G.transpose(0, 2, 1) @ row).sum()
    assert (generator_box(few) >= generator_box(G) * (1.0 - 1e-15)).all()
    assert thinned(G, 8) is G
    assert (thinned(G, 0)[:, :, 0] == np.diag(generator_box(G))).all()
