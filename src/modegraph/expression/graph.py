"""The hash-consed graph underneath traced scalars.

Nodes are numbered in the order of creation, so operands always come before their users. Equal nodes
are one node. Rational arithmetic on constants is folded exactly (constants are `Fraction`s); every
folding rule is an identity of real numbers wherever its operands are defined. Where a rule drops an
operand that is not defined everywhere (``0 * (1 / x)``), the operand is remembered in
`Nodes.dropped`: a cancelled pole is still a pole.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import NamedTuple

from modegraph.errors import ModegraphError
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

ZERO = Fraction(0)
ONE = Fraction(1)
MINUS_ONE = Fraction(-1)

POSITIVE, NONNEGATIVE, UNKNOWN = 2, 1, 0
"""What is known about the sign of a node from its structure alone."""


def rational_root(value: Fraction) -> Fraction | None:
    """The exact square root of a number >= 0, if it is rational."""
    p, q = math.isqrt(value.numerator), math.isqrt(value.denominator)
    return Fraction(p, q) if p * p == value.numerator and q * q == value.denominator else None


class Node(NamedTuple):
    """One operation: code, operands (node numbers, -1 where unused), constant or variable number."""

    op: int
    a: int
    b: int
    c: int
    const: Fraction | None


class Nodes:
    """Append-only storage of nodes, with exact folding. All methods speak node numbers.

    Attributes
    ----------
    nodes : list[Node]
        ``VAR`` keeps the variable number in ``a``.
    names : list[str]
        Variable names by variable number.
    masks : list[int]
        Bit ``k`` set: the node depends on variable number ``k``.
    partial : list[bool]
        The node contains a reciprocal or logarithm that is not structurally defined everywhere.
    signs : list[int]
        `POSITIVE`, `NONNEGATIVE` or `UNKNOWN`, wherever the node is defined.
    notes : dict[int, str]
        What a user should read when the node turns out to be undefined.
    origins : dict[int, tuple[str, tuple[int, ...]]]
        ``("abs", (a,))``, ``("max", (a, b))``, ``("min", (a, b))`` or ``("sqrt", (a,))``: what the node
        equals for all values of the variables. Operands are older than the node.
    dropped : list[int]
        Operands that folding removed although they are not defined everywhere.
    derivatives : dict[tuple[int, int], int]
        Memo of `derivative`, keyed by node and variable number.
    """

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self.names: list[str] = []
        self.masks: list[int] = []
        self.partial: list[bool] = []
        self.signs: list[int] = []
        self.notes: dict[int, str] = {}
        self.origins: dict[int, tuple[str, tuple[int, ...]]] = {}
        self.dropped: list[int] = []
        self.derivatives: dict[tuple[int, int], int] = {}
        self.texts: dict[int, tuple[str, int]] = {}
        self._memo: dict[Node, int] = {}

    def node(self, op: int, a: int = -1, b: int = -1, c: int = -1, const: Fraction | None = None) -> int:
        """The number of this very node, created if new; nothing is folded."""
        key = Node(op, a, b, c, const)
        index = self._memo.get(key)
        if index is not None:
            return index
        index = len(self.nodes)
        if op == VAR:
            mask, partial = 1 << a, False
        else:
            mask, partial = 0, False
            for k in (a, b, c):
                if k >= 0:
                    mask |= self.masks[k]
                    partial = partial or self.partial[k]
            if op in (RECIP, LOG) and self.signs[a] != POSITIVE:
                partial = True
        self.signs.append(self._sign(key))
        self.nodes.append(key)
        self.masks.append(mask)
        self.partial.append(partial)
        self._memo[key] = index
        return index

    def _sign(self, node: Node) -> int:
        op, a, b, _, const = node
        signs = self.signs
        if op == CONST and const is not None:
            return POSITIVE if const > 0 else NONNEGATIVE if const == 0 else UNKNOWN
        if op == EXP:
            return POSITIVE
        if op in (RELU, STEP, SQR):
            return POSITIVE if op == SQR and signs[a] == POSITIVE else NONNEGATIVE
        if op == RECIP and signs[a] >= NONNEGATIVE:
            return POSITIVE
        if op == ADD and min(signs[a], signs[b]) >= NONNEGATIVE:
            return max(signs[a], signs[b])
        if op == MUL and min(signs[a], signs[b]) >= NONNEGATIVE:
            return min(signs[a], signs[b])
        if op == MULC and const is not None and const > 0:
            return signs[a]
        if op == ADDC and const is not None and const > 0 and signs[a] >= NONNEGATIVE:
            return POSITIVE
        return UNKNOWN

    def drop(self, index: int) -> None:
        """Remember that folding removed this operand, unless it is defined everywhere."""
        if self.partial[index]:
            self.dropped.append(index)

    def value(self, index: int) -> Fraction | None:
        """The constant a node is, or None."""
        node = self.nodes[index]
        return node.const if node.op == CONST else None

    def number(self, value: Fraction) -> int:
        """Node of a constant."""
        return self.node(CONST, const=value)

    def coefficient(self, index: int) -> tuple[int, Fraction]:
        """Split a node in (base, constant factor)."""
        node = self.nodes[index]
        if node.op == MULC and node.const is not None:
            return node.a, node.const
        return index, ONE

    def _offset(self, index: int) -> tuple[int, Fraction]:
        node = self.nodes[index]
        if node.op == ADDC and node.const is not None:
            return node.a, node.const
        return index, ZERO

    def shift(self, a: int, k: Fraction) -> int:
        """a + k."""
        value = self.value(a)
        if value is not None:
            return self.number(value + k)
        a, inner = self._offset(a)
        return a if k + inner == 0 else self.node(ADDC, a, const=k + inner)

    def scale(self, a: int, k: Fraction) -> int:
        """k * a."""
        value = self.value(a)
        if value is not None:
            return self.number(value * k)
        if k == 0:
            self.drop(a)
            return self.number(ZERO)
        a, inner = self.coefficient(a)
        k *= inner
        if k == 1:
            return a
        node = self.nodes[a]
        if k == -1 and node.op == SUB and a not in self.origins:
            return self.sub(node.b, node.a)
        return self.node(MULC, a, const=k)

    def neg(self, a: int) -> int:
        """-a."""
        return self.scale(a, MINUS_ONE)

    def add(self, a: int, b: int) -> int:
        """a + b."""
        va, vb = self.value(a), self.value(b)
        if vb is not None:
            return self.shift(a, vb)
        if va is not None:
            return self.shift(b, va)
        (base_a, fa), (base_b, fb) = self.coefficient(a), self.coefficient(b)
        if base_a == base_b:
            return self.scale(base_a, fa + fb)
        (a, ka), (b, kb) = self._offset(a), self._offset(b)
        if ka or kb:
            return self.shift(self.add(a, b), ka + kb)
        if fb == -1:
            return self.neg(self.add(base_a, base_b)) if fa == -1 else self.sub(a, base_b)
        if fa == -1:
            return self.sub(b, base_a)
        for p, q in ((a, b), (b, a)):
            node = self.nodes[p]
            if node.op == SUB and node.b == q:
                self.drop(q)
                return node.a
        return self.node(ADD, min(a, b), max(a, b))

    def sub(self, a: int, b: int) -> int:
        """a - b."""
        va, vb = self.value(a), self.value(b)
        if vb is not None:
            return self.shift(a, -vb)
        if va is not None:
            return self.shift(self.neg(b), va)
        (base_a, fa), (base_b, fb) = self.coefficient(a), self.coefficient(b)
        if base_a == base_b:
            return self.scale(base_a, fa - fb)
        (a, ka), (b, kb) = self._offset(a), self._offset(b)
        if ka or kb:
            return self.shift(self.sub(a, b), ka - kb)
        if fb == -1:
            return self.sub(base_b, base_a) if fa == -1 else self.add(a, base_b)
        if fa == -1:
            return self.neg(self.add(base_a, b))
        left, right = self.nodes[a], self.nodes[b]
        if left.op == ADD and b in (left.a, left.b):
            self.drop(b)
            return left.a if left.b == b else left.b
        if left.op == SUB and left.a == b:
            self.drop(b)
            return self.neg(left.b)
        if right.op == ADD and a in (right.a, right.b):
            self.drop(a)
            return self.neg(right.a if right.b == a else right.b)
        if right.op == SUB and right.a == a:
            self.drop(a)
            return right.b
        return self.node(SUB, a, b)

    def mul(self, a: int, b: int) -> int:
        """a * b."""
        va, vb = self.value(a), self.value(b)
        if vb is not None:
            return self.scale(a, vb)
        if va is not None:
            return self.scale(b, va)
        (a, fa), (b, fb) = self.coefficient(a), self.coefficient(b)
        product = self.sqr(a) if a == b else self.node(MUL, min(a, b), max(a, b))
        return self.scale(product, fa * fb)

    def sqr(self, a: int) -> int:
        """a * a."""
        value = self.value(a)
        if value is not None:
            return self.number(value * value)
        a, k = self.coefficient(a)
        kind, inner = self.origins.get(a, ("", ()))
        if kind == "abs":
            return self.scale(self.sqr(inner[0]), k * k)
        if kind == "sqrt":
            if self.signs[inner[0]] < NONNEGATIVE:
                self.drop(a)
            return self.scale(inner[0], k * k)
        return self.scale(self.node(SQR, a), k * k)

    def power(self, a: int, n: int) -> int:
        """a ** n for n >= 1, by repeated squaring."""
        if n == 1:
            return a
        half = self.sqr(self.power(a, n // 2))
        return self.mul(half, a) if n % 2 else half

    def recip(self, a: int, note: str | None = None) -> int:
        """1 / a; an obligation wherever a is not structurally positive."""
        value = self.value(a)
        if value is not None:
            if value == 0:
                raise ModegraphError(note or "division by zero: a denominator is identically 0")
            return self.number(1 / value)
        a, k = self.coefficient(a)
        index = self.node(RECIP, a)
        if note is not None:
            self.notes[index] = note
        return self.scale(index, 1 / k)

    def sin(self, a: int) -> int:
        """sin a."""
        if self.value(a) == 0:
            return self.number(ZERO)
        base, k = self.coefficient(a)
        if k < 0:
            return self.neg(self.sin(self.scale(base, -k)))
        index = self.node(SIN, a)
        self.node(COS, a)
        return index

    def cos(self, a: int) -> int:
        """cos a. Sine and cosine of one angle are always neighbours."""
        if self.value(a) == 0:
            return self.number(ONE)
        base, k = self.coefficient(a)
        if k < 0:
            a = self.scale(base, -k)
        self.node(SIN, a)
        return self.node(COS, a)

    def exp(self, a: int) -> int:
        """exp a."""
        return self.number(ONE) if self.value(a) == 0 else self.node(EXP, a)

    def log(self, a: int, note: str | None = None) -> int:
        """log a, defined for a > 0."""
        value = self.value(a)
        if value is not None:
            if value <= 0:
                raise ModegraphError(note or f"the logarithm of the constant {float(value):g} is not defined")
            if value == 1:
                return self.number(ZERO)
        self.node(RECIP, a)
        index = self.node(LOG, a)
        if note is not None:
            self.notes[index] = note
        return index

    def atan(self, a: int) -> int:
        """arctan a."""
        if self.value(a) == 0:
            return self.number(ZERO)
        base, k = self.coefficient(a)
        if k < 0:
            return self.neg(self.atan(self.scale(base, -k)))
        self.recip(self.shift(self.sqr(a), ONE))
        return self.node(ATAN, a)

    def relu(self, a: int) -> int:
        """max(a, 0)."""
        value = self.value(a)
        if value is not None:
            return self.number(max(value, ZERO))
        return a if self.signs[a] >= NONNEGATIVE else self.node(RELU, a)

    def absolute(self, a: int) -> int:
        """|a| = 2 relu(a) - a."""
        return self._kinked("abs", (a,), self.sub(self.scale(self.relu(a), Fraction(2)), a), a)

    def maximum(self, a: int, b: int) -> int:
        """max(a, b) = b + relu(a - b)."""
        gap = self.sub(a, b)
        return self._kinked("max", (a, b), self.add(b, self.relu(gap)), gap)

    def minimum(self, a: int, b: int) -> int:
        """min(a, b) = a - relu(a - b)."""
        gap = self.sub(a, b)
        return self._kinked("min", (a, b), self.sub(a, self.relu(gap)), gap)

    def _kinked(self, kind: str, operands: tuple[int, ...], index: int, gap: int) -> int:
        if self.nodes[self.relu(gap)].op == RELU and index > max(operands):
            self.origins.setdefault(index, (kind, operands))
        return index

    def square_root(self, a: int, note: str | None = None) -> int:
        """sqrt(a) = exp(log(a) / 2), differentiable, hence defined, for a > 0 only."""
        value = self.value(a)
        if value is not None and value >= 0:
            root = rational_root(value)
            if root is not None:
                return self.number(root)
        index = self.exp(self.scale(self.log(a, note), Fraction(1, 2)))
        self.origins.setdefault(index, ("sqrt", (a,)))
        return index

    def step(self, a: int) -> int:
        """1 where a > 0, else 0."""
        value = self.value(a)
        if value is not None:
            return self.number(ONE if value > 0 else ZERO)
        return self.node(STEP, a)

    def where(self, condition: int, then: int, otherwise: int) -> int:
        """then where condition > 0, else otherwise."""
        value = self.value(condition)
        if value is not None:
            return then if value > 0 else otherwise
        if then == otherwise:
            self.drop(condition)
            return then
        return self.node(WHERE, then, otherwise, condition)

    def reachable(self, roots: list[int]) -> list[int]:
        """Numbers of all nodes the roots are made of, ascending (operands first)."""
        seen: set[int] = set()
        stack = list(roots)
        while stack:
            index = stack.pop()
            if index in seen:
                continue
            seen.add(index)
            op, a, b, c, _ = self.nodes[index]
            if op > VAR:
                stack.extend(k for k in (a, b, c) if k >= 0)
        return sorted(seen)
