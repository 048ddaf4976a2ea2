"""One reference of a class flowpipe: its reach sets with the parameters fixed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from modegraph.model.class_start import StartClass
from modegraph.model.mode import Mode
from modegraph.model.start import mode_start
from modegraph.reach.bounds import PolynomialBounds
from modegraph.reach.compiled import CompiledMode
from modegraph.reach.reach_set import ReachSet
from modegraph.reach.start.class_chart import require_same_start
from modegraph.reach.start.substitution import Substitution, holds

Floats = NDArray[np.float64]


class Restrictor:
    """Restricts reach sets of a mode with a continuous class of references to one of them."""

    def __init__(self, mode: Mode, compiled: CompiledMode) -> None:
        self._mode = mode
        self._start = compiled.start
        self._chart = compiled.whole().chart
        self._checked: set[bytes] = set()

    def parameters(self, r: ArrayLike) -> Floats:
        """The parameters (k,) a user names.

        Raises
        ------
        ModegraphError
            If there is no such reference, or its start set in floats is not that of the class.
        """
        p = self._mode.find(r)
        assert p is not None
        if isinstance(self._start, StartClass) and p.tobytes() not in self._checked:
            owner = f"mode {self._mode.label_of(p)!r}"
            require_same_start(self._start, self._chart, mode_start(self._mode, p), p, owner)
            self._checked.add(p.tobytes())
        return p

    def restricted(self, sets: Sequence[ReachSet], p: Floats) -> list[ReachSet]:
        """Sets over the pieces that hold p, with the parameters fixed."""
        known: dict[PolynomialBounds, Substitution] = {}
        found = []
        for reach in sets:
            if not holds(reach.piece, p):
                continue
            if reach.bounds not in known:
                known[reach.bounds] = Substitution(reach.bounds, p)
            found.append(known[reach.bounds](reach))
        return found
