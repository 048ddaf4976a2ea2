"""Parts that together hold everything: the worst is cut as long as that makes them better."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from enum import Enum
from typing import TypeVar

from modegraph.deadline import Deadline

P = TypeVar("P")


class Ending(Enum):
    """Why no more is cut."""

    ENOUGH = "no part needs it"
    LIMIT = "the parts, the cuts or the time are used up, or the worst part cannot be cut"
    NO_GAIN = "cutting the worst part does not help"


def improve(
    parts: Sequence[P],
    worst: Callable[[Sequence[P]], P | None],
    cuts: Callable[[P], Iterable[list[P]]],
    gained: Callable[[P, list[P], list[P]], bool],
    *,
    most: int,
    deadline: Deadline,
    most_cuts: float = math.inf,
    persistent: bool = False,
) -> tuple[list[P], Ending]:
    """Replace the worst part by what it is cut into while that is a gain.

    Parameters
    ----------
    worst : of some parts that may be cut, the one to cut; None where none needs it
    cuts : ways to cut a part, the best first; each is made when it is asked for. A part without children is
        proved to hold nothing.
    gained : (part, its children, all parts with these in its place): whether a cut is kept
    most : parts; none is cut any more once there are so many
    most_cuts : how many parts are cut at most, with gain or without
    persistent : a part that cannot be cut with gain is left as it is, and the next worst is cut
    """
    parts, left = list(parts), list(parts)
    while True:
        part = worst(left) if left else None
        if part is None:
            return parts, Ending.ENOUGH
        if len(parts) >= most or most_cuts <= 0 or deadline.is_over:
            return parts, Ending.LIMIT
        most_cuts -= 1
        ending = Ending.LIMIT
        for children in cuts(part):
            others = [*_without(parts, part), *children]
            if gained(part, children, others):
                parts, left = others, [*_without(left, part), *children]
                break
            ending = Ending.NO_GAIN
        else:
            if not persistent:
                return parts, ending
            left = _without(left, part)


def _without(parts: Sequence[P], part: P) -> list[P]:
    return [other for other in parts if other is not part]
