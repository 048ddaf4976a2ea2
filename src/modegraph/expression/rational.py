"""Traced scalars as rational functions of their atoms, with exact arithmetic by python-flint.

Atoms are variables and the nodes that are not rational operations (sin, exp, max(., 0), ...). A form is a
polynomial over a product of known denominator factors; cancellation is exact division by a factor, so no
multivariate greatest common divisor (whose cost cannot be bounded beforehand) is ever taken. Every operation
is counted as work, from the sizes of its operands, before it is done.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from modegraph.expression.graph import ONE, ZERO, Nodes
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
    SIN,
    SQR,
    SUB,
    VAR,
)  # fmt: skip
from modegraph.expression.polynomials import CALL, TERMS, Polynomial, Ring
from modegraph.expression.work import TooBig, Work

RATIONAL = frozenset((CONST, ADD, SUB, MUL, SQR, MULC, ADDC, RECIP))
SAME = 50
DEEPEST = 400
"""Nodes compared with a polynomial, and degrees, added up, of one that is nested by recursion."""

NEST, NODE = 0.1, 0.6
"""Work of a term and atom looked at when a sum is nested, and of a node visited."""

WEIGHTS = {ADD: 0.1, SUB: 0.1, MULC: 0.1, ADDC: 0.1, CONST: 0.0, VAR: 0.0, RECIP: 3.0} | dict.fromkeys(
    (SIN, COS, EXP, LOG, ATAN), 4.0
)


def cost(graph: Nodes, roots: list[int], work: Work) -> float:
    """What a tape with these roots costs; operations without a weight count 1."""
    nodes = graph.reachable(roots)
    work.add(NODE * len(nodes))
    return sum(WEIGHTS.get(graph.nodes[k].op, 1.0) for k in nodes)


@dataclass
class Form:
    """numerator / product of factors[k] ** powers[k]."""

    numerator: Polynomial
    powers: dict[int, int] = field(default_factory=dict)


class Field:
    """Rational functions over a fixed list of atoms.

    Parameters
    ----------
    graph : the graph the atoms belong to
    atoms : node numbers; in the order of creation
    reduce : apply sin^2 = 1 - cos^2 and exp(log(a) / 2)^2 = a
    work : every operation is counted, and raises `TooBig` where so much is not left
    """

    def __init__(self, graph: Nodes, atoms: Sequence[int], *, reduce: bool, work: Work) -> None:
        self.graph = graph
        self.work = work
        self._reduce = reduce
        # Lexicographic with later atoms first, and a sine before its cosine: relations rewrite downwards.
        self.atoms = sorted(atoms, key=lambda k: k + 1.5 if graph.nodes[k].op == SIN else k, reverse=True)
        self._ring = Ring(len(self.atoms), work)
        self.position = {atom: k for k, atom in enumerate(self.atoms)}
        self.factors: list[Polynomial] = []
        self.reciprocals: list[int | None] = []
        self._named: dict[int, list[tuple[Polynomial, int]]] = {}

    def constant(self, value: Fraction) -> Form:
        """A number."""
        return Form(self._ring.one * self._ring.number(value))

    def atom(self, index: int) -> Form:
        """An atom of the field, by node number."""
        return Form(self._ring.generators[self.position[index]])

    def name(self, form: Form, node: int) -> None:
        """Remember a node that has this form, to be used instead of an expansion."""
        if not form.powers:
            self._named.setdefault(len(form.numerator), []).append((form.numerator, node))

    def relate(self, atom: Form, square: Form) -> None:
        """Let the square of an atom be a polynomial in atoms that come later in the order."""
        if not self._reduce or square.powers or len(square.numerator) > TERMS // 20:
            return
        self._ring.relate(atom.numerator**2 - square.numerator)

    def _lowest(self, form: Form) -> Form:
        if not form.numerator:
            return Form(form.numerator)
        powers = dict(form.powers)
        p = form.numerator
        for k in form.powers:
            while powers[k]:
                quotient = self._ring.divided(p, self.factors[k])
                if quotient is None:
                    break
                p, powers[k] = quotient, powers[k] - 1
        return Form(p, {k: e for k, e in powers.items() if e})

    def product(self, powers: dict[int, int]) -> Polynomial:
        """The polynomial of a denominator."""
        p = self._ring.one
        for k, e in powers.items():
            for _ in range(e):
                p = self._ring.times(p, self.factors[k])
        return p

    def add(self, a: Form, b: Form, sign: int = 1) -> Form:
        """a + b or a - b."""
        self.work.require(self._ring.reading(a.numerator, b.numerator))
        if a.powers == b.powers:
            numerator = a.numerator + b.numerator if sign > 0 else a.numerator - b.numerator
            total = Form(numerator, a.powers)
        else:
            keys = sorted({*a.powers, *b.powers})
            powers = {k: max(a.powers.get(k, 0), b.powers.get(k, 0)) for k in keys}
            left = self._ring.times(a.numerator, self.product({k: e - a.powers.get(k, 0) for k, e in powers.items()}))
            right = self._ring.times(b.numerator, self.product({k: e - b.powers.get(k, 0) for k, e in powers.items()}))
            total = Form(left + right if sign > 0 else left - right, powers)
        if len(total.numerator) > TERMS:
            raise TooBig
        return self._lowest(total) if total.powers else total

    def mul(self, a: Form, b: Form) -> Form:
        """a * b."""
        powers = dict(a.powers)
        for k, e in b.powers.items():
            powers[k] = powers.get(k, 0) + e
        left = self._lowest(Form(a.numerator, b.powers)) if b.powers else Form(a.numerator)
        right = self._lowest(Form(b.numerator, a.powers)) if a.powers else Form(b.numerator)
        for part, whole in ((left, b.powers), (right, a.powers)):
            for k, e in whole.items():
                powers[k] -= e - part.powers.get(k, 0)
        return Form(self._ring.times(left.numerator, right.numerator), {k: e for k, e in powers.items() if e})

    def scale(self, a: Form, k: Fraction) -> Form:
        """k * a."""
        self.work.add(self._ring.reading(a.numerator))
        return Form(a.numerator * self._ring.number(k), a.powers) if k else self.constant(ZERO)

    def reciprocal(self, a: Form, node: int | None = None) -> Form:
        """1 / a. `node` is the reciprocal in the graph, to be used again when the form is written out."""
        rest, powers = a.numerator, dict[int, int]()
        self.work.require(self._ring.term * len(rest))
        monomial = [min(exponents) for exponents in zip(*rest.monoms(), strict=True)] if len(rest) else []
        for generator, e in zip(self._ring.generators, monomial, strict=False):
            if e and len(rest) > 1:
                k = self._factor(generator, None)
                powers[k] = e
                rest = rest / generator**e
        for k, known in enumerate(self.factors):
            while len(rest) > 1 or not rest.is_constant():
                quotient = self._ring.divided(rest, known)
                if quotient is None:
                    break
                rest, powers[k] = quotient, powers.get(k, 0) + 1
        if not rest.is_constant():
            k = self._factor(rest, None if powers or a.powers else node)
            powers[k] = powers.get(k, 0) + 1
        return self._lowest(Form(self.product(a.powers) / rest.leading_coefficient(), powers))

    def _factor(self, p: Polynomial, node: int | None) -> int:
        monic = p / p.leading_coefficient()
        for k, known in enumerate(self.factors):
            if known == monic:
                if self.reciprocals[k] is None and node is not None:
                    self.reciprocals[k] = self._monic_reciprocal(p, node)
                return k
        self.factors.append(monic)
        self.reciprocals.append(None if node is None else self._monic_reciprocal(p, node))
        return len(self.factors) - 1

    def _monic_reciprocal(self, p: Polynomial, node: int) -> int:
        return self.graph.scale(node, _fraction(p.leading_coefficient()))

    def quotient(self, a: Form, b: Form) -> Form | None:
        """a / b where the numerator of b divides a's exactly, else None: the result has no new poles."""
        if not b.numerator:
            return None
        q = self._ring.divided(self._ring.times(a.numerator, self.product(b.powers)), b.numerator)
        return None if q is None else self._lowest(Form(q, a.powers))

    def affine(self, a: Form, b: Form) -> tuple[Fraction, Fraction] | None:
        """(alpha, beta) with a = alpha b + beta, or None."""
        if a.powers != b.powers and (a.powers or b.powers):
            return None
        if a.powers or not b.numerator:
            return None
        if a.numerator.is_constant():
            alone = b.numerator.is_constant()
            value = _constant(a.numerator)
            return (value / _constant(b.numerator), ZERO) if alone else (ZERO, value)
        self.work.require(self._ring.reading(a.numerator, b.numerator))
        slope = a.numerator.leading_coefficient() / b.numerator.leading_coefficient()
        rest = a.numerator - slope * b.numerator
        return (_fraction(slope), _constant(rest)) if rest.is_constant() else None

    def express(self, form: Form, atoms: dict[int, int]) -> int:
        """Write a form as a node: quotient + rest * reciprocals. `atoms` maps atoms to nodes."""
        nodes = [atoms[a] for a in self.atoms]
        g = self.graph
        if not form.powers:
            return self._horner(form.numerator, nodes)
        reciprocal = self._over(form.powers, nodes)
        versions = []
        for quotient, rest in self._divisions(form):
            over = g.mul(self._horner(rest, nodes), reciprocal)
            versions.append(g.add(self._horner(quotient, nodes), over))
        return min(versions, key=lambda k: cost(g, [k], self.work))

    def split(self, form: Form, values: dict[int, Fraction], atoms: dict[int, int]) -> tuple[int, int] | None:
        """Nodes q and rest with form = q + rest: q is the quotient where atoms of the denominator have these values.

        None where the quotient is zero.
        """
        denominator = self.product(form.powers)
        inside = denominator.degrees()
        fixed = {self.position[a]: self._ring.number(v) for a, v in values.items() if inside[self.position[a]]}
        self.work.require(self._ring.reading(form.numerator, denominator))
        top, bottom = (self._ring.at(p, fixed) for p in (form.numerator, denominator))
        quotient = self._ring.division(top, bottom)[0] if bottom else bottom
        if not quotient:
            return None
        rest = self._ring.normal(form.numerator - self._ring.times(quotient, denominator))
        nodes = [atoms[a] for a in self.atoms]
        over = self.graph.mul(self._horner(rest, nodes), self._over(form.powers, nodes))
        return self._horner(quotient, nodes), over

    def _over(self, powers: dict[int, int], nodes: list[int]) -> int:
        """1 / denominator as a node."""
        g = self.graph
        reciprocal = g.number(ONE)
        for k, e in powers.items():
            known = self.reciprocals[k]
            if known is None:
                known = self.reciprocals[k] = g.recip(self._horner(self.factors[k], nodes))
            reciprocal = g.mul(reciprocal, g.power(known, e))
        return reciprocal

    def _divisions(self, form: Form) -> list[tuple[Polynomial, Polynomial]]:
        """Ways to write numerator = quotient * denominator + rest."""
        p, denominator = form.numerator, self.product(form.powers)
        ways = [(p - p, p), self._ring.division(p, denominator)]
        self.work.require(self._ring.term * len(p))
        inner = [k for k, degree in enumerate(denominator.degrees()) if degree]
        groups: dict[tuple[int, ...], Any] = {}
        for monomial, coefficient in p.to_dict().items():
            outer = tuple(0 if k in inner else e for k, e in enumerate(monomial))
            groups.setdefault(outer, {})[tuple(e if k in inner else 0 for k, e in enumerate(monomial))] = coefficient
        if len(groups) > 1:
            quotient, rest = p - p, p - p
            for outer, terms in groups.items():
                monomial = self._ring.polynomial({outer: 1})
                part = self._ring.polynomial(terms)
                exact = self._ring.divided(part, denominator)
                if exact is None:
                    rest += monomial * part
                else:
                    quotient += monomial * exact
            ways.append((quotient, rest))
        return ways

    def _horner(self, p: Polynomial, nodes: list[int]) -> int:
        # The user's own form wins a tie: gains times small differences round better than expanded sums.
        choices = [node for known, node in self._named.get(len(p), ())[:SAME] if known == p]
        if sum(p.degrees()) <= DEEPEST:
            self.work.require(self._ring.term * len(p))
            terms = {tuple(map(int, m)): _fraction(c) for m, c in p.to_dict().items()}
            choices.append(_nest(self.graph, terms, nodes, self.work))
        if not choices:
            raise TooBig
        return min(choices, key=lambda k: cost(self.graph, [k], self.work))


