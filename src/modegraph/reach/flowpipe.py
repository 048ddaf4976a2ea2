"""Everything a mode can reach from its start set until a horizon, as boxes at and between instants."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from modegraph.attach import with_methods
from modegraph.cores import one_core
from modegraph.errors import ModegraphError
from modegraph.model.faithful import require_faithful
from modegraph.model.mode import Mode
from modegraph.model.sets import Box, Set
from modegraph.reach.compiled import compile_mode
from modegraph.reach.cover.chain import Chain
from modegraph.reach.cover.cutting import Cutting
from modegraph.reach.failure import Failure
from modegraph.reach.flow.slices import Slicer, hull, outline
from modegraph.reach.reach_set import ReachSet
from modegraph.reach.restrictor import Restrictor

if TYPE_CHECKING:
    from modegraph import api

Floats = NDArray[np.float64]

DEFAULT_HORIZON = 10.0
"""Seconds, for a set-point mode without a horizon."""


@with_methods
class Flowpipe:
    """An enclosure of all trajectories of one mode under one reference, or a class of them. Made by :func:`flowpipe`.

    Attributes
    ----------
    times : (k,) array
        Increasing instants of the grid, from 0 to the computed time, in seconds: breakpoints, the
        duration of the reference and the horizon are among them. Boxes are tightest there.
        Empty when not even the start is defined.
    complete : bool
        Whether the horizon was reached.
    reason : str
        When not complete: at what time, which state, why, and what would help.
    states : tuple[str, ...]
        Names of the coordinates of the boxes: states, then memory.
    pieces, steps : int
        Parts the start set was cut into, at the start or on the way, and validated steps of all of them.
    """

    if TYPE_CHECKING:  # from upper layers
        plot = api.plot_flowpipe

    def __init__(
        self,
        label: str,
        states: Sequence[str],
        horizon: float,
        chains: Sequence[Chain],
        stuck: Failure | None,
        one_of: Restrictor | None = None,
    ) -> None:
        self.states = tuple(states)
        self._one_of = one_of
        self.horizon = horizon
        self.complete = not any(chain.failure for chain in chains)
        self._label = label
        flows = dict.fromkeys(flow for chain in chains for flow in chain.flows)
        self._slicers = [Slicer(flow) for flow in flows]
        self._boxes: dict[tuple[float, float, bytes], Box] = {}
        begun = all(chain.begun for chain in chains)
        until = min(chain.time for chain in chains)
        instants = np.unique(np.concatenate([slicer.times for slicer in self._slicers]))
        self.times: Floats = instants[instants <= until] if begun else np.zeros(0)
        self.pieces = len(chains)
        self.steps = sum(len(flow.steps) for flow in flows)
        starts = len({chain.flows[0] for chain in chains})
        pieces = f"{starts} piece{'s' * (starts > 1)} of the start set"
        if self.pieces > starts:
            pieces += f", cut into {self.pieces} on the way"
        if self.complete:
            self.reason = f"complete until t = {horizon:.6g} s ({pieces}, {self.steps} steps)"
        else:
            found = [(chain.time, chain.failure) for chain in chains if chain.failure is not None]
            first = min(found, key=lambda item: item[0])[1]
            end = "" if stuck is None else f"; {stuck}"
            self.reason = f"{label}: {first.in_full} (asked for t = {horizon:.6g} s; {pieces}{end})"

    def at(self, t: float, r: ArrayLike | None = None) -> Box:
        """Box over states, then memory, around every state that is possible at time t (seconds).

        Parameters
        ----------
        r : (k,) array, optional
            One reference of a continuous class; without it, all of them count.

        Raises
        ------
        ModegraphError
            Before 0 or past the computed time, or if r is not of the class.
        """
        return self.hull(t, t, r)

    def hull(self, t0: float, t1: float, r: ArrayLike | None = None) -> Box:
        """Box over states, then memory, around everything passed in the closed interval [t0, t1] (seconds).

        Parameters
        ----------
        r : (k,) array, optional
            One reference of a continuous class; without it, all of them count.

        Raises
        ------
        ModegraphError
            If the interval is empty or leaves the computed time, or if r is not of the class.
        """
        a, b = self._instant(t0, "t0"), self._instant(t1, "t1")
        if a > b:
            raise ModegraphError(f"{self._label}: flowpipe.hull: t0 = {a:.6g} is after t1 = {b:.6g}; exchange them")
        if r is not None and self._one_of is None:
            raise ModegraphError(f"{self._label}: this flowpipe is that of one reference; leave r out")
        p = None if r is None or self._one_of is None else self._one_of.parameters(r)
        key = a, b, b"" if p is None else p.tobytes()
        if key not in self._boxes:
            slices = _slices(self._slicers, a, b)
            if p is not None and self._one_of is not None:
                slices = self._one_of.restricted(slices, p)
            self._boxes[key] = Box(*hull(slices))
        return self._boxes[key]

    def _instant(self, t: Any, name: str) -> float:
        try:
            value = float(t)
        except (TypeError, ValueError):
            value = math.nan
        if math.isnan(value):
            raise ModegraphError(f"{self._label}: flowpipe: {name} must be a time in seconds, got {t!r}")
        if not len(self.times):
            raise ModegraphError(f"nothing was computed: {self.reason}")
        until = float(self.times[-1])
        if value < 0.0:
            raise ModegraphError(
                f"{self._label}: flowpipe asked at t = {value:.6g} s; time starts at 0 on entering the mode"
            )
        if value > until:
            why = "give flowpipe a longer horizon=" if self.complete else f"it is incomplete: {self.reason}"
            raise ModegraphError(
                f"{self._label}: flowpipe asked at t = {value:.9g} s, computed until t = {until:.9g} s; {why}"
            )
        return value

    def tubes(self) -> tuple[Floats, list[tuple[slice, Floats, Floats]]]:
        """For drawing: the grid (k,), and of each flow its intervals and quick boxes (lo, hi) in these."""
        middles = 0.5 * (self.times[:-1] + self.times[1:])
        found = []
        for slicer in self._slicers:
            first, last = np.searchsorted(middles, slicer.times[[0, -1]])
            if first < last:
                lo, hi = slicer.steps()
                index = np.searchsorted(slicer.times[1:], middles[first:last])
                found.append((slice(int(first), int(last)), lo[index], hi[index]))
        return self.times, found

    def sections(self, t: float, dims: Sequence[int | str]) -> tuple[float, list[Floats]]:
        """Outlines of the reach set in the plane of two states, at the instant of the grid next to t (seconds).

        Returns
        -------
        (float, list of (k, 2) arrays)
            The instant, and one polygon around each part; together they hold every state that is possible.
        """
        pair = self.state_numbers(dims)
        if pair is None or len(pair) != 2:
            raise ModegraphError(f"{self._label}: flowpipe.sections: dims takes two states")
        instant = float(self.times[np.argmin(np.abs(self.times - self._instant(t, "t")))])
        found = []
        for slicer in self._slicers:
            k = int(np.argmin(np.abs(slicer.times - instant)))
            if slicer.times[k] == instant and (k > 0 or instant == 0.0):
                found.append(outline(slicer, k, (pair[0], pair[1])))
        return instant, found

    def state_numbers(self, dims: int | str | Sequence[int | str] | None) -> tuple[int, ...] | None:
        """Numbers of one or two states given by number or name, for drawing; None stays None."""
        if dims is None:
            return None
        listed = [dims] if isinstance(dims, int | np.integer | str) else list(dims)
        found = []
        for d in listed:
            k = self.states.index(d) if d in self.states else d
            if not isinstance(k, int | np.integer) or not 0 <= k < len(self.states):
                raise ModegraphError(
                    f"{self._label}: flowpipe.plot: dims names no state {d!r}; there is "
                    f"{', '.join(self.states)} (0 to {len(self.states) - 1})"
                )
            found.append(int(k))
        if len(found) not in (1, 2):
            raise ModegraphError(
                f"{self._label}: flowpipe.plot: dims takes one state (over time) or two (phase plane), got {len(found)}"
            )
        return tuple(found)

    def __repr__(self) -> str:
        until = f"{self.times[-1]:.6g}" if len(self.times) else "nothing"
        return f"Flowpipe({self._label}, until={until}, complete={self.complete})"


def _slices(slicers: Sequence[Slicer], a: float, b: float) -> list[ReachSet]:
    """Slices in [a, b]; at an instant where a flow continues another, of the other."""
    if a == b:
        return [s.at(a) for s in slicers if s.times[0] < a <= s.times[-1] or a == s.times[0] == 0.0]
    found: list[ReachSet] = []
    for slicer in slicers:
        begin, end = max(a, float(slicer.times[0])), min(b, float(slicer.times[-1]))
        if begin < end:
            found += slicer.over(begin, end)
    return found


def flowpipe(
    mode: Mode, r: ArrayLike | None = None, horizon: float | None = None, start: Set | None = None
) -> Flowpipe:
    """Enclose all trajectories of a mode, for every start, unknown constant and disturbance.

    Constraints are not looked at. Where the enclosure breaks down, a higher degree is tried, then the
    start set is cut, or under a disturbance what it has become on the way; what cannot be carried to the
    horizon is kept as far as it goes.

    Parameters
    ----------
    r : (m,) array, optional
        Which reference of the mode's class; may be left out when there is only one. For a continuous class,
        leaving it out gives one flowpipe of all of them, whose ``at`` and ``hull`` take r.
    horizon : float, optional
        Seconds. Default: the mode's horizon; else the duration of its reference; else 10 s.
    start : Set, optional
        Instead of the mode's start set; over plant states, or plant states and memory.

    Raises
    ------
    ModegraphError
        If the model or an argument is wrong; names the mode and the remedy.
    """
    if not isinstance(mode, Mode):
        raise ModegraphError(f"flowpipe takes a Mode, got {type(mode).__name__}; for several, call it for each")
    p = mode.find(r, whole=True)
    if start is not None:
        mode = mode.replace(start=start)
    label = f"mode {mode.label_of(p)!r}"
    end = _horizon(mode, horizon, label)
    require_faithful(mode, p)
    compiled = compile_mode(mode, p, observed=False)
    with one_core():
        chains, stuck = Cutting(compiled, end).run()
    one_of = Restrictor(mode, compiled) if compiled.parameters else None
    return Flowpipe(label, compiled.loop.names, end, chains, stuck, one_of)


def _horizon(mode: Mode, horizon: float | None, label: str) -> float:
    if horizon is None:
        return mode.horizon or mode.reference.duration or DEFAULT_HORIZON
    try:
        end = float(horizon)
    except (TypeError, ValueError):
        end = math.nan
    if not 0.0 < end < math.inf:
        raise ModegraphError(f"{label}: flowpipe: horizon must be a positive, finite time in seconds, got {horizon!r}")
    return end
