"""Why a step could not be validated, and what would help."""

from __future__ import annotations

from modegraph.enclosure.step import JACOBIAN_UNDEFINED, NO_GROWTH_BOUND, UNDEFINED
from modegraph.reach.failure import Failure, Mechanism
from modegraph.reach.field import Field


def breakdown(time: float, status: int, node: int, fld: Field, widest: str) -> Failure:
    """The failure for a status of the step kernel: ``node`` of the tape it names, ``widest`` the state."""
    if status == UNDEFINED:
        return Failure(Mechanism.OUTSIDE_DOMAIN, time=time, label=fld.rates.labels[node])
    if status == JACOBIAN_UNDEFINED:
        return Failure(Mechanism.NOT_CONTINUOUS, time=time, label=fld.jacobian.labels[node])
    if status == NO_GROWTH_BOUND:
        return Failure(Mechanism.NO_GROWTH_BOUND, time=time, state=widest)
    return Failure(Mechanism.NO_CONTRACTION, time=time, state=widest)
