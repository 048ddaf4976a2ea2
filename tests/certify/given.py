"""Evidence that is given by its numbers, for tests of what becomes of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from modegraph.certify.lasting import LastingEvidence
from modegraph.certify.proof import SafetyProof, SwitchProof
from modegraph.certify.switching.base import Evidence

SWITCH = {"earliest": 0.5, "latest": 1.0, "margin": 0.1, "window": 0.2, "energy": 3.0, "slack": {"a": 0.0}}


def _given(name: str) -> Any:
    return property(lambda self: self.__dict__["numbers"][name])


class Given(Evidence):
    earliest, latest, margin, window, energy, slack = map(_given, SWITCH)

    def __init__(self, **numbers: Any) -> None:
        self.__dict__["numbers"] = SWITCH | numbers


class GivenLasting(LastingEvidence):
    slack, start, tracking = map(_given, ("slack", "start", "tracking"))

    def __init__(self, **numbers: Any) -> None:
        self.__dict__["numbers"] = numbers


def switch(**numbers: Any) -> SwitchProof:
    """A proof with one piece of evidence of these numbers."""
    return SwitchProof((Given(**numbers),))


def safety(slack: Mapping[str, float], start: float, tracking: np.ndarray) -> SafetyProof:
    """A proof of Assumption 1 of one part."""
    return SafetyProof((GivenLasting(slack=slack, start=start, tracking=tracking),))
