"""Searches against brute force over all walks that repeat no state."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from modegraph.plan.search import Arc, Path, Problem, best_paths, extended, start_path

MODES = "abcd"
costs = st.sampled_from([0.0, 0.1, 0.25, 1.0, 3.0])
nodes = st.tuples(st.sampled_from(MODES), st.integers(0, 1))


@st.composite
def problems(draw: Any) -> Problem:
    every = [(m, k) for m in MODES for k in range(2)]
    bottleneck = draw(st.booleans())
    arcs: dict[Any, list[Arc]] = {}
    for source, target in draw(st.sets(st.tuples(nodes, nodes), min_size=10, max_size=22)):
        if source != target:
            cost = (0, Fraction(0)) if bottleneck else (int(draw(costs) == 3.0), Fraction(draw(costs)))
            arcs.setdefault(source, []).append(
                Arc(source, target, cost, Fraction(draw(costs)), draw(st.sampled_from([0.1, 0.5, 0.9])))
            )
    return Problem(
        order={node: (MODES.index(node[0]), node[1]) for node in every},
        arcs=arcs,
        starts=tuple(sorted(draw(st.sets(st.tuples(st.sampled_from("ab"), st.integers(0, 1)), min_size=1)))),
        goals=frozenset(draw(st.sets(st.tuples(st.sampled_from("cd"), st.integers(0, 1)), min_size=1, max_size=2))),
        via=draw(st.sampled_from([(), (), (), ("b",), ("c", "a"), ("d",)])),
        avoid=draw(st.sampled_from([frozenset()] * 3 + [frozenset("b")])),
        max_switches=draw(st.sampled_from([None, None, None, 1, 2, 3, 4])),
        bottleneck=bottleneck,
    )


def all_paths(problem: Problem) -> Iterator[Path]:
    """Every accepted path without a repeated state, with the rules written out once more."""

    def visits(path: Path) -> list[str]:
        left = [a.source[0] for a in path.arcs if a.latest > 0]
        return [*left, path.states[-1][0][0]]

    def served(path: Path) -> bool:
        wanted = list(problem.via)
        for name in visits(path):
            if wanted and wanted[0] == name:
                wanted.pop(0)
        return not wanted

    def walk(path: Path) -> Iterator[Path]:
        if path.states[-1][0] in problem.goals and served(path):
            yield path
            return
        if problem.max_switches is not None and len(path.arcs) >= problem.max_switches:
            return
        for arc in problem.arcs.get(path.states[-1][0], ()):
            longer = extended(problem, path, arc)
            if arc.target[0] not in problem.avoid and longer.states[-1] not in path.states:
                yield from walk(longer)

    for node in problem.starts:
        yield from walk(start_path(problem, node))


@given(problems())
@settings(max_examples=250, deadline=None)
def test_the_k_best_are_those_of_brute_force(problem: Problem) -> None:
    expected = sorted(all_paths(problem), key=lambda p: p.rank(problem.bottleneck))[:6]
    found = best_paths(problem, 6)
    assert [p.rank(problem.bottleneck) for p in found] == [p.rank(problem.bottleneck) for p in expected]
    assert [p.states for p in found] == [p.states for p in expected]


@given(problems())
@settings(max_examples=100, deadline=None)
def test_the_best_is_the_first_of_the_k_best(problem: Problem) -> None:
    assert [p.states for p in best_paths(problem, 1)] == [p.states for p in best_paths(problem, 4)[:1]]


def test_a_wide_prefix_does_not_hide_a_shorter_one_behind_a_later_bottleneck() -> None:
    free = (0, Fraction(0))
    a, b, c, d = (("abcd"[k], 0) for k in range(4))
    problem = Problem(
        order={n: (k, 0) for k, n in enumerate([a, b, c, d])},
        arcs={
            a: [Arc(a, b, free, Fraction(1), 0.9), Arc(a, c, free, Fraction(1), 0.5)],
            b: [Arc(b, c, free, Fraction(1), 0.9)],
            c: [Arc(c, d, free, Fraction(1), 0.3)],
        },
        starts=(a,),
        goals=frozenset([d]),
        bottleneck=True,
    )
    assert [n for n, _ in best_paths(problem, 1)[0].states] == [a, c, d]


@pytest.mark.parametrize("size", [60])
def test_a_dense_graph_is_searched_quickly(size: int) -> None:
    every = [(f"m{k}", 0) for k in range(size)]
    arcs = {
        s: [Arc(s, t, (0, Fraction(1)), Fraction((7 * i + 3 * j) % 11), 0.5) for j, t in enumerate(every) if s != t]
        for i, s in enumerate(every)
    }
    problem = Problem({n: (k, 0) for k, n in enumerate(every)}, arcs, (every[0],), frozenset([every[-1]]))
    assert len(best_paths(problem, 5)) == 5
