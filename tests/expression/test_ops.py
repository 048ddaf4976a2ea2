"""Operation codes."""

from __future__ import annotations

from modegraph.expression import ops


def test_every_code_has_one_name_at_its_place() -> None:
    codes = {name.lower(): code for name, code in vars(ops).items() if isinstance(code, int) and name.isupper()}
    assert sorted(codes.values()) == list(range(len(ops.NAMES)))
    assert {ops.NAMES[code]: code for code in codes.values()} == codes


def test_kinds_do_not_overlap() -> None:
    assert not ops.BINARY & ops.LEAVES
    assert {ops.NAMES[code] for code in ops.BINARY} == {"add", "sub", "mul"}
    assert {ops.NAMES[code] for code in ops.LEAVES} == {"const", "var"}
