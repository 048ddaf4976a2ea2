"""One verdict for a class of references out of the verdicts of its members."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from modegraph.certify.reason import Outcome, Reason, point
from modegraph.certify.references import Parameter
from modegraph.certify.verdict import Status, Verdict, Witness

Case = tuple[Parameter, Parameter, Verdict]


def some_pair(cases: Sequence[Case]) -> Verdict:
    """The existential verdict over pairs (r_i, r_j): certified if one is, refuted if all are.

    The figures of a certified answer hold for every certified pair: hull of the times, smallest
    margin, slack and window, largest energy. Otherwise ``margin`` is that of the closest pair.
    """
    cases = [(r_i, r_j, _with_references(v, r_i, r_j)) for r_i, r_j, v in cases]
    if len(cases) == 1:
        return cases[0][2]
    by_status = {s: [c for c in cases if c[2].status is s] for s in Status}
    certified, undecided = by_status[Status.CERTIFIED], by_status[Status.UNDECIDED]
    count = len(cases)
    if certified:
        verdicts = [v for _, _, v in certified]
        times = [v.time for v in verdicts if v.time is not None]
        return replace(
            verdicts[0],
            why=(Reason(Outcome.SOME_PAIRS_CERTIFIED, certified=len(certified), count=count, **_told(certified[0])),),
            time=(min(t[0] for t in times), max(t[1] for t in times)) if times else None,
            margin=_smallest(v.margin for v in verdicts),
            slack=_least_slack(verdicts),
            horizon=_smallest(v.horizon for v in verdicts if v.horizon is not None),
            energy=_largest(v.energy for v in verdicts),
            window=_smallest(v.window for v in verdicts),
            closest=deciding_pair(certified)[2].closest,
        )
    rest = undecided or cases
    closest = deciding_pair(rest)
    horizons = [v.horizon for _, _, v in rest if v.horizon is not None]
    if undecided:
        reason = Reason(Outcome.SOME_PAIRS_UNDECIDED, undecided=len(undecided), count=count, **_told(closest))
        status = Status.UNDECIDED
    else:
        reason = Reason(Outcome.ALL_PAIRS_REFUTED, count=count, **_told(closest))
        status = Status.REFUTED
    return Verdict(
        status=status,
        why=(reason,),
        margin=closest[2].margin,
        witness=closest[2].witness,
        horizon=min(horizons) if horizons else None,
        until=closest[2].until,
        closest=closest[2].closest,
        unproved=closest[2].unproved,
    )


def deciding_pair(cases: Sequence[Case]) -> Case:
    """The pair an existential verdict speaks of: the certified one with the least margin, else the closest one."""
    certified = [c for c in cases if c[2].status is Status.CERTIFIED]
    if certified:
        return min(certified, key=lambda c: np.inf if c[2].margin is None else c[2].margin)
    rest = [c for c in cases if c[2].status is Status.UNDECIDED] or cases
    return max(rest, key=lambda c: -np.inf if c[2].margin is None else c[2].margin)


def every_member(cases: Sequence[tuple[Parameter, Verdict]]) -> Verdict:
    """The universal verdict of a check over a class: certified if all are, refuted if one is."""
    if len(cases) == 1:
        return cases[0][1]
    count = len(cases)
    failing = [c for c in cases if c[1].status is Status.REFUTED]
    open_ = [c for c in cases if c[1].status is Status.UNDECIDED]
    verdicts = [v for _, v in cases]
    if failing:
        p, worst = failing[0]
        example = {"count": count, "r": point(p), "why": worst.why}
        why = (Reason(Outcome.SOME_REFERENCES_REFUTED, failing=len(failing), **example),)
        return replace(worst, why=why, witness=_named(worst.witness, p, None))
    if open_:
        p, worst = open_[0]
        example = {"count": count, "r": point(p), "why": worst.why}
        return replace(
            worst,
            why=(Reason(Outcome.SOME_REFERENCES_UNDECIDED, undecided=len(open_), **example),),
            until=_smallest(v.until for _, v in open_),
            slack=_least_slack(verdicts),
            tracking=_widest(verdicts),
        )
    return replace(
        verdicts[0],
        why=(Reason(Outcome.ALL_REFERENCES_CERTIFIED, count=count),),
        margin=_smallest(v.margin for v in verdicts),
        slack=_least_slack(verdicts),
        tracking=_widest(verdicts),
    )


def _told(case: Case) -> dict[str, Any]:
    """The fields of a reason that speaks of one pair."""
    r_i, r_j, verdict = case
    return {"r_i": point(r_i), "r_j": point(r_j), "why": verdict.why}


def _with_references(verdict: Verdict, r_i: Parameter, r_j: Parameter) -> Verdict:
    if verdict.witness is None:
        return verdict
    return replace(verdict, witness=_named(verdict.witness, r_i, r_j))


def _named(witness: Witness | None, r_i: Parameter, r_j: Parameter) -> Witness | None:
    if witness is None:
        return None
    return replace(
        witness,
        r_i=r_i if witness.r_i is None else witness.r_i,
        r_j=r_j if witness.r_j is None else witness.r_j,
    )


def _smallest(values: Iterable[float | None]) -> float | None:
    found = list(values)
    known = [v for v in found if v is not None]
    return min(known) if known and len(known) == len(found) else None


def _largest(values: Iterable[float | None]) -> float | None:
    found = list(values)
    known = [v for v in found if v is not None]
    return max(known) if known and len(known) == len(found) else None


def _least_slack(verdicts: Sequence[Verdict]) -> dict[str, float]:
    """Only constraints that every verdict has a bound for: a missing one is not known to hold."""
    names = [n for n in verdicts[0].slack if all(n in v.slack for v in verdicts)]
    return {n: min(v.slack[n] for v in verdicts) for n in names}


def _widest(verdicts: Sequence[Verdict]) -> np.ndarray | None:
    bounds = [v.tracking for v in verdicts if v.tracking is not None]
    return np.max(bounds, axis=0) if bounds and len(bounds) == len(verdicts) else None
