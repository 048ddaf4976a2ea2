"""Changes of a pair that were proved to give its switch: what is told is what was proved."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

from modegraph.certify.verdict import Status, Verdict
from modegraph.errors import ModegraphError
from modegraph.graph.pair import Pair
from modegraph.model.mode import Mode
from modegraph.model.target import Target

Kind = Literal["fix references", "horizon", "grow target", "shrink start"]

SMALLEST, LARGEST = 1e-3, 1e3
"""Least scale of the starts, and largest growth of the target, that are tried."""
PRECISION = 1.005
"""A search ends when the next value by this factor is not proved."""
BACK_OFF = 1.02
"""Towards the safe side, where ``build`` does not find what the search has proved."""
DIGITS = 4
"""Of the values tried: what is printed is exactly what was proved."""
MOST_TRIES = 16
LONGER = (4.0, 16.0)
"""Multiples of the horizon that are tried."""
LATE = 0.75
"""A longer horizon may help where the approach is closest after this part of it."""


@dataclass(frozen=True, eq=False)
class Repair:
    """A change that gives the switch, proved by the unit of work that ``build`` does on the changed modes.

    Attributes
    ----------
    kind : {"shrink start", "grow target", "horizon", "fix references"}
    value : float
        The scale of the starts or of the target about their centre, the horizon in seconds, or 1. It has few
        digits: the printed number is the one that was proved.
    text : str
    verdict : Verdict
        Of the pair, certified.
    modes : tuple of Mode and Target
        The modes of the graph with the change made: pass them to ``build``.
    source, target : Mode, Mode or Target
        The two of them that the switch is between.
    """

    kind: Kind
    value: float
    text: str
    verdict: Verdict
    modes: tuple[Mode | Target, ...]
    source: Mode
    target: Mode | Target

    def __str__(self) -> str:
        return self.text


@dataclass
class RepairSearch:
    """Looks for repairs of an absent switch until an instant of ``time.monotonic()``.

    Attributes
    ----------
    pair : Pair
    gauge : float or None
        How near the starts come to the target as it is, at most 1 inside it.
    end : float
    found : list of Repair
    notes : list of str
        What was not found, and why.
    """

    pair: Pair
    gauge: float | None
    end: float
    found: list[Repair] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    # -- kinds -----------------------------------------------------------------------------------

    def as_it_is(self, classes: bool) -> Verdict:
        """Prove the pair by itself, unchanged; of continuous classes that is a repair."""
        verdict = self._proved(self.pair, 0.3)
        if verdict.status is Status.CERTIFIED and classes:
            text = "list these references with mg.Points: for them alone the switch is certified"
            self._tell("fix references", lambda v: self.pair, 1.0, 1.0, lambda v: text)
        elif verdict.status is Status.CERTIFIED:
            self.notes.append(
                "examined by itself, with more time, the switch is certified: give build a larger budget="
            )
        return verdict

    def longer(self, late: bool) -> None:
        """The shortest horizon; ``late``: the approach was closest near the end of the present one."""
        now = self.pair.source.horizon
        if now is None or not late:
            return
        for multiple in LONGER:
            verdict = self._proved(self.pair.lasting(multiple * now), 0.3)
            if verdict.time is not None:
                break
        else:
            self.notes.append(f"horizon: no switch was proved within {LONGER[-1] * now:g} s either{self._late()}")
            return
        good = rounded(verdict.time[1] * (1.0 + 1e-9), up=True)
        if self._proved(self.pair.lasting(good), 0.3).status is not Status.CERTIFIED:
            good = rounded(multiple * now, up=True)
        good = self._narrowed(self.pair.lasting, good, now)
        self._tell("horizon", self.pair.lasting, good, BACK_OFF, lambda v: f"a horizon of {v:g} s")

    def larger(self) -> None:
        """The smallest growth of the target."""
        bad, verdict, gauge = 1.0, None, self.gauge
        while bad < LARGEST and not self._is_over:
            factor = rounded(bad * max(1.0005, 1.0002 * (2.0 if gauge is None else gauge)), up=True)
            verdict = self._proved(self.pair.grown(factor), 0.4)
            if verdict.status is Status.CERTIFIED:
                break
            bad, gauge = factor, max(1.02, _gauge_of(verdict) or 2.0)
        if verdict is None or verdict.status is not Status.CERTIFIED:
            self.notes.append(f"grow target: nothing was proved up to {bad:g} times its size{self._late()}")
            return
        good = self._narrowed(self.pair.grown, factor, bad)
        name = self.pair.target.name
        what = "the set" if isinstance(self.pair.target, Target) else "the starts"
        self._tell("grow target", self.pair.grown, good, BACK_OFF, lambda v: f"{what} of {name!r} {v:g} times as large")

    def smaller(self) -> None:
        """The largest scale of the starts."""
        least = self._proved(self.pair.shrunk(SMALLEST), 0.4)
        if least.status is not Status.CERTIFIED:
            self.notes.append(
                f"shrink start: not even {SMALLEST:g} times the starts of {self.pair.source.name!r} would do"
                + (f": {least.reason}" if least.reason else "")
                + self._late()
            )
            return
        missing = None if self.gauge is None else 1.0 - self.gauge
        known = least.margin is not None and missing is not None and missing < 0.0 <= least.margin < math.inf
        margins = (least.margin, missing) if known and least.margin is not None and missing is not None else None
        good = self._narrowed(self.pair.shrunk, SMALLEST, 1.0, margins)
        name = self.pair.source.name
        self._tell(
            "shrink start", self.pair.shrunk, good, 1.0 / BACK_OFF, lambda v: f"{v:g} times the starts of {name!r}"
        )

    # -- search ----------------------------------------------------------------------------------

    @property
    def _is_over(self) -> bool:
        return time.monotonic() >= self.end

    def _late(self) -> str:
        return " (the time allowed is over)" if self._is_over else ""

    def _proved(self, pair: Pair, share: float) -> Verdict:
        """The verdict on a changed pair, within a share of the time that is left."""
        now = time.monotonic()
        return attempt(lambda: pair.proved(now + share * max(0.0, self.end - now)))

    def _narrowed(
        self, change: Callable[[float], Pair], good: float, bad: float, margins: tuple[float, float] | None = None
    ) -> float:
        """The proved value nearest to ``bad``, from a proved and a missed one and, if known, their margins.

        Without margins the proved value is itself a good guess: its neighbour is tried first.
        """
        up = bad < good
        half = time.monotonic() + 0.5 * (self.end - time.monotonic())
        look_next_door = margins is None
        for k in range(MOST_TRIES):
            if max(good / bad, bad / good) <= PRECISION or time.monotonic() > half:
                break
            guessed = False
            if look_next_door:
                value = good / PRECISION if up else good * PRECISION
            elif margins is not None and k % 2 == 0:
                value, guessed = _zero(good, bad, *margins), True
            else:
                value = math.sqrt(good * bad)
            value = rounded(value, up)
            if not min(good, bad) < value < max(good, bad):
                break
            verdict = self._proved(change(value), 0.3)
            proved = verdict.status is Status.CERTIFIED
            look_next_door = guessed and proved
            good, bad = (value, bad) if proved else (good, value)
            if margins is not None:
                margins = _with(margins, verdict, proved)
        return good

    def _tell(
        self, kind: Kind, change: Callable[[float], Pair], value: float, back: float, text: Callable[[float], str]
    ) -> None:
        """Have the value confirmed by the unit that ``build`` does, and tell it."""
        for _ in range(2):
            pair = change(value)
            verdict = attempt(lambda pair=pair: pair.built(self.end))  # type: ignore[misc]
            if verdict.status is Status.CERTIFIED:
                told = f"{text(value)}: {verdict.reason}"
                self.found.append(Repair(kind, value, told, verdict, pair.modes, pair.source, pair.target))
                return
            if self._is_over or back == 1.0:
                break
            value = rounded(value * back, up=back > 1.0)
        self.notes.append(
            f"{kind}: {value:g} was proved for the pair, but not by a whole build of the changed modes{self._late()}"
        )


def attempt(prove: Callable[[], Verdict]) -> Verdict:
    """A verdict, or UNDECIDED with the reason where the engine stops."""
    try:
        return prove()
    except ModegraphError as error:
        return Verdict(Status.UNDECIDED, str(error))
    except Exception as error:
        return Verdict(Status.UNDECIDED, f"the proof engine stopped with {type(error).__name__}: {error}")


def rounded(value: float, up: bool) -> float:
    """The value with few digits, rounded up or down."""
    unit = 10.0 ** (math.floor(math.log10(value)) + 1 - DIGITS)
    near = float(f"{value:.{DIGITS}g}")
    if (near >= value) == up or near == value:
        return near
    return float(f"{near + (unit if up else -unit):.{DIGITS}g}")


def _zero(good: float, bad: float, margin: float, missing: float) -> float:
    """Where a margin that is linear in the value becomes zero, and a little less."""
    return good + (bad - good) * margin / (margin - missing) * 0.999


def _with(margins: tuple[float, float], verdict: Verdict, proved: bool) -> tuple[float, float] | None:
    """The margins of the proved and the missed value, one of them new; None where it has none."""
    new = verdict.margin
    if new is None or not math.isfinite(new) or (new >= 0.0) != proved:
        return None
    return (new, margins[1]) if proved else (margins[0], new)


def _gauge_of(verdict: Verdict) -> float | None:
    return None if verdict.closest is None else verdict.closest.gauge
