"""Why a step could not be validated, and what would help."""

from __future__ import annotations

from modegraph.enclosure.step import JACOBIAN_UNDEFINED, NO_GROWTH_BOUND, UNDEFINED
from modegraph.reach.field import Field
from modegraph.reach.flow.records import Failure


def breakdown(time: float, status: int, node: int, fld: Field, widest: str) -> Failure:
    """The failure for a status of the step kernel: ``node`` of the tape it names, ``widest`` the state."""
    away = "keep the starts away from there, or shrink the start set"
    shrink = "shrink or split the start set, or shorten the horizon"
    if status == UNDEFINED:
        return Failure(time, f"a function leaves its domain: {fld.rates.labels[node]}", away)
    if status == JACOBIAN_UNDEFINED:
        label = fld.jacobian.labels[node]
        what = f"a function of the loop is not defined, or not continuous, on the whole set: {label}"
        return Failure(time, what, away)
    if status == NO_GROWTH_BOUND:
        what = f"the error bound cannot be closed (state '{widest}' is the widest): the set has grown too far"
        return Failure(time, what, shrink)
    return Failure(time, f"the remainder does not contract (state '{widest}' is the widest)", shrink)
