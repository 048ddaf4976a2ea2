"""Which arguments a function touched."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from modegraph.errors import ModegraphError
from modegraph.expression.namespace import tracing
from modegraph.expression.scalar import Graph
from modegraph.expression.trace import as_vector
from modegraph.expression.watched import WatchedArray, WatchedConstants


def unpacked(w: Any) -> Any:
    return [0 * entry for entry in w]


@pytest.mark.parametrize(
    ("use", "touched"),
    [
        (lambda w: 1.0, set()),
        (len, set()),
        (lambda w: as_vector(w, 3, role="", owner="", graph=w[0].graph), {0, 1, 2}),
        (lambda w: np.array([[w, w]]), {0, 1, 2}),
        (lambda w: w.shape, set()),
        (lambda w: 0 * w[1], {1}),
        (lambda w: 0 * w[-1], {2}),
        (lambda w: 0 * w[:2], {0, 1}),
        (lambda w: 0 * w[[0, 2]], {0, 2}),
        (lambda w: 0 * w[np.array([True, False, True])], {0, 2}),
        (lambda w: np.zeros((1, 3)) @ w, {0, 1, 2}),
        (lambda w: 0 * w, {0, 1, 2}),
        (lambda w: np.concatenate([w, w]), {0, 1, 2}),
        (lambda w: np.where(w > 0, 0, 0), {0, 1, 2}),
        (lambda w: w.reshape(3, 1), {0, 1, 2}),
        (lambda w: 0 * w.copy()[1], {1}),
        (unpacked, {0, 1, 2}),
    ],
)
def test_entries_and_the_whole(use: Callable[[Any], Any], touched: set[int]) -> None:
    seen: set[int] = set()
    with tracing():
        use(WatchedArray.of(Graph().variables(["a", "b", "c"]), seen))
    assert seen == touched


def test_it_cannot_be_changed_in_place() -> None:
    w = WatchedArray.of(Graph().variables(["a"]), set())
    with pytest.raises(ValueError, match="read-only"):
        w[0] = 1.0


def test_constants() -> None:
    graph = Graph()
    d = WatchedConstants(
        {"m": graph.variable("m"), "k": graph.variable("k")}, lambda name: ModegraphError(f"no {name}")
    )
    assert ("m" in d, "c" in d, len(d), list(d)) == (True, False, 2, ["m", "k"])
    assert d.touched == set()
    _ = 0 * d["m"]
    assert d.touched == {"m"}
    with pytest.raises(ModegraphError, match="no c"):
        d["c"]
    assert dict(**d).keys() == {"m", "k"}
    assert d.touched == {"m", "k"}
