"""A loop in which every start has a clock of its own: x' = d f(x), d one more unknown constant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from modegraph.expression.ops import CONST, MUL, VAR, WHERE
from modegraph.expression.tape import Tape
from modegraph.reach.field import Field


def in_own_time(fld: Field) -> Field | None:
    """The field times one more unknown d, the last variable; None if anything in it reads the time.

    Whoever runs d seconds of the loop while s goes from 0 to 1 obeys dx/ds = d f(x). The matrices of
    the Jacobian, and the input energy, gain the factor too.
    """
    n, q = fld.states, fld.disturbances
    if any(_reads(tape, int(tape.variables[fld.time_index])) for tape in (fld.rates, fld.jacobian, fld.observed)):
        return None
    energy = len(fld.faces)
    return replace(
        fld,
        start=0.0,
        end=np.inf,
        unknowns=fld.unknowns + 1,
        rates=_scaled(fld.rates, 0, n),
        jacobian=_scaled(fld.jacobian, 0, n * (n + q)),
        observed=_scaled(fld.observed, energy, energy + 1),
        linear=False,
        steady=False,
    )


def _reads(tape: Tape, row: int) -> bool:
    """Whether an output is a row or an operation uses it."""
    op = tape.ops[:, 0]
    operands = [(op > VAR, 1), (op > VAR, 2), (op == WHERE, 3)]
    return bool((tape.outputs == row).any() or any((tape.ops[uses, k] == row).any() for uses, k in operands))


def _scaled(tape: Tape, first: int, last: int) -> Tape:
    """The tape with one more variable, and outputs first..last - 1 times that."""
    factor = tape.size
    rows: list[list[int]] = [[VAR, len(tape.variables), -1, -1]]
    outputs = tape.outputs.copy()
    made: dict[int, int] = {}
    for k in range(first, last):
        a = int(tape.outputs[k])
        if tape.ops[a, 0] == CONST and tape.const[a] == 0.0 and tape.const_rad[a] == 0.0:
            continue
        if a not in made:
            made[a] = factor + len(rows)
            rows.append([MUL, a, factor, -1])
        outputs[k] = made[a]
    more = len(rows)
    return Tape(
        ops=np.vstack([tape.ops, np.array(rows, np.int64)]),
        const=np.concatenate([tape.const, np.zeros(more)]),
        const_rad=np.concatenate([tape.const_rad, np.zeros(more)]),
        variables=np.append(tape.variables, factor),
        outputs=outputs,
        describe=lambda: (*tape.labels, "own time", *(tape.labels[row[1]] for row in rows[1:])),
    )
