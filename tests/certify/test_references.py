from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from modegraph.certify.references import References
from modegraph.errors import ModegraphError

SOURCES = [np.array([0.0, 1.0]), np.array([1.0, 1.0]), np.array([2.0, 0.1])]
TARGETS = [np.array([5.0]), np.array([6.0])]

relations = st.sets(st.tuples(st.integers(0, 4), st.integers(0, 4)))


def numbered(n: int) -> list[np.ndarray]:
    return [np.array([float(k)]) for k in range(n)]


def test_membership_is_exact_and_false_for_references_that_do_not_exist() -> None:
    refs = References(SOURCES, TARGETS, [(0, 0), (2, 1)])
    assert ([0, 1], 5) in refs
    assert refs.contains((2, 0.1), [6.0])
    assert ([0, 1], 6) not in refs
    assert ([2, np.nextafter(0.1, 1)], 6) not in refs
    assert ([7, 7], 5) not in refs
    assert ("hover", 5) not in refs
    assert (None, 5) not in refs
    assert 5 not in refs


@pytest.mark.parametrize("only", [None, (), [3.0], 3.0])
def test_none_and_empty_name_the_only_reference(only: object) -> None:
    assert (only, None) in References([np.array([3.0])], [None], [(0, 0)])


def test_projections_pairs_and_volume() -> None:
    refs = References(SOURCES, TARGETS, [(2, 1), (0, 1)], undecided=1)
    assert [list(p) for p in refs.source] == [[0, 1], [2, 0.1]]
    assert [list(p) for p in refs.target] == [[6]]
    assert [(a[0], b[0]) for a, b in refs] == [(0, 6), (2, 6)]
    assert len(refs) == 2
    assert refs.volume == (2.0, 3.0)


def test_a_product_is_one_cell() -> None:
    refs = References(SOURCES, TARGETS, itertools.product(range(3), range(2)))
    assert refs.decoupled
    (cell,) = refs.cells
    assert cell.source_index == (0, 1, 2)
    assert cell.target_index == (0, 1)


def test_full_projections_are_no_product() -> None:
    refs = References(TARGETS, TARGETS, [(0, 0), (1, 1)])
    assert not refs.decoupled
    assert len(refs.cells) == 2


def test_the_empty_relation_is_not_decoupled() -> None:
    refs = References(SOURCES, TARGETS, [])
    assert not refs.decoupled
    assert refs.cells == ()
    assert refs.volume == (0.0, 0.0)
    with pytest.raises(ModegraphError, match="no pair"):
        refs.sample(3)


@given(relations)
def test_cells_cover_the_relation_exactly_and_once(pairs: set[tuple[int, int]]) -> None:
    refs = References(numbered(5), numbered(5), pairs)
    covered = [p for c in refs.cells for p in itertools.product(c.source_index, c.target_index)]
    assert sorted(covered) == sorted(pairs)


@given(relations)
def test_decoupled_means_nonempty_and_the_product_of_the_projections(pairs: set[tuple[int, int]]) -> None:
    product = set(itertools.product({a for a, _ in pairs}, {b for _, b in pairs}))
    assert References(numbered(5), numbered(5), pairs).decoupled == (bool(pairs) and product == pairs)


def test_samples_are_members_and_repeatable() -> None:
    refs = References(SOURCES, TARGETS, [(0, 0), (2, 1)])
    drawn = refs.sample(20, seed=3)
    assert len(drawn) == 20
    assert all(pair in refs for pair in drawn)
    assert len({float(r_i[0]) for r_i, _ in drawn}) == 2
    again = refs.sample(20, seed=3)
    assert [float(r[0][0]) for r in drawn] == [float(r[0][0]) for r in again]
