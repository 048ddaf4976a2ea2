"""Across which variables a piece is cut, and how often."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from modegraph.reach.cover.restart import filled_share
from modegraph.reach.flow.flow import RESTART_SHARE, Flow
from modegraph.reach.start.piece import Piece

EQUAL = 1e-6
"""Shares that differ by less, relatively, are equal."""
SMALL = 1e-300
MOST_CUTS = 3
"""How often a part is cut at once."""


def nonlinear_variable(flow: Flow, cut: Sequence[int] = ()) -> int:
    """The variable to cut: with the largest share in a kink the starts are astride of, else in the nonlinear
    terms early in the flow, else in the width. Among equals the one that was cut least.

    ``cut``: variables that are cut already, in halves each time: squares of those are a quarter.
    """
    p = flow.set_at(max(1, len(flow.steps) // 3) if flow.steps else 0).p
    exponents = flow.bounds.exponents
    p = p * (0.5 ** exponents[:, list(cut)].sum(axis=1))
    weight = 1.0 / np.maximum(np.abs(p[:, 1:]).sum(axis=1), 1e-300)
    higher = exponents.sum(axis=1) > 1
    share = np.zeros((2, flow.piece.variables))
    for v in range(flow.piece.variables):
        reads = exponents[:, v] > 0
        for row, used in enumerate((reads & higher, reads)):
            share[row, v] = float((np.abs(p[:, used]) * exponents[used, v]).sum(axis=1) @ weight)
    chosen = flow.astride if flow.astride is not None else share[0] if share[0].any() else share[1]
    largest = chosen >= (1.0 - EQUAL) * chosen.max()
    return int(np.argmax(np.where(largest, flow.piece.radius, -1.0)))


def parts_of_refused(flow: Flow, deepest: int) -> list[Piece]:
    """Parts of the piece of a flow that was refused, its remainder feeding itself before it had filled the set.

    Measured on the arm: half a part gets about twice as far. So it is cut as often as the share that the
    remainder fills is to be doubled.
    """
    wanted = math.log2(RESTART_SHARE / max(filled_share(flow), SMALL))
    cuts = max(1, min(int(min(wanted, MOST_CUTS)), deepest - flow.piece.depth))
    done: list[int] = []
    parts = [flow.piece]
    for _ in range(cuts):
        variable = nonlinear_variable(flow, done)
        parts = [half for part in parts for half in part.split(variable)]
        done.append(variable)
    return parts
