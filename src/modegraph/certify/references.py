"""R^ij: for which references a switch is proved (method, section 2, eq. 8), for finite classes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from modegraph.errors import ModegraphError

Floats = NDArray[np.float64]
Parameter = Floats | None


def match_parameter(parameters: Sequence[Parameter], p: Any) -> int | None:
    """Position of the reference named ``p`` in a finite class, or None if it is not there.

    ``p`` is compared exactly. In a class of one, ``None`` and ``()`` name its only member.
    """
    if p is None or (isinstance(p, tuple | list) and not p):
        return 0 if len(parameters) == 1 else None
    try:
        value = np.atleast_1d(np.asarray(p, dtype=float))
    except (TypeError, ValueError):
        return None
    for position, known in enumerate(parameters):
        if known is not None and np.array_equal(np.atleast_1d(known), value):
            return position
    return None


def parameter_text(p: Parameter) -> str:
    """A reference as a person reads it: ``[0.1, 2]``, or ``the only one`` without parameters."""
    if p is None:
        return "the only one"
    return "[" + ", ".join(f"{float(v):.6g}" for v in np.atleast_1d(p)) + "]"


@dataclass(frozen=True)
class Cell:
    """A product of references inside R^ij: every source goes with every target.

    Attributes
    ----------
    source_index, target_index : tuple[int, ...]
        Positions in the two classes; they identify the cell.
    source, target : tuple of arrays or None
        The references themselves.
    """

    source_index: tuple[int, ...]
    target_index: tuple[int, ...]
    source: tuple[Parameter, ...] = field(compare=False)
    target: tuple[Parameter, ...] = field(compare=False)


class References:
    """The certified pairs (r_i, r_j) of one switch, as a relation between two finite classes.

    Iterating gives the pairs in class order; ``(r_i, r_j) in refs`` asks for one of them.

    Attributes
    ----------
    source, target : tuple of arrays or None
        The projections R^ij_i and R^ij_j (None is the only member of a class without parameters).
    cells : tuple[Cell, ...]
        Disjoint products whose union is exactly R^ij; each feeds Algorithm 1 as a submode.
    decoupled : bool
        R^ij is not empty and equals the product of its projections (eq. 10).
    volume : (float, float)
        Lower and upper bound of the number of pairs; they differ by the undecided ones.
    """

    def __init__(
        self,
        sources: Sequence[Parameter],
        targets: Sequence[Parameter],
        pairs: Iterable[tuple[int, int]],
        undecided: int = 0,
    ) -> None:
        """Relate ``sources[a]`` with ``targets[b]`` for every ``(a, b)`` in ``pairs``."""
        self._sources = tuple(sources)
        self._targets = tuple(targets)
        self._pairs = tuple(sorted(set(pairs)))
        self._known = frozenset(self._pairs)
        self._undecided = undecided

    @property
    def source(self) -> tuple[Parameter, ...]:
        return tuple(self._sources[a] for a in sorted({a for a, _ in self._pairs}))

    @property
    def target(self) -> tuple[Parameter, ...]:
        return tuple(self._targets[b] for b in sorted({b for _, b in self._pairs}))

    @property
    def cells(self) -> tuple[Cell, ...]:
        rows = self._grouped(self._pairs)
        columns = [(t, s) for s, t in self._grouped([(b, a) for a, b in self._pairs])]
        products = rows if len(rows) <= len(columns) else columns
        return tuple(
            Cell(
                source_index=s,
                target_index=t,
                source=tuple(self._sources[a] for a in s),
                target=tuple(self._targets[b] for b in t),
            )
            for s, t in sorted(products)
        )

    @property
    def decoupled(self) -> bool:
        return len(self.cells) == 1

    @property
    def volume(self) -> tuple[float, float]:
        return float(len(self._pairs)), float(len(self._pairs) + self._undecided)

    def contains(self, r_i: Any, r_j: Any) -> bool:
        """True if the switch is certified for these two references (compared exactly)."""
        return (match_parameter(self._sources, r_i), match_parameter(self._targets, r_j)) in self._known

    def sample(self, n: int, seed: int | None = None) -> list[tuple[Parameter, Parameter]]:
        """``n`` pairs drawn uniformly with replacement.

        Raises
        ------
        ModegraphError
            If R^ij is empty.
        """
        if not self._pairs:
            raise ModegraphError("cannot sample: no pair of references is certified for this switch")
        chosen = np.random.default_rng(seed).integers(len(self._pairs), size=n)
        return [self._pair(self._pairs[k]) for k in chosen]

    def __contains__(self, pair: object) -> bool:
        return isinstance(pair, tuple | list) and len(pair) == 2 and self.contains(*pair)

    def __iter__(self) -> Iterator[tuple[Parameter, Parameter]]:
        return (self._pair(pair) for pair in self._pairs)

    def __len__(self) -> int:
        return len(self._pairs)

    def __repr__(self) -> str:
        possible = len(self._sources) * len(self._targets)
        return f"References({len(self._pairs)} of {possible} pairs certified)"

    def _pair(self, pair: tuple[int, int]) -> tuple[Parameter, Parameter]:
        return self._sources[pair[0]], self._targets[pair[1]]

    @staticmethod
    def _grouped(pairs: Iterable[tuple[int, int]]) -> list[tuple[tuple[int, ...], tuple[int, ...]]]:
        """Products with disjoint first factors: all rows that have the same second factor."""
        row: dict[int, list[int]] = {}
        for a, b in pairs:
            row.setdefault(a, []).append(b)
        equal: dict[tuple[int, ...], list[int]] = {}
        for a, targets in row.items():
            equal.setdefault(tuple(sorted(targets)), []).append(a)
        return [(tuple(sorted(sources)), targets) for targets, sources in equal.items()]
