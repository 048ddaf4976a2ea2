"""When the starts of a piece pass the kinks of a loop, in double precision. Proposals; nothing here is proved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from modegraph.expression.evaluate import Evaluator
from modegraph.expression.ops import RELU
from modegraph.reach.field import Field

Floats = NDArray[np.float64]

SECANT_STEPS = 4
MOST_ROUNDS = 400
"""Steps of the integration, at most."""
MOST_PASSAGES = 4
SAME = 1e-12
"""Arguments whose samples are parallel but for this have one kink."""


@dataclass(frozen=True)
class Passage:
    """All samples pass one kink: seconds of each (S,) from now, and the number of the kink."""

    kink: int
    seconds: Floats


class Kinks:
    """The arguments of max(., 0) in the rates of a field that does not depend on time."""

    def __init__(self, fld: Field) -> None:
        self.states = fld.states
        rates = fld.rates
        arguments = np.unique(rates.ops[rates.ops[:, 0] == RELU, 1])
        self._evaluate = Evaluator(replace(rates, outputs=np.concatenate([rates.outputs, arguments])))

    def _both(self, x: Floats, rest: Floats) -> tuple[Floats, Floats]:
        """Rates (n, S) and arguments (k, S) at states x (n, S)."""
        out = self._evaluate(np.vstack([x, rest]))
        return out[: self.states], out[self.states :]

    def _moved(self, x: Floats, rest: Floats, seconds: Floats) -> Floats:
        """One Runge-Kutta step of so many seconds each."""
        a = self._both(x, rest)[0]
        b = self._both(x + 0.5 * seconds * a, rest)[0]
        c = self._both(x + 0.5 * seconds * b, rest)[0]
        d = self._both(x + seconds * c, rest)[0]
        return np.asarray(x + seconds / 6.0 * (a + 2.0 * b + 2.0 * c + d))

    def speeds(self, x: Floats, rest: Floats) -> tuple[Floats, Floats]:
        """Arguments (k, S) and how fast they change, per second."""
        rate, argument = self._both(x, rest)
        step = 1e-6 * (1.0 + np.abs(x).max()) / max(float(np.abs(rate).max()), 1e-300)
        return argument, (self._both(x + step * rate, rest)[1] - argument) / step

    def swings(self, x: Floats, rest: Floats, radius: Floats) -> Floats:
        """How far the arguments (k, S) go where each state moves by its radius (n,)."""
        argument = self._both(x, rest)[1]
        total = np.zeros_like(argument)
        for i in np.flatnonzero(radius):
            there = x.copy()
            there[i] += radius[i]
            total += np.abs(self._both(there, rest)[1] - argument)
        return total

    def _meeting(
        self, x: Floats, rest: Floats, seconds: Floats, kink: NDArray[np.int64], low: Floats, high: Floats
    ) -> Floats:
        """The share (S,) of a step after which a kink of each sample is met; its argument goes from low to high."""
        positive = low > 0.0
        a, b = np.zeros_like(low), np.ones_like(low)
        for k in range(SECANT_STEPS + 1):
            share = np.clip(a + (b - a) * np.abs(low) / np.maximum(np.abs(low) + np.abs(high), 1e-300), a, b)
            if k == SECANT_STEPS:
                break
            value = self._both(self._moved(x, rest, share * seconds), rest)[1][kink, np.arange(len(kink))]
            before = (value > 0.0) == positive
            a, low = np.where(before, share, a), np.where(before, value, low)
            b, high = np.where(before, b, share), np.where(before, high, value)
        return share

    def passages(self, x: Floats, rest: Floats, step: float, longest: float, late: float) -> Sequence[Passage] | None:
        """The kinks that all samples x (n, S) pass from here on, in one and the same order.

        Looks on for the share ``late`` of the time it takes all samples to pass one. None: where some pass a
        kink that others do not pass, or in another order, or later than ``longest`` seconds.
        """
        count = x.shape[1]
        _, argument = self._both(x, rest)
        chosen = _distinct(argument)
        positive = argument[chosen] > 0.0
        if (positive.any(axis=1) & ~positive.all(axis=1)).any():
            return None
        clock = np.zeros(count)
        passed = np.zeros(count, np.int64)
        order: list[int] = []
        seconds: list[Floats] = []
        for _ in range(MOST_ROUNDS):
            done = order and (passed == len(order)).all()
            target = min(longest, _end(seconds, late)) if done else longest
            going = np.flatnonzero(clock < target)
            if not len(going):
                break
            now, w = x[:, going], rest[:, going]
            dt = np.minimum(step, target - clock[going])
            after = self._moved(now, w, dt)
            ahead = self._both(after, w)[1][chosen]
            crossing = (ahead > 0.0) != positive[:, going]
            if crossing.any():
                here = self._both(now, w)[1][chosen]
                share = np.where(crossing, np.abs(here) / np.maximum(np.abs(here) + np.abs(ahead), 1e-300), np.inf)
                at = np.flatnonzero(crossing.any(axis=0))
                kink = share.argmin(axis=0)[at]
                ends = here[kink, at], ahead[kink, at]
                dt[at] *= self._meeting(now[:, at], w[:, at], dt[at], chosen[kink], *ends)
                after[:, at] = self._moved(now[:, at], w[:, at], dt[at])
                for k, s, t in zip(kink, going[at], clock[going[at]] + dt[at], strict=True):
                    if passed[s] == len(order):
                        if len(order) == MOST_PASSAGES:
                            return None
                        order.append(int(k))
                        seconds.append(np.zeros(count))
                    if order[passed[s]] != k:
                        return None
                    seconds[passed[s]][s] = t
                    passed[s] += 1
                    positive[k, s] = not positive[k, s]
            x = x.copy()
            x[:, going] = after
            clock[going] += dt
        if not order or (passed < len(order)).any() or (clock < 0.999 * _end(seconds, late)).any():
            return None
        return [Passage(int(chosen[k]), t) for k, t in zip(order, seconds, strict=True)]


def _end(seconds: Sequence[Floats], late: float) -> float:
    return max(float(t.max() + late * np.ptp(t)) for t in seconds)


def _distinct(argument: Floats) -> NDArray[np.int64]:
    """Numbers of the arguments (k, S) that are no multiples of others."""
    chosen: list[int] = []
    for k, row in enumerate(argument):
        size = float(row @ row)
        multiple = (
            float(row @ argument[other]) ** 2 >= (1.0 - SAME) * size * float(argument[other] @ argument[other])
            for other in chosen
        )
        if not any(multiple):
            chosen.append(k)
    return np.array(chosen, np.int64)
