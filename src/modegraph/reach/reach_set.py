"""The one type between what encloses trajectories and what asks about them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import overload

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.monomials import Monomials
from modegraph.enclosure.rounding import UNIT
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.generators import generator_box, with_box
from modegraph.reach.start.piece import Piece
from modegraph.reach.start.restriction import Restriction

Floats = NDArray[np.float64]

BOX_ROOM = 1.0 + 1e-7
"""A box that rounding errors are added to is widened by this: more than the additions lose."""


@dataclass(frozen=True, eq=False)
class ReachSet:
    """{p(xi) + sum_gk G_gk zeta_gk + e : xi in a piece, |zeta_gk| <= 1, |e| <= box}.

    What may be relied on:

    - xi are the variables of ``piece``, each scaled to [-1, 1]; p shares them with every other set over the piece, so
      that the same xi at two instants is the same start with the same unknown constants.
    - p (n, N) are polynomials over the first N monomials of the table of ``bounds``. They may have coefficients
      that are not finite, where an enclosure broke down: then the set is everything, `is_finite` says so, and bounds
      are infinite or NaN, neither of which proves anything.
    - G (g, n, Nq), Nq <= N, is what G_g(xi) zeta_g of a flow is inside: each coefficient counts as a generator of
      its own. What a coordinate has in common with another is kept. g = 0 is possible.
    - box (n,) is not negative. It is what is known of each coordinate alone.
    - All methods give bounds outward: whatever they say of the set is proved, rounding included. ``project`` and
      ``select`` are exact.

    Targets and norms give gauges of it (`Region`, `Quadric`), parallelotopes half-widths (`half_widths`), and
    a restart makes a piece of it.
    """

    bounds: PolynomialBounds
    p: Floats
    G: Floats
    box: Floats

    @classmethod
    def of(cls, bounds: PolynomialBounds, p: Floats, G: Floats | None = None) -> ReachSet:
        """A set without a box, and without generators if none are given."""
        return cls(bounds, p, np.zeros((0, len(p), 1)) if G is None else G, np.zeros(len(p)))

    @property
    def dim(self) -> int:
        return len(self.p)

    @property
    def piece(self) -> Piece:
        return self.bounds.piece

    @property
    def is_finite(self) -> bool:
        return bool(np.isfinite(self.p).all() and np.isfinite(self.G).all() and np.isfinite(self.box).all())

    def select(self, states: Sequence[int]) -> ReachSet:
        """Its projection to some of the states."""
        rows = list(states)
        return ReachSet(self.bounds, self.p[rows], self.G[:, rows], self.box[rows])

    def project(self, n: int) -> ReachSet:
        """Its projection to the first n states."""
        return ReachSet(self.bounds, self.p[:n], self.G[:, :n], self.box[:n])

    def plus_box(self, radius: Floats) -> ReachSet:
        """Its sum with a box of radii (n,)."""
        return replace(self, box=np.nextafter(self.box + radius, np.inf) if self.box.any() else radius)

    @property
    def spread(self) -> Floats:
        """Radii (n,) of a box around the generators and the box, rounded up."""
        return _sum(generator_box(self.G), self.box)

    def ranges(self) -> tuple[Floats, Floats]:
        """A box (lo, hi), each (n,), around it."""
        lo, hi = self.bounds.ranges(self.p)
        z = self.spread
        return np.nextafter(lo - z, -np.inf), np.nextafter(hi + z, np.inf)

    def support(self, directions: Floats) -> Floats:
        """Upper bounds (h,) of d'x over it, for directions d (h, n)."""
        head = self.bounds.upper(directions @ self.p)
        along = np.abs(np.einsum("hi,gik->hgk", directions, self.G)).sum(axis=(1, 2)) + np.abs(directions) @ self.box
        size = np.abs(directions) @ (np.abs(self.p).sum(axis=1) + self.spread)
        lost = 8.0 * (self.p.size + self.G.size + 8) * UNIT * size
        return np.asarray(np.nextafter(head + along + lost, np.inf))


@dataclass(frozen=True, eq=False)
class ReachSets:
    """K reach sets over one piece, for what is bounded for many instants at once.

    p (K, n, N), generators: K arrays (g, n, Nq) of any g, box (K, n); each is a `ReachSet`, which an index gives.
    """

    bounds: PolynomialBounds
    p: Floats
    generators: Sequence[Floats]
    box: Floats

    @classmethod
    def of(cls, bounds: PolynomialBounds, sets: Sequence[ReachSet], dim: int) -> ReachSets:
        """Sets of this dimension over the piece of ``bounds``; there may be none."""
        if not sets:
            return cls(bounds, np.zeros((0, dim, 1)), [], np.zeros((0, dim)))
        p, box = np.stack([s.p for s in sets]), np.stack([s.box for s in sets])
        return cls(bounds, p, [s.G for s in sets], box)

    @classmethod
    def one(cls, reach: ReachSet) -> ReachSets:
        return cls(reach.bounds, reach.p[None], [reach.G], reach.box[None])

    def __len__(self) -> int:
        return len(self.p)

    @property
    def dim(self) -> int:
        return int(self.p.shape[1])

    @property
    def piece(self) -> Piece:
        return self.bounds.piece

    @overload
    def __getitem__(self, k: int) -> ReachSet: ...
    @overload
    def __getitem__(self, k: slice | Sequence[int]) -> ReachSets: ...

    def __getitem__(self, k: int | slice | Sequence[int]) -> ReachSet | ReachSets:
        if isinstance(k, int | np.integer):
            return ReachSet(self.bounds, self.p[k], self.generators[k], self.box[k])
        some = self.generators[k] if isinstance(k, slice) else [self.generators[i] for i in k]
        return ReachSets(self.bounds, self.p[k], some, self.box[k])

    @property
    def are_finite(self) -> NDArray[np.bool_]:
        """(K,): whether the polynomials and the box of each are."""
        return np.asarray(np.isfinite(np.abs(self.p).sum(axis=2)).all(axis=1) & np.isfinite(self.box).all(axis=1))

    def project(self, n: int) -> ReachSets:
        """Their projections to the first n states."""
        return ReachSets(self.bounds, self.p[:, :n], [G[:, :n] for G in self.generators], self.box[:, :n])

    @property
    def spread(self) -> Floats:
        """Radii (K, n) of boxes around generators and boxes, rounded up."""
        if not len(self):
            return np.zeros((0, self.dim))
        return _sum(np.stack([generator_box(G) for G in self.generators]), self.box)

    @property
    def polynomials(self) -> ReachSets:
        """Their polynomial parts and boxes, without generators."""
        return replace(self, generators=[np.zeros((0, self.dim, 1))] * len(self))

    @property
    def without_boxes(self) -> ReachSets:
        """The same sets, their boxes written as generators."""
        if not self.box.any():
            return self
        some = [with_box(G, radius) for G, radius in zip(self.generators, self.box, strict=True)]
        return replace(self, generators=some, box=np.zeros_like(self.box))

    def restricted(self, child: Piece, table: Monomials) -> ReachSets:
        """Their parts over a child of their piece, up to what rounding adds to the boxes.

        The generators stay: their coefficients count one by one, over every piece.
        """
        N = self.p.shape[2]
        p, lost = Restriction(self.piece, child, table, N).apply(self.p)
        return ReachSets(PolynomialBounds(child, table, N), p, self.generators, (self.box + lost) * BOX_ROOM)


def _sum(radius: Floats, box: Floats) -> Floats:
    return np.nextafter(radius + box, np.inf) if box.any() else radius
