"""The flat program: layout, companions, rigorous constants, and evaluation."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from modegraph.errors import ModegraphError
from modegraph.expression import Graph, compile_tape
from modegraph.expression import tape as t


def everything() -> tuple[t.Tape, int]:
    g = Graph()
    x, y, unused = g.variables(["x", "y", "unused"])
    exprs = [
        np.sin(0.1 * x - y) / (1 + x * x) + np.cos(y),
        np.arctan2(y, x) + np.tanh(x),
        np.log(x) + np.sqrt(y) + abs(x - 1) ** 3,
        np.where(x > y, x, np.exp(y)),
        g.constant(3),
        g.constant(1) / 3,
    ]
    return compile_tape(exprs, [unused, x, y]), len(exprs)


def test_layout() -> None:
    tape, outputs = everything()
    assert tape.ops.dtype == np.int64
    assert tape.ops.shape == (tape.size, 4)
    assert tape.outputs.shape == (outputs,)
    assert tape.ops[tape.variables].tolist() == [[t.VAR, k, -1, -1] for k in range(3)]
    assert len(tape.labels) == tape.size


def test_operands_come_first_and_companions_match() -> None:
    tape, _ = everything()
    for k, (op, a, b, c) in enumerate(tape.ops.tolist()):
        if op in (t.CONST, t.VAR):
            continue
        assert a < k
        assert c < k
        if op == t.SIN:
            assert b == k + 1
            assert tape.ops[b, :3].tolist() == [t.COS, a, k]
        elif op == t.COS:
            assert b == k - 1
            assert tape.ops[b, :3].tolist() == [t.SIN, a, k]
        else:
            assert b < k
        if op == t.LOG:
            assert tape.ops[b, :2].tolist() == [t.RECIP, a]
        if op == t.ATAN:
            inner = tape.ops[b, 1]
            assert tape.ops[b, 0] == t.RECIP
            assert tape.ops[inner, 0] == t.ADDC
            assert tape.const[inner] == 1.0


def test_no_dead_rows() -> None:
    tape, _ = everything()
    used = set(tape.outputs.tolist()) | set(tape.variables.tolist())
    for op, a, b, c in tape.ops.tolist():
        used.update(k for k in (a, b, c) if k >= 0 and op != t.VAR)
    assert used == set(range(tape.size))


@given(st.fractions(), st.integers(-1000, 1000))
def test_constant_radius_is_rigorous(value: Fraction, exponent: int) -> None:
    exact = value * Fraction(2) ** exponent
    try:
        centre, radius = t.enclose_constant(exact)
    except ModegraphError:
        assert abs(exact) > Fraction(2) ** 1023
        return
    error = abs(exact - Fraction(centre))
    assert error <= Fraction(radius)
    assert (radius == 0) == (error == 0)
    if radius > 1e-300:
        assert Fraction(math.nextafter(radius, 0)) <= error


def test_a_missing_variable_is_an_error() -> None:
    x, y = Graph().variables("xy")
    with pytest.raises(ModegraphError, match="y is not among"):
        compile_tape([x + y], [x])


def test_notes_are_labels() -> None:
    x, y = Graph().variables("xy")
    tape = compile_tape([np.arctan2(y, x)], [x, y])
    recips = [tape.labels[k] for k in range(tape.size) if tape.ops[k, 0] == t.RECIP]
    assert "arctan2(y, x) reaches its cut (y = 0, x <= 0)" in recips
