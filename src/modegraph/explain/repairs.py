"""Changes of a pair that were proved to give its switch: what is told is what was proved."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

from modegraph.certify.reason import Outcome, Reason
from modegraph.certify.verdict import Approach, Status, Verdict
from modegraph.errors import ModegraphError
from modegraph.explain.pair import Pair
from modegraph.model.mode import Mode
from modegraph.model.target import Target

Kind = Literal["fix references", "horizon", "grow target", "shrink start"]
Change = Callable[[float], Pair]

SMALLEST, LARGEST = 1e-3, 1e3
"""Least scale of the starts, and largest growth of the target, that are tried."""
PRECISION = 1.005
"""A search ends when a value this near to a proved one was missed."""
BACK_OFF = 1.02
"""Towards the safe side, where ``build`` does not find what the search has proved."""
DIGITS = 4
"""Of the values tried: what is printed is exactly what was proved."""
MOST_TRIES, MOST_GUESSES = 20, 3
LONGER = (4.0, 16.0)
"""Multiples of the horizon that are tried."""
LATE = 0.75
"""A longer horizon may help where the approach is closest after this part of it."""
SOON = 0.25
"""Tries look no further than twice the time of the closest approach, or this part of the horizon."""


@dataclass(frozen=True, eq=False)
class Repair:
    """A change that gives the switch, proved by the unit of work that ``build`` does on the changed modes.

    Attributes
    ----------
    kind : {"shrink start", "grow target", "horizon", "fix references"}
    value : float
        The scale of the starts or of the target about their centre, the horizon in seconds, or 1. It has few
        digits: the printed number is the one that was proved.
    missed : float or None
        The nearest value that was tried and not proved; None where none was.
    text : str
    verdict : Verdict
        Of the pair, certified.
    modes : tuple of Mode and Target
        The modes of the graph with the change made: pass them to ``build``. A mode that is entered is also a
        mode that runs: the switches out of it are proved anew from its new starts.
    source, target : Mode, Mode or Target
        The two of them that the switch is between.
    """

    kind: Kind
    value: float
    missed: float | None
    text: str
    verdict: Verdict
    modes: tuple[Mode | Target, ...]
    source: Mode
    target: Mode | Target

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class _Bracket:
    """A proved value and the nearest missed one, with their margins; ``tried``: the missed one was examined."""

    good: float
    bad: float
    margin: float | None = None
    missing: float | None = None
    tried: bool = False

    @property
    def ratio(self) -> float:
        return max(self.good / self.bad, self.bad / self.good)

    def zero(self) -> float | None:
        """A little before a margin that is linear in the value becomes zero."""
        if self.margin is None or self.missing is None or not self.missing < 0.0 < self.margin < math.inf:
            return None
        return self.good + 0.999 * (self.bad - self.good) * self.margin / (self.margin - self.missing)

    def after(self, value: float, verdict: Verdict) -> _Bracket:
        if verdict.status is Status.CERTIFIED:
            return _Bracket(value, self.bad, verdict.margin, self.missing, self.tried)
        return _Bracket(self.good, value, self.margin, verdict.margin, True)


@dataclass
class RepairSearch:
    """Looks for repairs of an absent switch until an instant of ``time.monotonic()``.

    Attributes
    ----------
    pair : Pair
    end : float
    reach : Approach or None
        How near all that the worst part of the starts can reach comes to the target, as it is.
    gauge : float or None
        How near some start comes at best, where more is not known.
    found : list of Repair
    notes : list of str
        What was not found, and why.
    """

    pair: Pair
    end: float
    reach: Approach | None = None
    gauge: float | None = None
    found: list[Repair] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    _cut: bool = False
    """The last try was ended by its deadline."""
    _reserve: float = 0.0
    """Seconds that the unit of ``build`` took."""

    # -- kinds -----------------------------------------------------------------------------------

    def as_it_is(self, classes: bool) -> Verdict:
        """Prove the pair by itself, unchanged; of continuous classes that is a repair."""
        verdict = self._proved(self.pair, 0.3)
        if verdict.status is Status.CERTIFIED and classes:
            text = "list these references with mg.Points: for them alone the switch is certified"
            self._tell("fix references", lambda v: self.pair, 1.0, None, 1.0, lambda v: text)
        elif verdict.status is Status.CERTIFIED:
            self.notes.append("examined by itself the switch is certified: a larger budget= of build may give it")
        return verdict

    def longer(self) -> None:
        """The shortest horizon."""
        now = self.pair.source.horizon
        if now is None:
            return
        for multiple in LONGER:
            verdict = self._proved(self.pair.lasting(multiple * now), 0.3)
            if verdict.time is not None:
                break
        else:
            self._missing("horizon", f"no switch was proved within {LONGER[-1] * now:g} s either")
            return
        good = rounded(verdict.time[1] * (1.0 + 1e-9), up=True)
        if self._proved(self.pair.lasting(good), 0.3).status is not Status.CERTIFIED:
            good = rounded(multiple * now, up=True)
        found = self._narrowed(self.pair.lasting, _Bracket(good, now, tried=True))
        self._tell("horizon", self.pair.lasting, *found, BACK_OFF, lambda v: f"a horizon of {v:g} s")

    def larger(self) -> None:
        """The smallest growth of the target."""
        change = self.pair.grown
        bad, tried = 1.0, True
        gauge = self.gauge if self.reach is None else self.reach.gauge
        factor = rounded(2.0 if gauge is None else max(1.0005, 1.0002 * gauge), up=True)
        inside = self._nested(self.pair.grown, LARGEST, 1.0)
        limit = LARGEST if inside is None else inside
        while factor < limit and not self._is_over:
            verdict = self._proved(change(factor), 0.4)
            if verdict.status is Status.CERTIFIED:
                break
            bad, tried = factor, True
            gauge = 2.0 if verdict.closest is None or self._cut else verdict.closest.gauge
            factor = rounded(factor * max(1.02, 1.0002 * gauge), up=True)
        else:
            if inside is None:
                self._missing("grow target", f"nothing was proved up to {bad:g} times its size")
                return
            factor = inside
        found = self._narrowed(change, _Bracket(factor, bad, tried=tried))
        name = self.pair.target.name
        what = "the set" if isinstance(self.pair.target, Target) else "the starts"
        self._tell(
            "grow target", self.pair.grown, *found, BACK_OFF, lambda v: f"{what} of {name!r} {v:g} times as large"
        )

    def smaller(self) -> None:
        """The largest scale of the starts."""
        change = self.pair.shrunk
        name = self.pair.source.name
        inside = self._nested(self.pair.shrunk, SMALLEST, 1.0)
        least = SMALLEST if inside is None else inside
        verdict = self._proved(change(least), 0.4)
        if verdict.status is not Status.CERTIFIED:
            starts = f"{least:g} times the starts of {name!r}"
            why = f"not even {starts} would do: {verdict.why[0]}"
            self._missing("shrink start", f"{starts} were not decided in time" if self._cut else why)
            return
        # A switch in zero time says nothing of how near larger starts come.
        margin = verdict.margin if inside is None else None
        bracket = _Bracket(least, 1.0, margin, None if self.reach is None else 1.0 - self.reach.gauge, True)
        found = self._narrowed(change, bracket)
        self._tell(
            "shrink start", self.pair.shrunk, *found, 1.0 / BACK_OFF, lambda v: f"{v:g} times the starts of {name!r}"
        )

    # -- search ----------------------------------------------------------------------------------

    @property
    def _is_over(self) -> bool:
        return time.monotonic() >= self.end

    def _missing(self, kind: Kind, why: str) -> None:
        self.notes.append(f"{kind}: {why}" + (" (the time allowed is over)" if self._is_over else ""))

    @property
    def _until(self) -> float:
        """Seconds after which tries look for nothing."""
        horizon = self.pair.source.horizon
        return math.inf if horizon is None or self.reach is None else max(2.0 * self.reach.time, SOON * horizon)

    def _proved(self, pair: Pair, share: float) -> Verdict:
        """The verdict on a changed pair, within a share of the time that is left."""
        now = time.monotonic()
        deadline = now + share * max(0.0, self.end - self._reserve - now)
        until = self._until if pair.source.horizon == self.pair.source.horizon else math.inf
        verdict = attempt(lambda: pair.proved(deadline, until))
        self._cut = time.monotonic() > deadline
        return verdict

    def _nested(self, change: Change, good: float, bad: float) -> float | None:
        """The value nearest to ``bad`` for which all starts are in the target already; None where there is none."""
        up = bad < good
        try:
            if not change(good).starts_inside:
                return None
            while max(good / bad, bad / good) > 1.0002 and not self._is_over:
                value = rounded(math.sqrt(good * bad), up)
                if not min(good, bad) < value < max(good, bad):
                    break
                good, bad = (value, bad) if change(value).starts_inside else (good, value)
        except ModegraphError:
            return None
        return good

    def _narrowed(self, change: Change, bracket: _Bracket) -> tuple[float, float | None]:
        """The proved value nearest to the missed one that was found in half of the time left, and the missed one.

        The first values are where the margins say it ends; without margins that is the proved value itself. Where
        the neighbour of such a guess is proved as well, margins say nothing, and the search goes on by bisection.
        """
        up = bracket.bad < bracket.good
        half = time.monotonic() + 0.5 * (self.end - self._reserve - time.monotonic())
        guesses = MOST_GUESSES
        next_door = bracket.zero() is None
        for _ in range(MOST_TRIES):
            if bracket.ratio <= PRECISION or time.monotonic() > half:
                break
            guess = bracket.zero() if guesses else None
            if next_door:
                value = bracket.good / PRECISION if up else bracket.good * PRECISION
                guesses = 0
            else:
                value = guess or math.sqrt(bracket.good * bracket.bad)
                guesses = max(0, guesses - 1)
            value = rounded(value, up)
            if not min(bracket.good, bracket.bad) < value < max(bracket.good, bracket.bad):
                break
            verdict = self._proved(change(value), 0.3)
            next_door = guess is not None and not next_door and verdict.status is Status.CERTIFIED
            bracket = bracket.after(value, verdict)
        return bracket.good, bracket.bad if bracket.tried else None

    def _tell(
        self, kind: Kind, change: Change, value: float, missed: float | None, back: float, text: Callable[[float], str]
    ) -> None:
        """Have the value confirmed by the unit that ``build`` does, and tell it."""
        for _ in range(2):
            pair = change(value)
            now = time.monotonic()
            verdict = attempt(lambda pair=pair: pair.built(self.end))  # type: ignore[misc]
            self._reserve = max(self._reserve, time.monotonic() - now)
            if verdict.status is Status.CERTIFIED:
                tried = (
                    "" if missed is None or missed in (1.0, self.pair.source.horizon) else f" ({missed:g}: not proved)"
                )
                told = f"{text(value)}{tried}: {verdict.reason}"
                self.found.append(Repair(kind, value, missed, told, verdict, pair.modes, pair.source, pair.target))
                return
            if self._is_over or back == 1.0:
                break
            value = rounded(value * back, up=back > 1.0)
        self._missing(kind, f"{value:g} was proved for the pair, but not by a whole build of the changed modes")


def attempt(prove: Callable[[], Verdict]) -> Verdict:
    """A verdict, or UNDECIDED with the reason where the engine stops."""
    try:
        return prove()
    except ModegraphError as error:
        return Verdict(Status.UNDECIDED, (Reason(Outcome.ENGINE_LIMIT, text=str(error)),))
    except Exception as error:
        reason = Reason(Outcome.ENGINE_STOPPED, error=type(error).__name__, text=str(error))
        return Verdict(Status.UNDECIDED, (reason,))


def rounded(value: float, up: bool) -> float:
    """The value with few digits, rounded up or down."""
    unit = 10.0 ** (math.floor(math.log10(value)) + 1 - DIGITS)
    near = float(f"{value:.{DIGITS}g}")
    if (near >= value) == up or near == value:
        return near
    return float(f"{near + (unit if up else -unit):.{DIGITS}g}")
