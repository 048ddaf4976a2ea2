"""``build``: every ordered pair of modes and every check, one unit of work per mode and reference."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field, replace
from numbers import Real
from threading import Lock
from typing import Any

import numpy as np

from modegraph.certify.class_unit import relate
from modegraph.certify.question import TargetSpec
from modegraph.certify.reason import Outcome, Reason, engine_reason
from modegraph.certify.relation import Relation
from modegraph.certify.unit import UnitResult, certify_unit
from modegraph.certify.verdict import Status, Verdict
from modegraph.cores import COUNT, one_core, single_threaded_algebra
from modegraph.deadline import Deadline
from modegraph.errors import ModegraphError, NotBuiltYet
from modegraph.graph.classes import Classes, Link
from modegraph.graph.modegraph import ModeGraph, Node
from modegraph.graph.progress import Progress, reporting
from modegraph.guarded import note
from modegraph.model.closed_loop import mode_start
from modegraph.model.faithful import require_faithful
from modegraph.model.mode import Mode
from modegraph.model.slips import warn_of_slips
from modegraph.model.target import Target
from modegraph.model.validation import validate_modes

DEFAULT_BUDGET = 600.0
"""Seconds of work when ``budget`` is not given."""
SECONDS_A_CUT = 1.0
"""Of a given budget, for each cut that may certify more references: a measure of work, whatever a cut takes here.
Measured on the quadrotor and the classes of the arm: .3 to 2 s."""

SMALL = 1e-9
"""Widths that are compared are at least so large."""


class _Stopped(BaseException):
    """Raised inside a unit when the build was interrupted: no error, so that nothing in the engine catches it."""


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
        cuts = 0 if budget is None else int(float(budget) / len(units) / SECONDS_A_CUT)
        results = _Work(units, report, DEFAULT_BUDGET if budget is None else float(budget), cuts).run()
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

    def undecided(self, reason: Reason) -> _Result:
        nothing = Verdict(Status.UNDECIDED, (reason,), horizon=self.horizon)
        return _Result(UnitResult([nothing] * len(self.targets), nothing), self.links(reason))

    def links(self, relations: Sequence[Relation | Reason] | Reason) -> dict[tuple[Node, Node], Link]:
        """Links to ``linked_nodes``; one reason for all where nothing is known."""
        many = [relations] * len(self.linked_nodes) if isinstance(relations, Reason) else relations
        return {
            (self.node, node): Link(relation, self.horizon)
            for node, relation in zip(self.linked_nodes, many, strict=True)
        }


@dataclass(frozen=True)
class _Result:
    """What a unit showed; ``cut_short``: the end of its time had a part in it."""

    finite: UnitResult
    links: dict[tuple[Node, Node], Link]
    cut_short: bool = False

    def with_(self, later: _Result) -> _Result:
        """What the unit showed when it was done once more, and what it had decided before."""
        pairs = zip(self.finite.verdicts, later.finite.verdicts, strict=True)
        verdicts = [_decided(*pair) for pair in pairs]
        return replace(later, finite=UnitResult(verdicts, _decided(self.finite.check, later.finite.check)))


def _decided(earlier: Verdict, later: Verdict) -> Verdict:
    return earlier if later.status is Status.UNDECIDED and earlier.status is not Status.UNDECIDED else later


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
    modes: Sequence[Mode | Target], source: Node, target: Node, *, horizon: float | None, deadline: Deadline
) -> Verdict:
    """The verdict on one pair of nodes of finite classes, from the very unit of work that ``build`` would do.

    Parameters
    ----------
    deadline : after which what is not decided is UNDECIDED.
    """
    unit = next(u for u in _units(validate_modes(modes), horizon) if u.node == source)
    with one_core():
        found = certify_unit(
            unit.mode, unit.parameter, list(unit.targets), horizon=unit.horizon, deadline=deadline, progress=None
        )
    return found.verdicts[unit.target_nodes.index(target)]


def _examined(unit: _Unit, deadline: Deadline, progress: Callable[[str], None], cuts: int) -> _Result:
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
        cuts=cuts,
    )
    return _Result(finite or UnitResult([], found.check), unit.links(found.relations))


@dataclass(eq=False)
class _Work:
    """Units in a thread pool (the kernels release the interpreter lock), within a budget.

    Each unit gets an equal share of the time that is left: a hard one cannot starve the others. What was cut short
    by its share is done once more when all had theirs, so that no answer depends on the share, the number of cores
    or the load, as long as the budget itself has not ended.
    """

    units: Sequence[_Unit]
    report: Progress
    budget: float
    cuts: int = 0
    """How often the starts of a continuous class are cut for more certified references, at most."""
    stopped: bool = False
    done: int = 0
    lock: Any = field(default_factory=Lock)

    def run(self) -> list[_Result]:
        self.end = Deadline(self.budget)
        self.threads = max(1, min(COUNT, len(self.units)))
        self.report(0, len(self.units), "")
        results: dict[_Unit, _Result] = {}
        pools = ThreadPoolExecutor(max_workers=self.threads, thread_name_prefix="modegraph")
        with single_threaded_algebra(), pools as pool:
            left = sorted(self.units, key=_size, reverse=True)
            while left:
                self.waiting = len(left)
                futures = {pool.submit(self._unit, unit): unit for unit in left}
                try:
                    self._watch(futures)
                except KeyboardInterrupt:
                    self._stop(futures)
                except BaseException:
                    self._stop(futures)
                    raise
                found = {unit: self._result(future, unit) for future, unit in futures.items()}
                results |= {u: r if u not in results else results[u].with_(r) for u, r in found.items()}
                again = [unit for unit in left if found[unit].cut_short]
                left = [] if self.stopped or self.end.left <= 0.0 else again
                self.done -= len(left)
        return [results[unit] for unit in self.units]

    def _watch(self, futures: dict[Future[_Result], _Unit]) -> None:
        """Wait for all units; the error of a wrong model ends it at once."""
        open_ = set(futures)
        while open_:
            finished, open_ = wait(open_, return_when=FIRST_COMPLETED)
            for future in finished:
                future.result()
                self.done += 1
                self.report(self.done, len(self.units), futures[future].mode.name)

    def _stop(self, futures: dict[Future[_Result], _Unit]) -> None:
        self.stopped = True
        for future in futures:
            future.cancel()

    def _unit(self, unit: _Unit) -> _Result:
        with self.lock:
            rounds = math.ceil(self.waiting / self.threads)
            self.waiting -= 1

        def progress(text: str = "") -> None:
            if self.stopped:
                raise _Stopped
            if text:
                self.report(self.done, len(self.units), f"{unit.mode.name}: {text}")

        try:
            with one_core():
                if self.end.is_over:
                    return unit.undecided(Reason(Outcome.NOT_BEGUN, budget=self.budget))
                deadline = Deadline(self.end.left / rounds, self.end)
                result = _examined(unit, deadline, progress, self.cuts)
                return replace(result, cut_short=deadline.met)
        except ModegraphError:
            raise
        except Exception as error:
            note(f"mode {unit.mode.name!r}", error)
            return unit.undecided(engine_reason(error))

    @staticmethod
    def _result(future: Future[_Result], unit: _Unit) -> _Result:
        if not future.cancelled():
            error = future.exception()
            if error is None:
                return future.result()
            if not isinstance(error, _Stopped):
                raise error
        return unit.undecided(Reason(Outcome.INTERRUPTED))
