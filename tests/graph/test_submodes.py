from __future__ import annotations

import itertools

from hypothesis import given, settings
from hypothesis import strategies as st

from modegraph.model.sets import Box
from modegraph.model.target import Target
from tests.graph.fakes import certified, graph, mode

NODES = [(m, k) for m in "abc" for k in range(3)]
pairs = st.tuples(st.sampled_from(NODES), st.sampled_from(NODES)).filter(lambda p: p[0] != p[1])


def test_a_product_gives_one_exit_and_one_entry() -> None:
    g = graph(["a", mode("b", 2), "c"], {("a", "b"): certified(2.0), (("b", 1), "c"): certified(3.0)})
    assert [str(s) for s in g.submodes] == ["exit(a->b)", "entry(a->b)", "exit(b->c)", "entry(b->c)"]
    assert [s.mode for s in g.submodes] == ["a", "b", "b", "c"]
    assert [[r[0] for r in s.references if r is not None] for s in g.submodes[1:3]] == [[0.0, 1.0], [1.0]]
    assert [(str(e.source), str(e.target), e.kind) for e in g.edges] == [
        ("exit(a->b)", "entry(a->b)", "switch"),
        ("exit(b->c)", "entry(b->c)", "switch"),
        ("entry(a->b)", "exit(b->c)", "stay"),
    ]
    assert g.edges[0].verdict is not None
    assert g.edges[0].verdict.time == (0.0, 2.0)


def test_no_edge_inside_a_mode_where_the_references_do_not_meet() -> None:
    g = graph(["a", mode("b", 2), "c"], {("a", ("b", 0)): certified(), (("b", 1), "c"): certified()})
    assert [e.kind for e in g.edges] == ["switch", "switch"]


def test_a_coupled_relation_becomes_several_cells() -> None:
    g = graph(
        [mode("a", 2), mode("b", 2)],
        {(("a", 0), ("b", 0)): certified(1.0), (("a", 1), ("b", 1)): certified(5.0)},
    )
    assert len(g.submodes) == 4
    assert len(set(g.submodes)) == 4
    assert [e.verdict.time for e in g.edges if e.verdict is not None] == [(0.0, 1.0), (0.0, 5.0)]


def test_exit_and_entry_of_a_self_switch_do_not_collide() -> None:
    g = graph([mode("a", 2)], {("a", "a"): certified()})
    assert len(set(g.submodes)) == 4
    assert {s.role for s in g.submodes} == {"entry", "exit"}
    stays = [(e.source.cell, e.target.cell) for e in g.edges if e.kind == "stay"]
    assert len(stays) == 2
    assert all(a != b for a, b in stays)


def test_the_empty_relation_is_no_edge_and_a_target_is_never_left() -> None:
    g = graph(["a", Target("dock", Box([0], [1]))], {("a", "dock"): certified()})
    assert [(s.mode, s.role) for s in g.submodes] == [("a", "exit"), ("dock", "entry")]
    assert graph("ab", {}).submodes == ()


@given(st.sets(pairs, max_size=14))
@settings(max_examples=60, deadline=None)
def test_submode_paths_and_compositions_of_the_relations_agree(certain: set) -> None:  # type: ignore[type-arg]
    """i -> j -> k is a path of submodes iff some (r_i, r_j, r_k) has both pairs certified."""
    g = graph([mode(m, 3) for m in "abc"], dict.fromkeys(certain, certified()))
    switch = {(e.source, e.target) for e in g.edges if e.kind == "switch"}
    stay = {(e.source, e.target) for e in g.edges if e.kind == "stay"}
    for i, j, k in itertools.product("abc", repeat=3):
        composed = any(
            (x, y) in certain and (y, z) in certain
            for x in NODES
            for y in NODES
            for z in NODES
            if (x[0], y[0], z[0]) == (i, j, k)
        )
        path = any(
            (b, c) in stay for a, b in switch for c, d in switch if (a.mode, b.mode, c.mode, d.mode) == (i, j, j, k)
        )
        assert path == composed
