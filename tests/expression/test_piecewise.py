"""Resolving piecewise signals between breakpoints."""

import numpy as np
import pytest

from modegraph.expression import Expr, Graph, resolve, unresolved


def signal(t: Expr) -> list[Expr]:
    return [
        np.where(t < 1, t * t, 3.0),
        np.maximum(t - 1, 0.0),
        abs(2 * t - 2),
        np.sign(t - 1),
        np.clip(t, 0.0, 1.0),
    ]


@pytest.mark.parametrize(
    ("lo", "hi", "texts"),
    [
        (0.0, 1.0, ["t**2", "0", "-(2*t - 2)", "-1", "t"]),
        (1.0, float("inf"), ["3", "t - 1", "2*t - 2", "1", "1"]),
    ],
)
def test_branches(lo: float, hi: float, texts: list[str]) -> None:
    t = Graph().variable("t")
    resolved = resolve(signal(t), t, lo, hi)
    assert [e.text() for e in resolved] == texts
    assert unresolved(resolved, t) == []


def test_straddling_stays() -> None:
    t = Graph().variable("t")
    exprs = signal(t)
    left = resolve(exprs, t, 0.0, 2.0)
    assert all(a.same(b) for a, b in zip(left[:4], exprs[:4], strict=True))
    assert unresolved(left, t)


def test_ends_are_exact() -> None:
    t = Graph().variable("t")
    just_above = float(np.nextafter(0.1, 1))
    e = np.where(t < 0.1, 1.0, 2.0)
    assert resolve([e], t, 0.0, 0.1)[0].value == 1
    assert not resolve([e], t, 0.0, just_above)[0].is_constant
    assert resolve([e], t, 0.1, 0.2)[0].value == 2


def test_other_variables_stay() -> None:
    t, x = Graph().variables("tx")
    e = np.where(x > 0, 1.0, 2.0) + np.where(t > x, 1.0, 2.0)
    resolved = resolve([e], t, 0.0, 1.0)
    assert resolved[0].same(e)
    assert unresolved(resolved, t) == []
    assert resolve([], t, 0.0, 1.0) == []


def test_identities_do_not_leak_out_of_the_interval() -> None:
    g = Graph()
    t = g.variable("t")
    resolve([abs(t - 1), np.maximum(t, 1.0)], t, 1.0, 2.0)
    assert ((t - 1) <= 1).faces()[0].text() == "t - 2"
    assert len(((t - 1) <= 1).faces()) == 1
    assert len((t <= 1).faces()) == 1


def test_a_pole_that_folds_away_is_remembered() -> None:
    g = Graph()
    t, x = g.variables("tx")
    resolved = resolve([np.where(t < 1, 0.0, 2.0) * (1 / x)], t, 0.0, 1.0)
    assert resolved[0].value == 0
    assert [Expr(g, k).text() for k in g.dropped] == ["1/x"]
