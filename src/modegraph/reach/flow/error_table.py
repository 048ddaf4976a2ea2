"""The monomials of the Jacobian's tape: set variables, and the error of each state."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.disturbance import DROPPED, SET_VARIABLE
from modegraph.enclosure.monomials import Monomials, monomials


@dataclass(frozen=True)
class ErrorTable:
    """The table of the Jacobian: set variables, and one more variable for the error of each state.

    ``embed``, ``owner`` and ``variables`` are as ``flow_step`` takes them.
    """

    table: Monomials
    embed: NDArray[np.int64]
    owner: NDArray[np.int64]
    variables: NDArray[np.int64]


@lru_cache(maxsize=64)
def _error_table(weights: tuple[int, ...], q: int, n: int) -> ErrorTable:
    order = max(q, 1)
    m = len(weights)
    table = monomials(weights + (1 if order <= 3 else 2,) * n, order)
    owner = np.full(table.size, SET_VARIABLE, np.int64)
    owner[table.degree > q] = DROPPED
    for v in range(n):
        owner[table.exponents[:, m + v] > 0] = v
    plain = monomials(weights, order)
    index = {tuple(e): k for k, e in enumerate(table.exponents.tolist())}
    count = int(plain.start[q + 1])
    embed = np.array([index[(*e, *(0,) * n)] for e in plain.exponents[:count].tolist()], np.int64)
    return ErrorTable(table, embed, owner, table.linear[m:].copy())


def error_table(table: Monomials, q: int, n: int) -> ErrorTable:
    """The Jacobian's table for a flowpipe over ``table`` with Psi and G of degree q, n states."""
    return _error_table(table.weights, q, n)