def _fraction(c: Any) -> Fraction:
    return Fraction(int(c.p), int(c.q))


def _constant(p: Polynomial) -> Fraction:
    return _fraction(p.leading_coefficient()) if p else ZERO


Terms = dict[tuple[int, ...], Fraction]


def _nest(graph: Nodes, terms: Terms, nodes: list[int], work: Work) -> int:
    """Greedy multivariate Horner scheme: the atom that occurs in most terms is taken out first."""
    if not terms:
        return graph.number(ZERO)
    work.require(CALL + NEST * len(terms) * (6 + len(nodes)))
    if len(terms) > 1:
        counts = [sum(1 for m in terms if m[k]) for k in range(len(nodes))]
        best = max(range(len(nodes)), key=counts.__getitem__, default=0)
        if counts and counts[best] > 1:
            inside = {m: c for m, c in terms.items() if m[best]}
            e = min(m[best] for m in inside)
            outside = {m: c for m, c in terms.items() if not m[best]}
            reduced = {(*m[:best], m[best] - e, *m[best + 1 :]): c for m, c in inside.items()}
            taken = graph.mul(graph.power(nodes[best], e), _nest(graph, reduced, nodes, work))
            return graph.add(taken, _nest(graph, outside, nodes, work)) if outside else taken
    total = graph.number(ZERO)
    for m, c in sorted(terms.items(), reverse=True):
        product = graph.number(ONE)
        for k, e in enumerate(m):
            if e:
                product = graph.mul(product, graph.power(nodes[k], e))
        total = graph.add(total, graph.scale(product, c))
    return total


