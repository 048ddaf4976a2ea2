"""A tape evaluated over a set at one instant."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.arguments import Workspace, program
from modegraph.enclosure.monomials import Monomials
from modegraph.enclosure.observe import enclose_at
from modegraph.expression.tape import Tape

Floats = NDArray[np.float64]


def workspace(tape: Tape, K: int, size: int, degree: int) -> Workspace:
    """Arrays a kernel fills for the nodes of a tape: K + 1 powers of time, ``size`` monomials."""
    rows = tape.size
    return Workspace(
        P=np.zeros((rows, K + 1, size)),
        dg=np.full((rows, K + 1), -1, np.int64),
        norms=np.zeros((rows, K + 1, degree + 1)),
        R=np.zeros(rows),
        kinks=np.zeros((rows, 2)),
        ranges=np.full((rows, 2), np.nan),
    )


def evaluate_over(
    tape: Tape, table: Monomials, degree: int, inputs: Floats, radius: Floats
) -> tuple[Floats, Floats, int]:
    """Outputs over the unit box: polynomials (no, N), radii (no,) (inf: undefined), first undefined row or -1.

    inputs (nv, N) are polynomials over the table, from which the variables differ by at most radius (nv,).
    """
    space = workspace(tape, 0, table.size, degree)
    return enclose_at(
        program(tape), np.ascontiguousarray(inputs), np.ascontiguousarray(radius, float), np.array([degree], np.int64),
        space, table.arrays,
    )  # fmt: skip
