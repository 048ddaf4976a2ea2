"""Why the flowpipe or the set that closes the time axis could not be made: the mechanism, with its numbers."""

from __future__ import annotations

from enum import unique
from typing import Any

from modegraph.errors import ModegraphError
from modegraph.reach.statement import Kind, Statement, told

_AWAY = "keep the starts away from there, or shrink the start set"
_SHRINK = "shrink or split the start set, or shorten the horizon"
_SETTLE = "let the controller settle there, or be content with the time that is proved"
_LONGER = "a longer horizon would help"
_NARROW = "a smaller start set or disturbance would help"


def _stopped(failure: Statement) -> str:
    return f"the flow of the candidate set stops {failure}"


def _stopped_remedy(failure: Statement) -> str:
    return failure.remedy


@unique
class Mechanism(Kind):
    """What stood in the way, and what would help. ``time``: seconds after entering the mode."""

    # The flowpipe.
    OUTSIDE_DOMAIN = "at t = {time:.6g} s a function leaves its domain: {label}", _AWAY
    NOT_CONTINUOUS = (
        "at t = {time:.6g} s a function of the loop is not defined, or not continuous, on the whole set: {label}",
        _AWAY,
    )
    NO_GROWTH_BOUND = (
        "at t = {time:.6g} s the error bound cannot be closed (state '{state}' is the widest): the set has grown "
        "too far",
        _SHRINK,
    )
    NO_CONTRACTION = "at t = {time:.6g} s the remainder does not contract (state '{state}' is the widest)", _SHRINK
    CLASS_TOO_LARGE = (
        "at t = 0 s the start set cannot be enclosed over so large a part of the class",
        "make the class smaller",
    )
    RESET_UNDEFINED = (
        "at t = 0 s the reset of the memory is not defined on the whole start set ({label})",
        "shrink the start set",
    )
    OUT_OF_TIME = "at t = {time:.6g} s the budget ended", "give more, or shorten the horizon"
    FILLED = "at t = {time:.6g} s the disturbance has filled the reach set", _NARROW
    NOT_ENCLOSED_AGAIN = "at t = {time:.6g} s the reach set cannot be enclosed again", _NARROW
    ENGINE_STOPPED = (
        "the proof engine stopped with {error}: {text}",
        "please report it: this is a fault of modegraph, not of the model",
    )
    ENGINE_LIMIT = "{text}", "state the model as it says"
    # Cutting the starts.
    NO_MORE_CUTS = "no more are tried", _SHRINK
    CUTS_DO_NOT_HELP = "cutting it gets no further", _SHRINK
    # All time after some instant.
    DEPENDS_ON_TIME = "the loop still depends on time", "let the dynamics, controller and constraints not read t"
    REFERENCE_MOVES = "the reference still moves", "a horizon longer than the reference would help"
    NOT_FOLLOWED = "the flowpipe was not followed until the loop had settled", _LONGER
    ENDS_BEFORE_SETTLED = "the flowpipe ends before the loop has settled", _SHRINK
    NO_EQUILIBRIUM = "no equilibrium was found near the end of the flowpipe", f"{_LONGER}, or another reference"
    JACOBIAN_NOT_FINITE = (
        "the Jacobian at the equilibrium is not finite",
        "move the reference away from where the loop has no slope",
    )
    DOES_NOT_SETTLE = (
        "the loop does not settle: its slowest mode has the rate {rate:.3g} 1/s, so nothing can be said for all time",
        _SETTLE,
    )
    PARALLEL_MODES = "the modes of the loop are nearly parallel", "other gains would help"
    NOT_IN_CANDIDATE = "the reach set is not inside the candidate set", _LONGER
    CANDIDATE_STOPS = _stopped, _stopped_remedy
    CONSTRAINT_IN_CANDIDATE = (
        "constraint '{constraint}' cannot be proved on the candidate set",
        "a looser constraint or a smaller disturbance would help",
    )
    CANDIDATE_FILLED = "the disturbance fills the candidate set before it returns", "a smaller disturbance would help"
    DOES_NOT_RETURN = "the candidate set does not return into itself", f"{_LONGER}, or other gains"
    CONSTRAINT_IN_TAIL = (
        "a constraint cannot be proved on the invariant set",
        "a looser constraint or a smaller disturbance would help",
    )
    # Funnels.
    NOT_BOUNDED = "the reach set is not bounded", _SHRINK
    UNDEFINED_AT_EQUILIBRIUM = "the loop is not defined at its equilibrium for all unknowns", _AWAY
    NO_TIME_FOR_ELLIPSOIDS = "the budget ended before an ellipsoid was proved to shrink", "try a larger budget="
    NO_ELLIPSOID = "no ellipsoid around the reach set is proved to shrink", _NARROW
    FUNNEL_CONSTRAINT = (
        "a constraint, or a bound of the inputs, fails in the ellipsoids that shrink",
        "a looser constraint or a smaller start set would help",
    )
    NOT_IN_ELLIPSOID = "the reach set is not inside the ellipsoid that shrinks", _NARROW


class Failure(Statement):
    """Why something could not be made: `mechanism`, its fields, and what would help."""

    __slots__ = ()
    label = "mechanism"

    def __init__(self, mechanism: Mechanism, /, **fields: Any) -> None:
        super().__init__(mechanism, **fields)

    @property
    def mechanism(self) -> Kind:
        """The `Mechanism`."""
        return self.kind

    @property
    def in_full(self) -> str:
        """The text with what would help."""
        return told([self])


def engine_stopped(error: Exception) -> tuple[Mechanism, dict[str, str]]:
    """What an error of the engine is: a limit that it names, or a fault of its own; with the fields."""
    if isinstance(error, ModegraphError):
        return Mechanism.ENGINE_LIMIT, {"text": str(error)}
    return Mechanism.ENGINE_STOPPED, {"error": type(error).__name__, "text": str(error)}
