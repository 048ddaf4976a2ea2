"""Figures to stand beside: definitions, sampled spreads and what other tools reach.

Flow* and the other tools were run on a 2-core x86-64 machine; times drift by up to twice with load, widths do
not. The spread is the width of the reachable set as found by sampling: no sound width is smaller.

Sources: VDP and LALO20 are the Van der Pol and Laub-Loomis benchmarks of ARCH-COMP 2020, category nonlinear
(Geretti et al.); the arm is the planar two-link manipulator of Murray, Li and Sastry, *A Mathematical
Introduction to Robotic Manipulation*, 1994, with computed torque. Flow* is the C++ tool of Chen, Abraham and
Sankaranarayanan (CAV 2013), with symbolic remainders: step .02 order 6 for VDP, .1 order 4 for LALO, adaptive
order 3 for the arm.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Anchor:
    """One row: widths at the end time, in the order of ``states``."""

    name: str
    states: tuple[str, ...]
    spread: tuple[float, ...]
    flowstar_width: tuple[float, ...]
    flowstar_seconds: float
    others: str


VDP = Anchor("VDP, T = 7", ("x", "y"), (0.104, 0.436), (0.150, 0.599), 1.8, "immrax 6.7e3 or NaN; CAPD ends at 2.1")
LALO = Anchor("LALO W = .01, T = 20", ("x4",), (0.0025,), (0.0032,), 3.9, "kv .0037 in 2.6 s; immrax 15.5; CAPD fails")
ARM_0 = Anchor(
    "ARM-0, T = 3",
    ("q1", "q2"),
    (0.00032, 0.00032),
    (0.0074, 0.0202),
    16.6,
    "Flow* simplified by hand: .00032 in .07 s",
)

GOALS = {
    "import modegraph": (0.5, "s"),
    "build two_link_arm.py, kernels compiled": (5.0, "s"),
    "peak memory of that build": (1000.0, "MB"),
    "first build on a fresh machine, compiling": (40.0, "s"),
}
"""What a user may expect of this project on two cores."""
