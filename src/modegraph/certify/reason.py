"""Why a verdict is what it is: every outcome there is, with its numbers and what would change it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import unique
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from modegraph.certify.references import Parameter, parameter_text
from modegraph.reach.failure import Failure, engine_stopped
from modegraph.reach.statement import Kind, Statement, remedies, texts

CLOSE = 5e-3
"""Relative to the target: a set that misses it by less is said to miss it by so much."""
FAR = 1e3
"""Sizes of the target beyond which figures mean nothing."""
ROUNDING = 1e-9
"""A miss, relative to the target, that may be the allowance for rounding alone."""

Why = tuple["Reason", ...]


def point(x: ArrayLike | None) -> tuple[float, ...] | None:
    """A vector as a field of a reason."""
    return None if x is None else tuple(np.atleast_1d(np.asarray(x, float)).tolist())


# -- texts that a template cannot make -----------------------------------------------------------


def _common_time(latest: float, parts: int) -> str:
    pieces = "" if parts == 1 else f", in {parts} pieces with a time each"
    return f"every start is in the target by {latest:.4g} s{pieces}; constraints proved until then"


def _funnel(latest: float, parts: int) -> str:
    pieces = "" if parts == 1 else f", in {parts} pieces"
    return (
        f"every start is in the target by {latest:.4g} s, where it sinks in a funnel{pieces}; constraints proved "
        "until then"
    )


def _for_all_time(start: float, constraints: bool) -> str:
    what = "constraints proved for all t >= 0" if constraints else "no constraints; the flow exists for all t >= 0"
    return f"{what} (invariant set from t = {start:.4g} s on)"


def _from_start(x0: tuple[float, ...], w: tuple[float, ...] | None) -> str:
    return f"the start {_short(x0)}{_under(w)}"


def _violates(x0: tuple[float, ...], w: tuple[float, ...] | None, time: float, before_entry: bool) -> str:
    before = ", before it has entered the target" if before_entry else ""
    return f"{_from_start(x0, w)} violates the constraints at t = {time:.4g} s{before}"


def _trapped(x0: tuple[float, ...], w: tuple[float, ...] | None, time: float) -> str:
    return f"{_from_start(x0, w)} never reaches the target: it is trapped outside from t = {time:.4g} s"


def _equilibrium(x0: tuple[float, ...], w: tuple[float, ...] | None, mode: str) -> str:
    return (
        f"the equilibrium near {_short(x0)}{_under(w)} is a start of '{mode}' and lies outside the target: that "
        "trajectory never reaches it"
    )


def _resting(x0: tuple[float, ...]) -> str:
    return (
        f"the centre {parameter_text(np.array(x0))} of the start set is an equilibrium without disturbance and lies "
        "outside the target: that trajectory never reaches it"
    )


def _horizon(x0: tuple[float, ...], w: tuple[float, ...] | None, horizon: float) -> str:
    return f"{_from_start(x0, w)} stays outside the target up to the horizon of {horizon:g} s (this horizon only)"


def _no_common_time(
    gauge: float,
    time: float,
    horizon: float | None = None,
    part: int | None = None,
    parts: int = 1,
    offset: tuple[float, ...] | None = None,
    r_i: Parameter = None,
    r_j: Parameter = None,
) -> str:
    """The worst of the ``parts`` the starts were cut into is number ``part``, its middle ``offset`` away from the
    centre of the start set; and the references, where they are known."""
    within = "" if horizon is None else f" within {horizon:g} s"
    who = "the worst part of the starts"
    if part is not None:
        around = "" if offset is None else f" (around the centre + {_short(offset)})"
        who = "the set of all starts" if parts == 1 else f"part {part} of {parts} of the starts{around}"
    references = "" if r_i is None and r_j is None else f", r_i = {_named(r_i)}, r_j = {_named(r_j)}"
    return f"no common time was found{within}: at best (t = {time:.4g} s{references}) {who} {_reach(gauge)}"


def _reach(gauge: float) -> str:
    """How far a set reaches that is ``gauge`` times the size of the target."""
    excess = gauge - 1.0
    if gauge > FAR:
        return f"reaches more than {FAR:g} times the size of the target (1 is needed)"
    if excess >= CLOSE:
        return f"reaches {gauge:.3g} times the size of the target (1 is needed)"
    if excess > ROUNDING:
        return f"misses the target by {excess:.2g} of its size"
    if excess > 0.0:
        return f"touches the target, and misses it by {excess:.2g} of its size, no more than is allowed for rounding"
    return "is within the size of the target, though not proved to be inside at one time"


def size_text(gauge: float) -> str:
    """How large something is against the target: never "1 times" where it is not, nor "1e+294 times"."""
    excess = gauge - 1.0
    if gauge > FAR:
        return f"more than {FAR:g} times the size of the target"
    if 0.0 < abs(excess) < CLOSE:
        return f"the size of the target, and {abs(excess):.2g} of it {'more' if excess > 0.0 else 'less'}"
    return f"{gauge:.4g} times the size of the target"


def _larger_target(gauge: float, **_: Any) -> str:
    if gauge > FAR:
        return "a much smaller start set, or a controller that steers to the target, would help"
    if gauge <= 1.0 + ROUNDING:
        return "a target larger by a hair would help"
    slightly = "slightly " if gauge < 1.5 else ""
    return f"a smaller start set or a {slightly}larger target would help"


def _not_proved(constraint: str, time: float, by: float) -> str:
    """``by``: up to how much it is exceeded, in its own unit; inf or NaN where it is not defined on the whole set."""
    when = f"at t = {time:.4g}" if time == 0.0 else f"after t = {time:.4g} s"
    what = "not defined on the whole set"
    if math.isfinite(by):
        what = f"exceeded by up to {by:.3g}" if by > 0.0 else "met exactly"
    return f"constraint '{constraint}' cannot be proved {when} ({what})"


def _ended(failure: Failure) -> str:
    return f"the flowpipe ends {failure}"


def _too_large(why: Statement) -> str:
    return f"a part of the starts is too large to go on alone: {why}"


def _start_not_proved(whole_class: bool = False) -> str:
    return "the constraints are not proved at t = 0" + (" for all references of the class" if whole_class else "")


def _not_for_ever(until: float, why: Failure, funnel: Failure | None = None, whole_class: bool = False) -> str:
    """``why`` there is no invariant set, and, where one was looked for, no ``funnel``."""
    who = " for all references of the class" if whole_class else ""
    either = "" if funnel is None else f"; no funnel either: {funnel}"
    return f"constraints proved until t = {until:.4g} s{who}, but not for all time: {why}{either}"


def _some_pairs(certified: int, count: int, r_i: Parameter, r_j: Parameter, why: Why) -> str:
    return f"certified for {certified} of {count} pairs of references, {_pair(r_i, r_j, why)}"


def _all_pairs(count: int, r_i: Parameter, r_j: Parameter, why: Why) -> str:
    return f"refuted for all {count} pairs of references; closest {_pair(r_i, r_j, why)}"


def _open_pairs(undecided: int, count: int, r_i: Parameter, r_j: Parameter, why: Why) -> str:
    share, others = ("all", "") if undecided == count else (f"{undecided} of", ", refuted for the others")
    return f"undecided for {share} {count} pairs of references{others}; closest {_pair(r_i, r_j, why)}"


def _refuted_references(failing: int, count: int, r: Parameter, why: Why) -> str:
    return f"refuted for {failing} of {count} references, e.g. {_named(r)}: {texts(why)}"


def _open_references(undecided: int, count: int, r: Parameter, why: Why) -> str:
    return f"undecided for {undecided} of {count} references, e.g. {_named(r)}: {texts(why)}"


def _some_region(r_i: Parameter, r_j: Parameter) -> str:
    return f"certified for a continuous set of references, among them r_i = {_named(r_i)}, r_j = {_named(r_j)}"


def _whole_region(r_i: Parameter, r_j: Parameter, why: Why) -> str:
    return f"refuted for all references; closest r_i = {_named(r_i)}, r_j = {_named(r_j)}: {texts(why)}"


def _pair(r_i: Parameter, r_j: Parameter, why: Why) -> str:
    return f"from reference {parameter_text(_array(r_i))} to {parameter_text(_array(r_j))}: {texts(why)}"


def _inner(why: Why, **_: Any) -> str:
    """What would help the pair or reference that is told of."""
    return remedies(why)


def _cause(why: Statement, **_: Any) -> str:
    return why.remedy


def _failure(failure: Failure, **_: Any) -> str:
    return failure.remedy


def _named(p: Parameter) -> str:
    return "the only one" if p is None or not len(p) else parameter_text(_array(p))


def _array(p: Parameter) -> Parameter:
    return None if p is None else np.asarray(p, float)


def _short(x: Sequence[float]) -> str:
    return "(" + ", ".join(f"{v:.4g}" for v in x) + ")"


def _under(w: Sequence[float] | None) -> str:
    return "" if w is None else f" under the constant disturbance {_short(w)}"


_PROVED = "nothing is missing"
_LEAVE = "take this start out of the start set, or change the controller so that it"
_BUDGET = "try a larger budget="


@unique
class Outcome(Kind):
    """Every answer there is: the text, and what would change it.

    Fields: ``time``, ``latest``, ``until``, ``horizon`` in seconds after entering the source; ``x0``, ``w``,
    ``r``, ``r_i``, ``r_j`` tuples of numbers or None; ``why`` the reasons of the pair or reference that is told of.
    """

    # Certified.
    ZERO_TIME = "every start is already in the target: a switch in zero time", _PROVED
    COMMON_TIME = _common_time, _PROVED
    FUNNEL = _funnel, _PROVED
    SOME_PAIRS_CERTIFIED = _some_pairs, _PROVED
    SOME_REGION_CERTIFIED = _some_region, _PROVED
    FOR_ALL_TIME = _for_all_time, _PROVED
    ALL_REFERENCES_CERTIFIED = "certified for all {count} references", _PROVED
    ONLY_ENTERED = (
        "target '{target}' is only entered: the constraints are proved up to the entry, nothing after it",
        _PROVED,
    )
    # Refuted.
    VIOLATES = _violates, f"{_LEAVE} keeps the constraints from there"
    TRAPPED_AT_EQUILIBRIUM = _equilibrium, f"{_LEAVE} does not rest there, or let the target contain it"
    TRAPPED = _trapped, f"{_LEAVE} leads to the target"
    HORIZON = _horizon, "try a longer horizon="
    RESTS_OUTSIDE = _resting, "let the target contain that centre"
    ALL_PAIRS_REFUTED = _all_pairs, _inner
    SOME_REFERENCES_REFUTED = _refuted_references, _inner
    WHOLE_REGION_REFUTED = _whole_region, _inner
    # Undecided.
    NO_COMMON_TIME = _no_common_time, _larger_target
    CONSTRAINT_NOT_PROVED = _not_proved, "a smaller start set or a looser constraint would help"
    START_NOT_PROVED = _start_not_proved, "a smaller start set or looser constraints would help"
    FLOWPIPE_ENDED = _ended, _failure
    TOO_LARGE = _too_large, "a smaller start set or disturbance would help"
    NO_USABLE_INSTANT = (
        "the flowpipe of the source does not get far enough for any instant to count",
        "a smaller start set or class of references would help",
    )
    NOT_FOR_EVER = _not_for_ever, _cause
    BUDGET_ENDED = "the budget ended", _BUDGET
    NOT_BEGUN = "the budget of {budget:g} s ended before this mode was examined", _BUDGET
    INTERRUPTED = "interrupted before this mode was examined", "let the build run to its end"
    ENGINE_STOPPED = (
        "the proof engine stopped with {error}: {text}",
        "please report it: this is a fault of modegraph, not of the model",
    )
    ENGINE_LIMIT = "{text}", "{text}"
    UNUSABLE_TARGET = "the target cannot be used: {text}", "choose a target set of another kind"
    NO_REFERENCE_LEFT = "no reference is left", "name other references"
    NOTHING_FOUND = (
        "neither a proof nor a counterexample was found",
        "a smaller start set, a larger target or a larger budget= would help",
    )
    SOME_PAIRS_UNDECIDED = _open_pairs, _inner
    SOME_REFERENCES_UNDECIDED = _open_references, _inner


class Reason(Statement):
    """One reason of a verdict: its `outcome`, the fields of that, and what would help.

    ``str()`` is the text, ``remedy`` what would change the outcome, ``data()`` both names and numbers for programs.
    """

    __slots__ = ()
    label = "outcome"

    def __init__(self, outcome: Outcome, /, **fields: Any) -> None:
        super().__init__(outcome, **fields)

    @property
    def outcome(self) -> Kind:
        """The `Outcome`."""
        return self.kind


def engine_reason(error: Exception) -> Reason:
    """What an error of the engine is: a limit that it names, or a fault of its own."""
    mechanism, fields = engine_stopped(error)
    return Reason(Outcome[mechanism.name], **fields)
