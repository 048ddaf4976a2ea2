from __future__ import annotations

import itertools
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from modegraph.certify.verdict import Verdict
from modegraph.errors import Unreachable
from tests.graph.fakes import UNDECIDED, certified, graph

pairs = st.tuples(st.sampled_from("abcde"), st.sampled_from("abcde")).filter(lambda p: p[0] != p[1])
tables = st.dictionaries(
    pairs, st.sampled_from([certified(), UNDECIDED, UNDECIDED, certified(0.0)]), min_size=4, max_size=9
)
questions = st.fixed_dictionaries(
    {},
    optional={
        "via": st.sampled_from([(), ("b",), ("c", "b")]),
        "avoid": st.sampled_from([(), ("c",)]),
        "max_switches": st.sampled_from([1, 2, 3]),
    },
)


def reaches(table: dict[Any, Verdict], question: dict[str, Any]) -> bool:
    try:
        graph("abcde", table).plan("a", "e", **question)
    except Unreachable:
        return False
    return True


@given(tables, questions)
@settings(max_examples=150, deadline=None)
def test_helpful_is_what_brute_force_finds(table: dict[Any, Verdict], question: dict[str, Any]) -> None:
    """The undecided pairs of the smallest sets that open a chain when they become certified.

    With ``via`` a walk may take a pair twice, so only whether anything helps is compared.
    """
    undecided = [pair for pair, v in table.items() if v is UNDECIDED]
    expected: set[Any] = set()
    for size in range(len(undecided) + 1):
        for chosen in itertools.combinations(undecided, size):
            if reaches({**table, **dict.fromkeys(chosen, certified())}, question):
                expected |= set(chosen)
                if size == 0:
                    return
        if expected:
            break
    with pytest.raises(Unreachable) as caught:
        graph("abcde", table).plan("a", "e", **question)
    if question.get("via"):
        assert bool(caught.value.helpful) == bool(expected)
        assert reaches({**table, **dict.fromkeys(caught.value.helpful, certified())}, question) == bool(expected)
    else:
        assert set(caught.value.helpful) == expected


def test_reachable_is_in_mode_order_and_the_message_tells_all() -> None:
    g = graph("dcbae", {("a", "b"): certified(), ("b", "d"): certified(), ("d", "e"): UNDECIDED})
    with pytest.raises(Unreachable) as caught:
        g.plan("a", "e", via=["b"])
    assert caught.value.reachable == ("d", "b", "a")
    text = str(caught.value)
    assert "from 'a' to 'e' via b" in text
    assert "d -> e" in text


def test_nothing_helps() -> None:
    with pytest.raises(Unreachable, match="no undecided pair could help") as caught:
        graph("ab", {}).plan("a", "b")
    assert caught.value.helpful == ()
