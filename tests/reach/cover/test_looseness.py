"""How much of a flowpipe is its remainder."""

from __future__ import annotations

import numpy as np

from modegraph.reach.compiled import compile_mode
from modegraph.reach.cover.chain import Chain
from modegraph.reach.cover.looseness import is_loose, is_very_loose, looseness, remainder
from modegraph.reach.flow.flow import Order
from tests.soundness.families import oscillator


def chain_of(degree: int, until: float) -> Chain:
    compiled = compile_mode(oscillator().mode, None, observed=False)
    chain = Chain(compiled, compiled.whole(), Order(degree, 2))
    chain.run(until)
    return chain


def test_of_a_class_the_width_of_one_reference_counts() -> None:
    """The class alone makes x(0) = r0 r1 vary by .5; the zonotope of the middle reference has other radii."""
    chain = chain_of(3, 1e-9)
    _, own = remainder(chain)
    np.testing.assert_allclose(own, [0.1 + 0.05 * 0.75, 0.12 + 0.005], rtol=1e-6)


def test_low_degrees_are_loose() -> None:
    tight, loose = chain_of(6, 0.3), chain_of(2, 1.0)
    assert looseness(tight) < 0.05 < looseness(loose)
    assert not is_loose(tight)
    assert is_loose(loose)
    assert is_very_loose(loose) == (looseness(loose) > 0.25)
    failed = chain_of(2, 30.0)
    assert failed.failure
    assert looseness(failed) == np.inf
