"""Ranges of a tape over many boxes at once: natural interval extension, rounded outward (NumPy).

Boxes may be unbounded. Every sum and product moves one double outward; the elementary functions of
NumPy are within 4 units in the last place, of which ``ELEMENTARY`` is the fourfold.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from modegraph.expression.ops import (
    ADD,
    ADDC,
    ATAN,
    CONST,
    COS,
    EXP,
    LOG,
    MUL,
    MULC,
    RECIP,
    RELU,
    SIN,
    SQR,
    STEP,
    SUB,
    VAR,
    WHERE,
)  # fmt: skip
from modegraph.expression.tape import Tape

Floats = NDArray[np.float64]
Range = tuple[Floats, Floats]

ELEMENTARY = 2.0**-48
"""Allowance for one call of sin, cos (absolute), exp, log, atan (relative)."""
LARGEST_ANGLE = 1e6
"""Beyond it sin and cos are bounded by 1 only: where their extremes lie is not tracked."""


class IntervalEvaluator:
    """Encloses the outputs of a tape over boxes; ranges are those of the points where they are defined."""

    def __init__(self, tape: Tape) -> None:
        self.tape = tape
        self._extremes = _extremes(tape)

    def __call__(self, lo: Floats, hi: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """Ranges over B boxes lo, hi (nvar, B).

        Returns
        -------
        lo, hi : (nout, B)
        defined : (B,)
            True where every operation of the tape is proved to be defined on the whole box.
        """
        count = lo.shape[1]
        defined = np.ones(count, bool)
        rows: list[Range] = []
        tape = self.tape
        with np.errstate(all="ignore"):
            for k, (op, a, b, c) in enumerate(tape.ops.tolist()):
                if op == VAR:
                    low, high = lo[a], hi[a]
                elif op == CONST:
                    low, high = _constant(tape, k, count)
                else:
                    if op == RECIP:
                        defined &= (rows[a][0] > 0.0) | (rows[a][1] < 0.0)
                    elif op == LOG:
                        defined &= rows[a][0] > 0.0
                    low, high = self._operation(k, op, rows[a], rows[b] if 0 <= b < k else rows[a], c, rows)
                rows.append((np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high)))
        return (
            np.array([rows[k][0] for k in tape.outputs]).reshape(-1, count),
            np.array([rows[k][1] for k in tape.outputs]).reshape(-1, count),
            defined,
        )

    def _operation(self, k: int, op: int, a: Range, b: Range, c: int, rows: list[Range]) -> Range:
        if k in self._extremes:
            kind, i, j, shifted = self._extremes[k]
            if kind == "abs":
                return _magnitude(rows[i])
            first, other = rows[i], rows[j]
            if shifted >= 0:
                low, high = _constant(self.tape, shifted, 1)
                low, high = (low, high) if kind == "max" else (-high, -low)
                first = _outward(first[0] + low, first[1] + high)
            pick = np.maximum if kind == "max" else np.minimum
            return pick(first[0], other[0]), pick(first[1], other[1])
        if op == ADD:
            return _outward(a[0] + b[0], a[1] + b[1])
        if op == SUB:
            return _outward(a[0] - b[1], a[1] - b[0])
        if op == MUL:
            return _product(a, b)
        if op == MULC:
            return _product(a, _constant(self.tape, k, 1))
        if op == ADDC:
            shift = _constant(self.tape, k, 1)
            return _outward(a[0] + shift[0], a[1] + shift[1])
        if op == SQR:
            near, far = _magnitude(a)
            low, high = _outward(near * near, far * far)
            return np.maximum(low, 0.0), high
        if op == RELU:
            return np.maximum(a[0], 0.0), np.maximum(a[1], 0.0)
        if op == STEP:
            return np.where(a[0] > 0.0, 1.0, 0.0), np.where(a[1] > 0.0, 1.0, 0.0)
        if op == WHERE:
            gap = rows[c]
            yes, no = gap[0] > 0.0, gap[1] <= 0.0
            low = np.where(yes, a[0], np.where(no, b[0], np.minimum(a[0], b[0])))
            high = np.where(yes, a[1], np.where(no, b[1], np.maximum(a[1], b[1])))
            return low, high
        if op in (SIN, COS):
            return _wave(op, *a)
        return _monotone(op, *a)


def _extremes(tape: Tape) -> dict[int, tuple[str, int, int, int]]:
    """Rows that are |a| = 2 relu(a) - a, max(a + d, b) = b + relu(a - b + d) or min(b - d, a) = a - relu(a - b + d).

    Term by term their ranges would be far too wide, and unbounded on unbounded boxes. Returns the kind,
    the rows of both arguments, the first of which the constant d of the last row is added to (min:
    subtracted from); -1 for no constant.
    """
    found: dict[int, tuple[str, int, int, int]] = {}
    ops = tape.ops.tolist()

    def gap(relu: int) -> tuple[int, int, int]:
        """Rows p, q and that of d where row ``relu`` is relu(p - q + d); else -2."""
        row = ops[relu][1] if ops[relu][0] == RELU else relu
        shifted = row if ops[row][0] == ADDC else -1
        row = ops[row][1] if shifted >= 0 else row
        known = ops[relu][0] == RELU and ops[row][0] == SUB
        return (ops[row][1], ops[row][2], shifted) if known else (-2, -2, -1)

    for k, (op, a, b, _) in enumerate(ops):
        if op == SUB and ops[a][0] == MULC and tape.const[a] == 2.0 and tape.const_rad[a] == 0.0:
            if ops[ops[a][1]][:2] == [RELU, b]:
                found[k] = "abs", b, b, -1
        elif op == SUB:
            p, q, shifted = gap(b)
            if p == a:
                found[k] = "min", q, a, shifted
        elif op == ADD:
            for relu, other in ((a, b), (b, a)):
                p, q, shifted = gap(relu)
                if q == other:
                    found[k] = "max", p, other, shifted
    return found


def _magnitude(a: Range) -> Range:
    near = np.where((a[0] <= 0.0) & (a[1] >= 0.0), 0.0, np.minimum(np.abs(a[0]), np.abs(a[1])))
    return near, np.maximum(np.abs(a[0]), np.abs(a[1]))


def _constant(tape: Tape, k: int, count: int) -> Range:
    value, radius = tape.const[k], tape.const_rad[k]
    low, high = (value, value) if radius == 0.0 else (value - radius, value + radius)
    if radius != 0.0:
        low, high = np.nextafter(low, -np.inf), np.nextafter(high, np.inf)
    return np.full(count, low), np.full(count, high)


def _outward(low: Floats, high: Floats) -> Range:
    return np.nextafter(low, -np.inf), np.nextafter(high, np.inf)


def _product(a: Range, b: Range) -> Range:
    corners = np.array([x * y for x in a for y in b])
    # Zero times an infinite end: the end is not attained, so the product is zero.
    corners = np.where(np.isnan(corners), 0.0, corners)
    return _outward(corners.min(axis=0), corners.max(axis=0))


def _wave(op: int, low: Floats, high: Floats) -> Range:
    function, peak = (np.sin, 0.5 * np.pi) if op == SIN else (np.cos, 0.0)
    size = np.maximum(np.abs(low), np.abs(high))
    known = size < LARGEST_ANGLE
    a, b = np.where(known, low, 0.0), np.where(known, high, 0.0)
    slack = 1e-12 * (1.0 + np.where(known, size, 0.0))

    def holds(at: float) -> NDArray[np.bool_]:
        first = at + 2.0 * np.pi * np.ceil((a - slack - at) / (2.0 * np.pi))
        return np.asarray(first <= b + slack)

    at_ends = function(a), function(b)
    bottom = np.minimum(*at_ends) - ELEMENTARY
    top = np.maximum(*at_ends) + ELEMENTARY
    bottom = np.where(~known | holds(peak + np.pi), -1.0, np.maximum(bottom, -1.0))
    return bottom, np.where(~known | holds(peak), 1.0, np.minimum(top, 1.0))


def _monotone(op: int, low: Floats, high: Floats) -> Range:
    if op == RECIP:
        split = (low < 0.0) & (high > 0.0)
        bottom = np.where(split | (high == 0.0), -np.inf, 1.0 / high)
        top = np.where(split | (low == 0.0), np.inf, 1.0 / low)
        return _outward(bottom, top)
    if op == EXP:
        bottom, top = np.exp(low), np.exp(high)
        bottom, top = _outward(bottom * (1.0 - ELEMENTARY), top * (1.0 + ELEMENTARY))
        return np.maximum(bottom, 0.0), top
    if op == LOG:
        bottom = np.where(low > 0.0, np.log(low), -np.inf)
        top = np.where(high > 0.0, np.log(high), np.inf)
    elif op == ATAN:
        bottom, top = np.arctan(low), np.arctan(high)
    else:
        raise ValueError(f"operation {op} has no interval extension")
    return _outward(bottom - ELEMENTARY * np.abs(bottom), top + ELEMENTARY * np.abs(top))
