"""The reference as model functions see it."""

from __future__ import annotations

import numpy as np
import pytest

from modegraph.expression import Graph
from modegraph.model.traced_reference import TracedReference, fixed


@pytest.fixture
def reference() -> TracedReference:
    graph = Graph()
    names = graph.variables([f"{part}{k}" for part in ("r", "v", "a") for k in range(3)])
    return TracedReference.of(names[:3], names[3:6], names[6:], graph.variables("p"))


def test_a_slice_keeps_the_derivatives_of_what_is_left(reference: TracedReference) -> None:
    part = reference[1:]
    assert [e.text() for e in (*part, *part.dot, *part.ddot)] == ["r1", "r2", "v1", "v2", "a1", "a2"]
    assert part.p[0].text() == "p"
    assert [e.text() for e in part[::-1].dot] == ["v2", "v1"]
    assert reference[0].text() == "r0"


def test_arithmetic_has_no_derivatives(reference: TracedReference) -> None:
    assert not hasattr(2.0 * reference, "dot") or "dot" not in (2.0 * reference).__dict__
    assert (reference + reference.dot)[0].text() == "r0 + v0"


def test_it_cannot_be_changed(reference: TracedReference) -> None:
    for array in (reference, reference.dot, reference.p, fixed(np.ones(2))):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
