"""The worst part is cut as long as that is a gain; what is left always holds everything."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from modegraph.deadline import NEVER, Deadline
from modegraph.reach.cover.improve import Ending, improve

Interval = tuple[float, float]


def width(part: Interval) -> float:
    return part[1] - part[0]


def widest(parts: Sequence[Interval]) -> Interval | None:
    part = max(parts, key=width)
    return part if width(part) > 1.0 else None


def halves(part: Interval) -> Iterator[list[Interval]]:
    middle = 0.5 * (part[0] + part[1])
    yield [(part[0], middle), (middle, part[1])]


def always(part: Interval, children: list[Interval], parts: list[Interval]) -> bool:
    return True


def never(part: Interval, children: list[Interval], parts: list[Interval]) -> bool:
    return False


@given(st.lists(st.floats(0.5, 40.0), min_size=1, max_size=5))
def test_parts_cover_what_they_covered(widths: list[float]) -> None:
    ends = [sum(widths[:k]) for k in range(len(widths) + 1)]
    parts = list(pairwise(ends))
    found, ending = improve(parts, widest, halves, always, most=1000, deadline=NEVER)
    assert ending is Ending.ENOUGH
    assert all(width(part) <= 1.0 for part in found)
    found.sort()
    assert [found[0][0], *(part[1] for part in found)] == sorted({ends[0], *(part[0] for part in found), ends[-1]})


@pytest.mark.parametrize("most, cuts, count", [(5, 100, 5), (100, 2, 3), (1, 100, 1), (100, 0, 1)])
def test_work_is_counted(most: int, cuts: int, count: int) -> None:
    found, ending = improve([(0.0, 64.0)], widest, halves, always, most=most, deadline=NEVER, most_cuts=cuts)
    assert ending is Ending.LIMIT
    assert len(found) == count


def test_a_deadline_is_asked_only_where_something_is_left() -> None:
    over = Deadline(-1.0)
    assert improve([(0.0, 1.0)], widest, halves, always, most=9, deadline=over) == ([(0.0, 1.0)], Ending.ENOUGH)
    assert not over.met
    assert improve([(0.0, 2.0)], widest, halves, always, most=9, deadline=over) == ([(0.0, 2.0)], Ending.LIMIT)
    assert over.met


def test_a_cut_that_is_no_gain_is_undone() -> None:
    parts = [(0.0, 4.0), (4.0, 5.0)]
    assert improve(parts, widest, halves, never, most=9, deadline=NEVER) == (parts, Ending.NO_GAIN)


def test_other_ways_to_cut_are_tried_in_turn() -> None:
    tried: list[float] = []

    def ways(part: Interval) -> Iterator[list[Interval]]:
        for share in (0.1, 0.4, 0.5):
            middle = part[0] + share * width(part)
            tried.append(share)
            yield [(part[0], middle), (middle, part[1])]

    def gained(part: Interval, children: list[Interval], parts: list[Interval]) -> bool:
        assert sum(map(width, parts)) == pytest.approx(2.0)
        return max(map(width, children)) < 0.7 * width(part)

    found, ending = improve([(0.0, 2.0)], widest, ways, gained, most=2, deadline=NEVER)
    assert tried == [0.1, 0.4]
    assert found[0] == (0.0, 0.8)
    assert ending is Ending.LIMIT


def test_what_cannot_be_cut_ends_it_or_is_passed_over() -> None:
    stuck = (0.0, 10.0)

    def cuts(part: Interval) -> Iterator[list[Interval]]:
        return iter(()) if part == stuck else halves(part)

    parts = [stuck, (10.0, 12.0)]
    assert improve(parts, widest, cuts, always, most=9, deadline=NEVER) == (parts, Ending.LIMIT)
    found, ending = improve(parts, widest, cuts, always, most=9, deadline=NEVER, persistent=True)
    assert found == [stuck, (10.0, 11.0), (11.0, 12.0)]
    assert ending is Ending.ENOUGH


def test_a_part_without_children_holds_nothing() -> None:
    found, ending = improve([(0.0, 2.0), (2.0, 3.0)], widest, lambda part: [[]], always, most=9, deadline=NEVER)
    assert found == [(2.0, 3.0)]
    assert ending is Ending.ENOUGH
