"""What kernels take together: named tuples of arrays and numbers, which numba takes apart when it compiles.

A tuple costs nothing within compiled code, and about a microsecond where Python calls a kernel. Numbers a kernel would
get as a literal are given as np.int64: each literal would be compiled as a version of its own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from modegraph.expression.tape import Tape

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Program(NamedTuple):
    """A tape, as in ``expression.tape``."""

    ops: Ints
    const: Floats
    const_rad: Floats
    outputs: Ints
    variables: Ints


def program(tape: Tape) -> Program:
    """What kernels need of a tape."""
    return Program(tape.ops, tape.const, tape.const_rad, tape.outputs, tape.variables)


class Table(NamedTuple):
    """A table of monomials, as in ``enclosure.monomials``."""

    product: NDArray[np.uint32]
    offset: Ints
    start: Ints
    degree: Ints
    pairs: int


class Workspace(NamedTuple):
    """What a kernel fills for the nodes of a program.

    P (nodes, K+1, N) polynomials in time and the set variables, dg (nodes, K+1) their degrees, norms (nodes, K+1,
    order+1) by degree, R (nodes,) what they miss; kinks and ranges (nodes, 2) of nodes stored in a simpler form.
    """

    P: Floats
    dg: Ints
    norms: Floats
    R: Floats
    kinks: Floats
    ranges: Floats


class Scratch(NamedTuple):
    """Vectors (order + 2,) for the composition of a function with a polynomial."""

    series: Floats
    size: Floats
    error: Floats
    power: Floats
    next_power: Floats


class Initial(NamedTuple):
    """Where a step begins: p (nv, N) of all variables, G (ng, n, Nq) of the states, and the disturbance.

    ``radius`` (nw,) half-widths of the disturbance around the centre held in p; ``full_w``: df/dx and df/dw depend
    on w, evaluate them for all w; ``first_w``: index of variable w[0]; ``time_index``: that of the time.
    """

    p: Floats
    G: Floats
    radius: Floats
    full_w: bool
    first_w: int
    time_index: int


class Settings(NamedTuple):
    """Length h of a step and its degrees: power j of the time is kept up to degree cut[j] (K+1,) in p and jcut[j]
    (KJ+1,) in the Jacobian; KP powers of the time in the fundamental matrix, degree q in it and in G; at most
    ``most`` generators, others are merged."""

    h: float
    cut: Ints
    jcut: Ints
    q: int
    KP: int
    most: int


class Guess(NamedTuple):
    """What a step tries first: the tube (n,) of the error, its rest (n,), and the least tube relative to the error
    at the start."""

    tube: Floats
    rest: Floats
    room: float


class Errors(NamedTuple):
    """The table of the Jacobian beside that of the set variables: ``embed[k]`` is monomial k of the latter in it,
    ``owner`` whose error a monomial holds (``enclosure.disturbance``), ``variables`` (n,) the error of each state."""

    embed: Ints
    owner: Ints
    variables: Ints


class Jacobian(NamedTuple):
    """J (n*n, KJ+1, Nq) along a step, its degrees dJ (n*n, KJ+1), and its norms nJ (n*n, KJ+1, q+1) by degree,
    upward."""

    J: Floats
    dJ: Ints
    nJ: Floats


class Targets(NamedTuple):
    """Of pairs (B,) of references: centre and its radius (B, n), and limits (B, f), or (B, 1) of a round target."""

    centre: Floats
    radius: Floats
    limits: Floats


class Rows(NamedTuple):
    """The inequalities of a target: rows (f, n), slack (f,) relative to the states, ``grow`` of a round one."""

    rows: Floats
    slack: Floats
    is_round: bool
    grow: float


class Instants(NamedTuple):
    """Where all parts of a source are, as in ``enclosure.pairs``."""

    part_flows: Ints
    lo: Floats
    hi: Floats
    middle: Floats
    scale: Floats
    flow_terms: Ints
    exponents: Ints
    flow_instants: Ints
    flow_coefficients: Ints
    coefficients: Floats
    farthest: Floats
    size: Floats
    spread: Floats