def combine(field_: Field, index: int, forms: dict[int, Form | None], node: int | None = None) -> Form | None:
    """The form of a rational node from the forms of its operands; None if it got too big.

    `node` is what stands for the node in what is written out (by default itself).
    """
    op, a, b, _, const = field_.graph.nodes[index]
    if op == CONST and const is not None:
        return field_.constant(const)
    left = forms[a]
    right = forms[b] if b >= 0 else left
    if left is None or right is None:
        return None
    if field_.work.over:
        return None
    try:
        if op in (ADD, SUB):
            return field_.add(left, right, 1 if op == ADD else -1)
        if op in (MUL, SQR):
            return field_.mul(left, right)
        if op == MULC and const is not None:
            return field_.scale(left, const)
        if op == ADDC and const is not None:
            return field_.add(left, field_.constant(const))
        return field_.reciprocal(left, index if node is None else node) if left.numerator else None
    except TooBig:
        return None


def atoms_of(graph: Nodes, order: Iterable[int]) -> list[int]:
    """The atoms among nodes."""
    return [k for k in order if graph.nodes[k].op not in RATIONAL]


def square_root_argument(graph: Nodes, index: int) -> int | None:
    """a if the node is exp(log(a) / 2)."""
    node = graph.nodes[index]
    if node.op != EXP:
        return None
    base, k = graph.coefficient(node.a)
    inner = graph.nodes[base]
    return inner.a if inner.op == LOG and k == Fraction(1, 2) else None
