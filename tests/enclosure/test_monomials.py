"""Tables of monomials."""

from __future__ import annotations

from itertools import product

import pytest

from modegraph.enclosure.monomials import monomial_count, monomials
from modegraph.errors import ModegraphError


@pytest.mark.parametrize("weights, order", [((), 3), ((1,), 0), ((1, 1), 4), ((1, 1, 1), 3), ((1, 1, 2), 4), ((2,), 3)])
def test_a_table_against_enumeration(weights: tuple[int, ...], order: int) -> None:
    table = monomials(weights, order)
    rows = [tuple(e) for e in table.exponents.tolist()]
    every = {
        e for e in product(range(order + 1), repeat=len(weights))
        if sum(w * k for w, k in zip(weights, e, strict=True)) <= order
    }  # fmt: skip
    assert set(rows) == every
    assert len(rows) == len(every) == table.size == monomial_count(weights, order)
    degrees = [sum(w * k for w, k in zip(weights, e, strict=True)) for e in rows]
    assert degrees == sorted(degrees) == table.degree.tolist()
    assert [sum(d < k for d in degrees) for k in range(order + 2)] == table.start.tolist()
    meet = [0] * len(rows)
    for i, a in enumerate(rows):
        for j, b in enumerate(rows):
            if degrees[i] + degrees[j] <= order:
                k = int(table.product[table.offset[i] + j])
                assert rows[k] == tuple(x + y for x, y in zip(a, b, strict=True))
                meet[k] += 1
    assert table.pairs >= max(meet)
    for v, k in enumerate(table.linear.tolist()):
        unit = tuple(int(u == v) for u in range(len(weights)))
        assert rows[k] == unit if unit in every else k == -1


def test_a_lower_order_is_a_prefix() -> None:
    low, high = monomials((1, 1, 1), 2), monomials((1, 1, 1), 4)
    assert (high.exponents[: low.size] == low.exponents).all()


def test_too_many_monomials() -> None:
    with pytest.raises(ModegraphError, match="fewer states or unknowns"):
        monomials((1,) * 40, 6)
