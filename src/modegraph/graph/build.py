"""``build``: every ordered pair of modes and every check, one unit of work per mode and reference."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from numbers import Real
from threading import Lock
from typing import Any

import numpy as np

from modegraph.certify.class_unit import relate
from modegraph.certify.relation import Relation
from modegraph.certify.unit import TargetSpec, UnitResult, certify_unit
from modegraph.certify.verdict import Status, Verdict
from modegraph.cores import COUNT, one_core, single_threaded_algebra
from modegraph.errors import ModegraphError, NotBuiltYet
from modegraph.graph.classes import Classes, Link
from modegraph.graph.modegraph import ModeGraph, Node
from modegraph.graph.progress import Progress, reporting
from modegraph.model.closed_loop import mode_start
from modegraph.model.faithful import require_faithful
from modegraph.model.mode import Mode
from modegraph.model.slips import warn_of_slips
from modegraph.model.target import Target
from modegraph.model.validation import validate_modes

DEFAULT_BUDGET = 600.0
"""Seconds of work when ``budget`` is not given."""


SMALL = 1e-9
"""Widths that are compared are at least so large."""


class _Stopped(Exception):
    """Raised inside a unit when the build was interrupted."""


def build(
    modes: Sequence[Mode | Target],
    *,
    horizon: float | None = None,
    period: float | None = None,
    noise: Any = None,
    store: Any = None,
    executor: Any = None,
    progress: Any = None,
    budget: float | None = None,
) -> ModeGraph:
    """Prove which modes can be chained.

    Parameters
    ----------
    modes : sequence of Mode or Target
        Same states, different names.
    horizon : float, optional
        Seconds a switch may take; ``Mode.horizon`` overrides it. None: until a tail is certified
        or the budget ends.
    period, noise, store, executor
        Not built yet: anything but None is an error.
    progress : None, True or callable(done, total, text)
        True shows a bar in a terminal.
    budget : float, optional
        Seconds of work; what is not decided then is UNDECIDED. By default 600. With a budget given, more of
        it certifies more references of continuous classes.

    Returns
    -------
    ModeGraph
        Also when pairs are refuted or undecided. An interrupt (Ctrl-C) ends the work and gives
        the graph of what was decided until then.

    Raises
    ------
    ModegraphError
        If the model is wrong. The message names mode, function and remedy.
    """
    for name, value in (("period", period), ("noise", noise), ("store", store), ("executor", executor)):
        if value is not None:
            raise NotBuiltYet(f"build: {name}= is not built yet; leave it out")
    _positive("horizon", horizon)
    _positive("budget", budget)
    modes = validate_modes(modes)
    _examine(modes)
    units = _units(modes, horizon)
    with reporting(progress) as report:
        results = _Work(
            units, report, DEFAULT_BUDGET if budget is None else float(budget), thorough=budget is not None
        ).run()
    verdicts: dict[tuple[Node, Node], Verdict] = {}
    checks: dict[Node, Verdict] = {}
    links: dict[tuple[Node, Node], Link] = {}
    for unit, result in zip(units, results, strict=True):
        checks[unit.node] = result.finite.check
        links |= result.links
        for node, verdict in zip(unit.target_nodes, result.finite.verdicts, strict=True):
            verdicts[unit.node, node] = verdict
    regions = {m.name: m.reference.region for m in modes if isinstance(m, Mode) and m.reference.region is not None}
    return ModeGraph(modes, verdicts, checks, Classes(regions, links), horizon)


@dataclass(frozen=True, eq=False)
class _Unit:
    """One mode under one reference, with everything its flowpipe is tested against."""

    mode: Mode
    node: Node
    parameter: Any
    horizon: float | None
    target_nodes: tuple[Node, ...]
    targets: tuple[TargetSpec, ...]
    linked_nodes: tuple[Node, ...] = ()
    """Nodes to which there is a relation: one of both is a continuous class."""
    linked: tuple[TargetSpec, ...] = ()

    def undecided(self, reason: str) -> _Result:
        nothing = Verdict(Status.UNDECIDED, reason, horizon=self.horizon)
        return _Result(UnitResult([nothing] * len(self.targets), nothing), self.links(reason))

    def links(self, relations: Sequence[Relation | str] | str, slack: Any = None) -> dict[tuple[Node, Node], Link]:
        """Links to ``linked_nodes``; one text for all where nothing is known."""
        many = [relations] * len(self.linked_nodes) if isinstance(relations, str) else relations
        return {
            (self.node, node): Link(relation, slack or {}, self.horizon)
            for node, relation in zip(self.linked_nodes, many, strict=True)
        }


@dataclass(frozen=True)
class _Result:
    finite: UnitResult
    links: dict[tuple[Node, Node], Link]


def _positive(name: str, value: float | None) -> None:
    if value is None:
        return
    if isinstance(value, bool) or not isinstance(value, Real) or not 0 < value < math.inf:
        raise ModegraphError(f"build: {name} must be a positive number of seconds or None, not {value!r}")


def _examine(modes: Sequence[Mode | Target]) -> None:
    """Trace every closed loop, so that a wrong model fails before any proof, and warn of what looks like a slip."""
    real = [mode for mode in modes if isinstance(mode, Mode)]
    loops = [
        [require_faithful(mode, p) for p in ([None] if _is_class(mode) else mode.reference.parameters())]
        for mode in real
    ]
    warn_of_slips(real, loops)


def _units(modes: Sequence[Mode | Target], horizon: float | None) -> list[_Unit]:
    """All units of work."""
    nodes: list[tuple[Node, Any, Mode | Target]] = []
    for mode in modes:
        if isinstance(mode, Target):
            nodes.append(((mode.name, 0), None, mode))
            continue
        if mode.reference.region is not None:
            nodes.append(((mode.name, 0), None, mode))
            continue
        nodes += [((mode.name, a), p, mode) for a, p in enumerate(mode.reference.parameters())]
    specs = {node: TargetSpec(name=mode.name, p=p, mode=mode) for node, p, mode in nodes}
    units = []
    for node, p, mode in nodes:
        if isinstance(mode, Target):
            continue
        own = horizon if mode.horizon is None else mode.horizon
        whole = _is_class(mode)
        linked = tuple(other for other, spec in specs.items() if whole or _is_class(spec.mode))
        others = tuple(other for other in specs if other != node and other not in linked)
        units.append(
            _Unit(mode, node, p, own, others, tuple(specs[n] for n in others), linked, tuple(specs[n] for n in linked))
        )
    return units


def _size(unit: _Unit) -> tuple[bool, float]:
    """Classes, then wide starts, take longest, and small ones where the reference moves: begun first, they keep all
    cores busy to the end."""
    if _is_class(unit.mode):
        return True, 0.0
    lo, hi = mode_start(unit.mode, unit.parameter).bounding_box()
    size = float(np.log(np.asarray(hi) - np.asarray(lo) + SMALL).sum())
    return False, 0.5 * size if unit.mode.reference.duration > 0.0 else size


def _is_class(mode: Mode | Target) -> bool:
    return isinstance(mode, Mode) and mode.reference.region is not None


def node_verdict(
    modes: Sequence[Mode | Target], source: Node, target: Node, *, horizon: float | None, deadline: float
) -> Verdict:
    """The verdict on one pair of nodes of finite classes, from the very unit of work that ``build`` would do.

    Parameters
    ----------
    deadline : instant of ``time.monotonic()`` after which what is not decided is UNDECIDED.
    """
    unit = next(u for u in _units(validate_modes(modes), horizon) if u.node == source)
    with one_core():
        found = certify_unit(
            unit.mode, unit.parameter, list(unit.targets), horizon=unit.horizon, deadline=deadline, progress=None
        )
    return found.verdicts[unit.target_nodes.index(target)]


def _examined(unit: _Unit, deadline: float, progress: Callable[[str], None], thorough: bool) -> _Result:
    """Verdicts on the finite targets of a unit, and relations to the continuous ones."""
    finite: UnitResult | None = None
    if not _is_class(unit.mode):
        finite = certify_unit(
            unit.mode, unit.parameter, list(unit.targets), horizon=unit.horizon, deadline=deadline, progress=progress
        )
    if not unit.linked:
        assert finite is not None
        return _Result(finite, {})
    found = relate(
        unit.mode,
        unit.parameter,
        unit.linked,
        horizon=unit.horizon,
        deadline=deadline,
        progress=progress,
        thorough=thorough,
    )
    return _Result(finite or UnitResult([], found.check), unit.links(found.relations, found.slack))


@dataclass(eq=False)
class _Work:
    """Units in a thread pool (the kernels release the interpreter lock), within a budget."""

    units: Sequence[_Unit]
    report: Progress
    budget: float
    thorough: bool = False
    """Continuous classes are refined as long as there is time and it helps."""
    stopped: bool = False
    done: int = 0
    lock: Any = field(default_factory=Lock)

    def run(self) -> list[_Result]:
        threads = max(1, min(COUNT, len(self.units)))
        self.end = time.monotonic() + self.budget
        self.waiting = len(self.units)
        self.threads = threads
        self.report(0, len(self.units), "")
        pools = ThreadPoolExecutor(max_workers=threads, thread_name_prefix="modegraph")
        with single_threaded_algebra(), pools as pool:
            futures = {pool.submit(self._unit, unit): unit for unit in sorted(self.units, key=_size, reverse=True)}
            try:
                self._watch(futures)
            except KeyboardInterrupt:
                self._stop(futures)
            except BaseException:
                self._stop(futures)
                raise
        results = {unit: self._result(future, unit) for future, unit in futures.items()}
        return [results[unit] for unit in self.units]

    def _watch(self, futures: dict[Future[_Result], _Unit]) -> None:
        """Wait for all units; the error of a wrong model ends it at once."""
        open_ = set(futures)
        while open_:
            finished, open_ = wait(open_, return_when=FIRST_COMPLETED)
            for future in finished:
                future.result()
                self.done += 1
                self.report(self.done, len(futures), futures[future].mode.name)

    def _stop(self, futures: dict[Future[_Result], _Unit]) -> None:
        self.stopped = True
        for future in futures:
            future.cancel()

    def _unit(self, unit: _Unit) -> _Result:
        with self.lock:
            # An equal share of the time that is left: a hard unit cannot starve the others.
            rounds = math.ceil(self.waiting / self.threads)
            self.waiting -= 1

        def progress(text: str = "") -> None:
            if self.stopped:
                raise _Stopped
            if text:
                self.report(self.done, len(self.units), f"{unit.mode.name}: {text}")

        try:
            with one_core():
                now = time.monotonic()
                if now >= self.end:
                    return unit.undecided(f"the budget of {self.budget:g} s ended before this mode was examined")
                deadline = now + (self.end - now) / rounds
                return _examined(unit, deadline, progress, self.thorough)
        except (ModegraphError, _Stopped):
            raise
        except Exception as error:
            return unit.undecided(f"the proof engine stopped with {type(error).__name__}: {error}")

    @staticmethod
    def _result(future: Future[_Result], unit: _Unit) -> _Result:
        if not future.cancelled():
            error = future.exception()
            if error is None:
                return future.result()
            if not isinstance(error, _Stopped):
                raise error
        return unit.undecided("interrupted before this mode was examined")
