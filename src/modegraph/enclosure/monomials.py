"""Tables of monomials of bounded weighted degree, and the index of every product of two of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.arguments import Table
from modegraph.enclosure.rounding import MAX_MONOMIALS
from modegraph.errors import ModegraphError

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Monomials:
    """Monomials xi**alpha with sum(weights * alpha) <= order, sorted by that degree.

    Because they are sorted, the table of a lower order is a prefix: "multiply, truncated at degree
    d" is a loop bound.

    Attributes
    ----------
    variables : int
        Number m of variables, each ranging over [-1, 1].
    order : int
    exponents : (N, m) int64
    degree : (N,) int64
        Weighted degree of each monomial.
    start : (order + 2,) int64
        ``start[d]`` is the first monomial of degree >= d.
    offset : (N,) int64, product : (L,) uint32
        ``product[offset[i] + j]`` is the index of monomial i times monomial j.
    linear : (m,) int64
        Index of each variable as a monomial.
    pairs : int
        The most products that meet in one monomial (for the rounding bound of a product).
    """

    variables: int
    order: int
    weights: tuple[int, ...]
    exponents: Ints
    degree: Ints
    start: Ints
    offset: Ints
    product: NDArray[np.uint32]
    linear: Ints
    pairs: int

    @property
    def size(self) -> int:
        return len(self.degree)

    @property
    def arrays(self) -> Table:
        """What the kernels take."""
        return Table(self.product, self.offset, self.start, self.degree, self.pairs)


def monomial_count(weights: tuple[int, ...], order: int) -> int:
    """Number of monomials of weighted degree <= order."""
    count = np.zeros(order + 1, np.int64)
    count[0] = 1
    for weight in weights:
        for d in range(weight, order + 1):
            count[d] += count[d - weight]
    return int(count.sum())


@lru_cache(maxsize=128)
def monomials(weights: tuple[int, ...], order: int) -> Monomials:
    """Build (or recall) the table for ``len(weights)`` variables."""
    total = monomial_count(weights, order)
    if total > MAX_MONOMIALS:
        raise ModegraphError(
            f"{len(weights)} uncertain quantities at order {order} need {total} monomials "
            f"(limit {MAX_MONOMIALS}): make fewer states or unknowns uncertain"
        )
    m = len(weights)
    rows = np.zeros((1, 0), np.int64)
    left = np.array([order], np.int64)
    for weight in weights:
        counts = left // weight + 1
        rows = np.repeat(rows, counts, axis=0)
        power = np.concatenate([np.arange(c) for c in counts])
        left = np.repeat(left, counts) - power * weight
        rows = np.column_stack([rows, power])
    degree = order - left
    keys = (*tuple(-rows[:, v] for v in range(m - 1, -1, -1)), degree)
    by_degree = np.lexsort(keys)
    exponents = np.ascontiguousarray(rows[by_degree].reshape(total, m))
    degree = np.ascontiguousarray(degree[by_degree])
    start = np.searchsorted(degree, np.arange(order + 2)).astype(np.int64)
    radix = [(order + 1) ** v for v in range(m)]
    dtype: type = object if (order + 1) ** max(m, 1) > 2**62 else np.int64
    key = (exponents.astype(dtype) * np.array(radix, dtype)).sum(axis=1) if m else np.zeros(1, np.int64)
    by_key = np.argsort(key)
    sorted_key = key[by_key]
    reach = start[order - degree + 1]
    offset = np.concatenate([[0], np.cumsum(reach)[:-1]]).astype(np.int64)
    product = np.concatenate(
        [by_key[np.searchsorted(sorted_key, key[i] + key[: reach[i]])] for i in range(total)]
    ).astype(np.uint32)
    linear = np.zeros(m, np.int64)
    for v in range(m):
        unit = np.zeros(m, np.int64)
        unit[v] = 1
        hits = np.nonzero((exponents == unit).all(axis=1))[0]
        linear[v] = hits[0] if len(hits) else -1
    pairs = int(np.bincount(product, minlength=total).max())
    return Monomials(m, order, weights, exponents, degree, start, offset, product, linear, pairs)
