"""What a unit of work is asked to reach."""

from __future__ import annotations

from dataclasses import dataclass

from modegraph.certify.verdict import Floats
from modegraph.model.mode import Mode
from modegraph.model.target import Target


@dataclass(frozen=True, eq=False)
class TargetSpec:
    """A target of a unit: a mode under the reference p (None: its whole class), or a `Target`."""

    name: str
    p: Floats | None
    mode: Mode | Target
