"""R^ij where a class of references is continuous: a certified set of pairs, by inequalities.

A pair is certified where its inequality holds, refuted where a start of the source is proved to rest
outside the target for ever, undecided between.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from modegraph.attach import with_methods
from modegraph.certify.references import Parameter, match_parameter
from modegraph.certify.relation import Relation
from modegraph.errors import ModegraphError
from modegraph.model.sets import Box

if TYPE_CHECKING:
    from modegraph import api

Floats = NDArray[np.float64]
Side = Box | tuple[Parameter, ...]
"""A continuous class, or the members of a finite one."""

SEARCH = 256
"""Pairs tried at once in the search for a certified one."""
ROUNDS = 40
WALK, LINE = 12, 48
"""Moves of a walk inside R^ij between two samples, and points looked at along each."""
SAMPLES = 20000
FEW = 2
"""Up to so many parameters in all, volumes are proved by cells."""
MOST_CELLS, MANY_CELLS = 6000, 60000


@dataclass
class _Cells:
    """Certified boxes of joint parameters and their volume; lo, hi (B, k): boxes that are undecided as a whole."""

    boxes: list[tuple[Floats, Floats]]
    certified: float
    lo: Floats
    hi: Floats


@dataclass(frozen=True)
class ProductCell:
    """Every source reference of the cell goes with every target reference, certified."""

    source: Side
    target: Side


@with_methods
class ContinuousReferences:
    """The certified pairs (r_i, r_j) of one switch, at least one of the classes being continuous.

    ``(r_i, r_j) in refs`` decides one pair by a proof.

    Attributes
    ----------
    source, target : tuple
        Products of these are certified: Boxes of parameters, or members of a finite class (inner
        descriptions of the projections, from ``cells``).
    """

    if TYPE_CHECKING:  # from upper layers
        plot = api.plot_references

    def __init__(self, source: Side, target: Side, relations: dict[tuple[int, int], Relation], same: bool) -> None:
        """``relations[a, b]``: of member a with member b (0 for a continuous class); ``same``: i = j."""
        self._source, self._target = source, target
        self.relations = relations
        self._same = same

    # -- one pair --------------------------------------------------------------------------------

    def contains(self, r_i: Any, r_j: Any) -> bool:
        """True if the switch is certified for these two references."""
        left, right = _find(self._source, r_i), _find(self._target, r_j)
        if left is None or right is None:
            return False
        relation = self.relations.get((left[0], right[0]))
        if relation is None or self._trivial(left[1], right[1])[0]:
            return False
        return bool(relation.certified(left[1], right[1])[0])

    def __contains__(self, pair: object) -> bool:
        return isinstance(pair, tuple | list) and len(pair) == 2 and self.contains(*pair)

    def _trivial(self, source: Floats, target: Floats) -> NDArray[np.bool_]:
        """Pairs of a reference with itself."""
        if not self._same or source.shape != target.shape:
            return np.zeros(len(source), bool)
        return np.asarray((source == target).all(axis=1))

    # -- many pairs ------------------------------------------------------------------------------

    @property
    def sides(self) -> tuple[Side, Side]:
        """The classes of source and target: a Box of parameters, or the members of a finite one."""
        return self._source, self._target

    def statuses(self, r_i: Any, r_j: Any, members: tuple[int, int] = (0, 0)) -> NDArray[np.int64]:
        """1 certified, -1 refuted, 0 undecided, for pairs (B, k_i), (B, k_j) of continuous classes.

        A finite class has no columns; which of its members is meant is in ``members``. Outside the classes
        nothing is said: 0.
        """
        source, target = np.atleast_2d(np.asarray(r_i, float)), np.atleast_2d(np.asarray(r_j, float))
        wanted = [side.dim if isinstance(side, Box) else 0 for side in (self._source, self._target)]
        if [source.shape[1], target.shape[1]] != wanted or len(source) != len(target):
            raise ModegraphError(
                f"statuses: give references (B, {wanted[0]}) of the source and (B, {wanted[1]}) of the target, "
                f"not {source.shape} and {target.shape}"
            )
        relation = self.relations.get(members)
        if relation is None:
            return np.zeros(len(source), np.int64)
        known = np.ones(len(source), bool)
        for side, p in ((self._source, source), (self._target, target)):
            if isinstance(side, Box):
                known &= ((p >= side.lo) & (p <= side.hi)).all(axis=1)
        certified = relation.certified(source, target) & ~self._trivial(source, target)
        return np.where(known, np.where(certified, 1, np.where(relation.refuted(source, target), -1, 0)), 0)

    def sample(self, n: int, seed: int | None = None) -> list[tuple[Parameter, Parameter]]:
        """``n`` certified pairs, spread over R^ij by random walks inside it.

        Raises
        ------
        ModegraphError
            If no certified pair is found.
        """
        rng = np.random.default_rng(seed)
        found: list[tuple[Parameter, Parameter]] = []
        keys = list(self.relations)
        shares = np.bincount(rng.integers(len(keys), size=n), minlength=len(keys)) if keys else np.zeros(0, int)
        for key, share in zip(keys, shares.tolist(), strict=True):
            if share:
                found += self._walk(key, share, rng)
        if len(found) < n and found:
            found += [found[k] for k in rng.integers(len(found), size=n - len(found))]
        if n and not found:
            raise ModegraphError("cannot sample: no pair of references is certified for this switch")
        return found

    @cached_property
    def _bounds(self) -> tuple[Floats, Floats]:
        """Box (lo, hi) of both parameters together."""
        ends = [(s.lo, s.hi) for s in (self._source, self._target) if isinstance(s, Box)]
        return np.concatenate([lo for lo, _ in ends]), np.concatenate([hi for _, hi in ends])

    def _split(self, z: Floats) -> tuple[Floats, Floats]:
        """References (B, ki), (B, kj) of joint parameters z (B, k)."""
        k = self._source.dim if isinstance(self._source, Box) else 0
        nothing = np.zeros((len(z), 0))
        source, target = z[:, :k], z[:, k:]
        if not isinstance(self._source, Box):
            source = nothing
        return source, target if isinstance(self._target, Box) else nothing

    def _gauges(self, key: tuple[int, int], z: Floats) -> Floats:
        source, target = self._split(z)
        gauge = self.relations[key].crossings(source, target).gauge
        gauge[self._trivial(source, target)] = np.inf
        return gauge

    def best(self, r_i: Floats | None, r_j: Floats | None) -> tuple[tuple[int, int], Floats, Floats, float] | None:
        """The closest pair found, with a reference kept where it is given: key, both, and the gauge."""
        found = []
        for key in self.relations:
            within = self._within(key, r_i, r_j)
            if within is not None:
                z, gauge = self.closest(key, np.random.default_rng(1), 1, within)
                source, target = self._split(z)
                found.append((key, source[0], target[0], float(gauge[0])))
        return min(found, key=lambda f: f[3], default=None)

    def all_refuted(self, r_i: Floats | None, r_j: Floats | None) -> bool:
        """Whether every pair is proved refuted, with a reference kept where it is given."""
        for key in self.relations:
            within = self._within(key, r_i, r_j)
            if within is None:
                continue
            cells = self._certified_cells(key, within=within)
            if cells.boxes or len(cells.lo):
                return False
        return True

    def _within(self, key: tuple[int, int], r_i: Floats | None, r_j: Floats | None) -> tuple[Floats, Floats] | None:
        """Box of joint parameters with given references; None where they name other members."""
        lo, hi = (side.copy() for side in self._bounds)
        k = self._source.dim if isinstance(self._source, Box) else 0
        for side, given, index, part in (
            (self._source, r_i, key[0], slice(0, k)), (self._target, r_j, key[1], slice(k, None)),
        ):  # fmt: skip
            if given is None:
                continue
            if isinstance(side, Box):
                lo[part] = hi[part] = given
            elif match_parameter(side, given) != index:
                return None
        return lo, hi

    def closest(
        self, key: tuple[int, int], rng: np.random.Generator, count: int = 8,
        within: tuple[Floats, Floats] | None = None,
    ) -> tuple[Floats, Floats]:  # fmt: skip
        """Joint parameters (count, k) with small gauges (count,): certified ones where some are found."""
        lo, hi = self._bounds if within is None else within
        z = rng.uniform(lo, hi, (SEARCH, len(lo)))
        if self.relations[key].zero is not None and 2 * self._split(z)[0].shape[1] == len(lo):
            # Equal start sets in two classes are inside one another for equal references alone.
            k = len(lo) // 2
            z[: SEARCH // 8, k:] = np.clip(z[: SEARCH // 8, :k], lo[k:], hi[k:])
            z[: SEARCH // 8, :k] = np.clip(z[: SEARCH // 8, k:], lo[:k], hi[:k])
        gauge = self._gauges(key, z)
        width = 0.5 * (hi - lo)
        for _ in range(ROUNDS):
            best = np.argsort(gauge, kind="stable")[: SEARCH // 8]
            if gauge[best[:count]].max() <= 1.0:
                break
            width = 0.8 * width
            near = np.repeat(z[best], 8, axis=0) + width * rng.normal(size=(len(best) * 8, len(lo)))
            near = np.clip(near, lo, hi)
            z = np.concatenate([z[best], near])
            gauge = np.concatenate([gauge[best], self._gauges(key, near)])
        best = np.argsort(gauge, kind="stable")[:count]
        return z[best], gauge[best]

    def _walk(self, key: tuple[int, int], n: int, rng: np.random.Generator) -> list[tuple[Parameter, Parameter]]:
        lo, hi = self._bounds
        start, gauge = self.closest(key, rng)
        start = start[gauge <= 1.0]
        if not len(start):
            return []
        z = start[rng.integers(len(start), size=n)]
        for _ in range(WALK):
            way = rng.normal(size=z.shape) * (hi - lo)
            way *= 2.0 ** -rng.uniform(0.0, 6.0, (n, 1)) / np.linalg.norm(way / (hi - lo), axis=1)[:, None]
            steps = z[:, None] + rng.uniform(-1.0, 1.0, (n, LINE, 1)) * way[:, None]
            inside = ((steps >= lo) & (steps <= hi)).all(axis=2)
            flat = np.clip(steps, lo, hi).reshape(-1, len(lo))
            inside &= (self._gauges(key, flat) <= 1.0).reshape(n, LINE)
            score = np.where(inside, rng.uniform(size=(n, LINE)), -1.0)
            pick = score.argmax(axis=1)
            move = score.max(axis=1) >= 0.0
            z = np.where(move[:, None], steps[np.arange(n), pick], z)
        source, target = self._split(z)
        left = _members(self._source, source, key[0])
        return list(zip(left, _members(self._target, target, key[1]), strict=True))

    # -- shape -----------------------------------------------------------------------------------

    @cached_property
    def cells(self) -> tuple[ProductCell, ...]:
        """Certified products, largest first; they need not cover R^ij, and a thin relation contains none."""
        found: list[ProductCell] = []
        for key in self.relations:
            k = self._source.dim if isinstance(self._source, Box) else 0
            boxes = self._certified_cells(key).boxes
            for lo, hi in sorted(boxes, key=lambda cell: -float(np.prod(cell[1] - cell[0]))):
                source = Box(lo[:k], hi[:k]) if isinstance(self._source, Box) else (self._source[key[0]],)
                target = Box(lo[k:], hi[k:]) if isinstance(self._target, Box) else (self._target[key[1]],)
                if self._same and (np.maximum(lo[:k], lo[k:]) <= np.minimum(hi[:k], hi[k:])).all():
                    # The pair of a reference with itself is no switch.
                    continue
                found.append(ProductCell(source, target))
        return tuple(found)

    def _certified_cells(
        self, key: tuple[int, int], most: int = MOST_CELLS, within: tuple[Floats, Floats] | None = None
    ) -> _Cells:
        """Cells of a box of joint parameters (lo, hi), by default of all; what is in none of them is refuted."""
        relation = self.relations[key]
        lo, hi = (side[None] for side in (self._bounds if within is None else within))
        found = _Cells([], 0.0, lo, hi)
        examined = 0
        while len(lo) and examined + len(lo) <= most:
            yes, no = relation.cells(self._split(lo), self._split(hi))
            found.certified += float(np.prod(hi[yes] - lo[yes], axis=1).sum())
            found.boxes += list(zip(lo[yes], hi[yes], strict=True))
            lo, hi = lo[~yes & ~no], hi[~yes & ~no]
            found.lo, found.hi = lo, hi
            examined += len(yes)
            if len(lo):
                lo, hi = self._halved(lo, hi)
        return found

    def _halved(self, lo: Floats, hi: Floats) -> tuple[Floats, Floats]:
        bounds = self._bounds
        axis = np.argmax((hi - lo) / (bounds[1] - bounds[0] + 1e-300), axis=1)
        rows = np.arange(len(lo))
        middle = 0.5 * (lo[rows, axis] + hi[rows, axis])
        right, left = lo.copy(), hi.copy()
        right[rows, axis] = middle
        left[rows, axis] = middle
        return np.concatenate([lo, right]), np.concatenate([left, hi])

    @property
    def source(self) -> tuple[Side, ...]:
        return tuple(cell.source for cell in self.cells)

    @property
    def target(self) -> tuple[Side, ...]:
        return tuple(cell.target for cell in self.cells)

    @cached_property
    def decoupled(self) -> bool:
        """R^ij is proved to be a product: it does not depend on one of the references, or everything is certified."""
        members = [1 if isinstance(side, Box) else len(side) for side in (self._source, self._target)]
        if self._same or not self.relations or len(self.relations) < members[0] * members[1]:
            return False
        if members == [1, 1] and any(self.relations[0, 0].ignores):
            return bool(self.closest((0, 0), np.random.default_rng(1), 1)[1][0] <= 1.0)
        return all(self._covers(self._certified_cells(key)) for key in self.relations)

    def _covers(self, cells: _Cells) -> bool:
        """Whether certified boxes, cut out of the whole by halving, are all of it."""
        return not len(cells.lo) and cells.certified >= self._total * (1.0 - 1e-9)

    @property
    def _total(self) -> float:
        return float(np.prod([np.prod(s.hi - s.lo) for s in (self._source, self._target) if isinstance(s, Box)]))

    @cached_property
    def volume(self) -> tuple[float, float]:
        """Lower and upper bound of the volume of R^ij in the parameters of both classes (finite ones count members).

        Proved by cells for up to two parameters in all. Beyond that the cells that are neither certified
        nor refuted as a whole are sampled, every sample decided by proof: an estimate, off by about 1 %.
        """
        lower = upper = 0.0
        for key, relation in self.relations.items():
            sharp = len(self._bounds[0]) <= FEW
            cells = self._certified_cells(key, MANY_CELLS if sharp else MOST_CELLS)
            left = np.prod(cells.hi - cells.lo, axis=1)
            certified, possible = cells.certified, cells.certified + float(left.sum())
            if not sharp and left.sum() > 0.0:
                rng = np.random.default_rng(0)
                chosen = rng.choice(len(left), SAMPLES, p=left / left.sum())
                source, target = self._split(rng.uniform(cells.lo[chosen], cells.hi[chosen]))
                yes, no = relation.crossings(source, target).certified, relation.refuted(source, target)
                certified += float(yes.mean()) * float(left.sum())
                possible -= float(no.mean()) * float(left.sum())
            lower += certified
            upper += possible
        return lower, upper

    def __repr__(self) -> str:
        return f"ContinuousReferences({len(self.relations)} relations)"


def _find(side: Side, r: Any) -> tuple[int, Floats] | None:
    """Position and parameters (1, k) of a reference of one side; None if it is not there.

    Whether a continuous class contains it is left to the relation.
    """
    if not isinstance(side, Box):
        index = match_parameter(side, r)
        return None if index is None else (index, np.zeros((1, 0)))
    try:
        p = np.asarray(r, dtype=float)
    except (TypeError, ValueError):
        return None
    return (0, p.reshape(1, -1)) if p.size == side.dim and p.ndim < 2 else None


def _members(side: Side, values: Floats, index: int) -> Sequence[Parameter]:
    if isinstance(side, Box):
        return list(values)
    return [side[index]] * len(values)
