"""All cases, in the order they are printed."""

from __future__ import annotations

from benchmarks import arm, fields, flight

CASES = [*fields.CASES, *arm.CASES, *flight.CASES]
