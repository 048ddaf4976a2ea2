"""Exact polynomials by python-flint, every operation counted as work from the sizes of its operands.

A call of the library cannot be stopped. So its work is bounded before it is made, and where it cannot be, the
operation goes step by step.
"""

from __future__ import annotations

from fractions import Fraction
from math import comb, prod
from operator import sub
from typing import Any

from modegraph.expression.work import TooBig, Work

Polynomial = Any
"""flint.fmpq_mpoly; python-flint ships no usable stubs for it."""

TERMS = 4000
PRODUCTS = 400_000
"""Limits on terms of a polynomial and on term products of one operation."""

CALL, PRODUCT, TERM, EXPONENT, RING = 8.0, 0.1, 5.0, 0.3, 100.0
"""Work of a call, a product of two terms, a term and each of its exponents read, and of a new ring."""


class Ring:
    """Polynomials over the rationals in ``count`` atoms, in lexicographic order.

    Attributes
    ----------
    generators, one : polynomials
    relations : [(atom, polynomial)]
        Polynomials that are zero and begin with the square of an atom; products are rewritten by them.
    term : work of reading a term
    """

    def __init__(self, count: int, work: Work) -> None:
        import flint

        self._flint = flint
        self._inexact = flint.utils.flint_exceptions.DomainError
        self.work = work
        work.add(RING)
        names = [f"a{k}" for k in range(max(count, 1))]
        self._context = flint.fmpq_mpoly_ctx.get(names, flint.Ordering.lex)
        self.generators = self._context.gens()
        self.one = self._context.constant(1)
        self.relations: list[tuple[int, Polynomial]] = []
        # Exponents of a monomial are eight to a word.
        self._wide = 1.0 + len(names) / 32.0
        self.term = TERM + EXPONENT * len(names)

    def number(self, value: Fraction) -> Any:
        """A coefficient."""
        return self._flint.fmpq(value.numerator, value.denominator)

    def polynomial(self, terms: dict[tuple[int, ...], Any]) -> Polynomial:
        """From coefficients by exponents."""
        return self._context.from_dict(terms)

    def at(self, p: Polynomial, values: dict[int, Any]) -> Polynomial:
        """The polynomial with atoms at values, by position."""
        return p.subs({f"a{k}": value for k, value in values.items()}) if values else p

    def relate(self, relation: Polynomial) -> None:
        """Let a polynomial be zero, if it begins with the square of an atom."""
        lead = relation.monomial(0)
        if sum(lead) == 2 and max(lead) == 2:
            self.relations.append((lead.index(2), relation / relation.leading_coefficient()))

    def reading(self, *polynomials: Polynomial) -> float:
        """Work of going through all terms once."""
        return CALL + sum(PRODUCT * len(p) * (self._wide + 0.5 * _words(p)) for p in polynomials)

    def _product_work(self, p: Polynomial, q: Polynomial) -> float:
        left, right = _words(p), _words(q)
        each = self._wide + 0.1 * (left + right) + 0.01 * left * right
        return CALL + PRODUCT * len(p) * len(q) * each

    def normal(self, p: Polynomial) -> Polynomial:
        """Rewritten by the relations."""
        if len(p) > TERMS:
            raise TooBig
        for _ in range(8):
            degrees = p.degrees() if self.relations else ()
            relations = [(k, r) for k, r in self.relations if degrees[k] >= 2]
            if not relations:
                break
            for k, relation in relations:
                # s^2h becomes the h-th power of what s^2 is, with up to so many terms.
                half = p.degrees()[k] // 2
                if len(p) * comb(len(relation) - 2 + half, half) > PRODUCTS:
                    raise TooBig
                self.work.require(self.reading(p))
                quotient, p = divmod(p, relation)
                self.work.add(self._product_work(quotient, relation))
        return p

    def times(self, p: Polynomial, q: Polynomial) -> Polynomial:
        """p * q, rewritten by the relations."""
        if len(p) * len(q) > PRODUCTS:
            raise TooBig
        self.work.require(self._product_work(p, q))
        return self.normal(p * q)

    def divided(self, p: Polynomial, q: Polynomial) -> Polynomial | None:
        """p / q where q divides p exactly, else None."""
        self.work.require(CALL + self.term)
        if not p:
            return p
        ends = ((q.monomial(0), p.monomial(0)), (q.monomial(len(q) - 1), p.monomial(len(p) - 1)))
        if not all(a <= b for inner, outer in ends for a, b in zip(inner, outer, strict=True)):
            return None
        degrees = q.degrees()
        rooms = [b - a + 1 for a, b in zip(degrees, p.degrees(), strict=True)]
        if min(rooms) < 1:
            return None
        # What stands beside one monomial in atoms that q does not have is divided on its own.
        inner = len(p) * prod(room for room, degree in zip(rooms, degrees, strict=True) if degree)
        if min(prod(rooms), inner) * len(q) > PRODUCTS:
            return self._divided_step_by_step(p, q)
        self.work.require(self.reading(p, q))
        try:
            quotient = p / q
        except self._inexact:
            return None
        self.work.add(self._product_work(quotient, q))
        return quotient

    def _divided_step_by_step(self, p: Polynomial, q: Polynomial) -> Polynomial | None:
        """p / q where q divides p exactly, for a quotient that may have too many terms to be tried at once."""
        main = next(k for k, e in enumerate(q.monomial(0)) if e)
        present = [k for k, degree in enumerate(p.degrees()) if degree and k != main]
        self.work.require((1 + len(present)) * self.reading(p, q))
        # What divides p divides it at any values of the other atoms as well.
        values = {k: 2 + k % 5 for k in present}
        top, bottom = self.at(p, values), self.at(q, values)
        if bottom and divmod(top, bottom)[1]:
            return None
        quotient, rest = self.division(p, q)
        return None if rest else quotient

    def division(self, p: Polynomial, q: Polynomial) -> tuple[Polynomial, Polynomial]:
        """Quotient and rest, like divmod, step by step: how many terms they get is not known beforehand."""
        lead, factor = q.monomial(0), q.leading_coefficient()
        inner = [(k, e) for k, e in enumerate(lead) if e]
        quotient = p - p
        while p:
            self.work.require(self.term * len(p))
            part = {
                tuple(map(sub, m, lead)): c / factor for m, c in p.to_dict().items() if all(m[k] >= e for k, e in inner)
            }
            if not part:
                break
            step = self.polynomial(part)
            if len(step) * len(q) > PRODUCTS:
                raise TooBig
            self.work.require(self._product_work(step, q))
            quotient += step
            p -= step * q
            if max(len(p), len(quotient)) > TERMS:
                raise TooBig
        return quotient, p


def _words(p: Polynomial) -> float:
    """64-bit words of a usual coefficient: of the first and the middle one."""
    terms = len(p)
    if not terms:
        return 0.0
    first, middle = p.coefficient(0), p.coefficient(terms // 2)
    bits = max(int(n).bit_length() for c in (first, middle) for n in (c.p, c.q))
    return bits / 64.0
