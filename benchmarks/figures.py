"""Figures to stand beside: what other tools reach, and what a user may expect of this project.

Flow* and the other tools were run on a 2-core x86-64 machine; times drift by up to twice with load, widths do
not.

Sources: VDP, CVDP, LALO, ROBE, LOVO, QUAD and SPRE are the benchmarks of ARCH-COMP, category nonlinear (Geretti
et al., 2020 to 2025); the arm is the planar two-link manipulator of Murray, Li and Sastry, *A Mathematical
Introduction to Robotic Manipulation*, 1994. Flow* is the C++ tool of Chen, Abraham and Sankaranarayanan (CAV
2013), with symbolic remainders: step .02 order 6 for VDP, .1 order 4 for LALO W = .01, .05 order 4 for the wider
ones, adaptive order 3 for ARM-0 and ARM-11, 4 for ARM-12.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from modegraph.reach.flowpipe import Flowpipe


@dataclass(frozen=True)
class Figures:
    """What is shown of a case, and what it is held against.

    ``states``: whose widths at the end are shown. ``seconds``, ``ratio``: the goals; the ratio is to the
    sampled spread. ``holds``: a property of the whole flowpipe and its name. ``own``: for a class of references,
    the goal for how wide it is at one of them, as a multiple of that one's own flowpipe.
    """

    states: tuple[str, ...] = ()
    seconds: float | None = None
    ratio: float | None = None
    flowstar_seconds: float | None = None
    flowstar_width: tuple[float, ...] = ()
    others: str = ""
    holds: tuple[str, Callable[[Flowpipe], bool]] | None = None
    own: float | None = None


def altitude(pipe: Flowpipe) -> bool:
    """x3 < 1.4, x3 > .9 from one second on, x3 in [.98, 1.02] at the end."""
    end = pipe.at(5.0)
    return bool(
        pipe.hull(0.0, 5.0).hi[2] < 1.4
        and pipe.hull(1.0, 5.0).lo[2] > 0.9
        and end.lo[2] >= 0.98
        and end.hi[2] <= 1.02
    )  # fmt: skip


def below(limit: float) -> Callable[[Flowpipe], bool]:
    return lambda pipe: bool(pipe.hull(0.0, 20.0).hi[3] < limit)


HEIGHT = ("x3 as asked", altitude)
"""Of the narrower starts; from +-.8 samples overshoot 1.4."""
ANGLES = ("q1", "q2")

FIGURES = {
    "VDP": Figures(("x", "y"), 0.1, 1.02, 1.8, (0.150, 0.599), "immrax 6.7e3 or NaN; CAPD blows up at 2.1"),
    "VDP y <= 2.75": Figures(seconds=0.3, flowstar_seconds=3.4),
    "VDP, w +-0.01": Figures(("x", "y")),
    "VDP, w +-0.1": Figures(("x", "y")),
    "LALO20 W = 0.01": Figures(
        ("x4",), 0.3, 1.02, 3.9, (0.0032,), "kv .0037 in 2.6 s; immrax 15.5; CAPD fails", ("x4 < 4.5", below(4.5))
    ),
    "LALO20 W = 0.05": Figures(
        ("x4",), 0.5, 1.05, 11.3, (0.0199,), "kv not done in 30 s; CAPD fails", ("x4 < 4.5", below(4.5))
    ),
    "LALO20 W = 0.1": Figures(
        ("x4",), 1.0, 1.1, 10.3, (0.0795,), "kv not done in 30 s; CAPD fails", ("x4 < 5", below(5.0))
    ),
    "CVDP23 b in [1, 3]": Figures(("x1", "y1"), others="Flow* fails at t = 3.95"),
    "CVDP23 y <= 2.75": Figures(seconds=5.0, others="CORA needs 13 splits and an artificial guard"),
    "CVDP b in [.95, 1.05]": Figures(("x1", "y1")),
    "ROBE25 b = 100, g = 1000": Figures(("x", "y", "z"), others="Flow* not done in 60 s"),
    "ROBE25 b = 1000, g = 100000": Figures(("x", "y", "z"), others="Flow* not done in 60 s"),
    "LOVO25, no guard": Figures(("x", "y")),
    "ARM-0": Figures(ANGLES, 0.3, 1.02, 16.6, (0.0074, 0.0202), "Flow* simplified by hand: .00032 in .07 s"),
    "ARM-11": Figures(ANGLES, 0.1, 1.06, 3.4, (0.00065, 0.0014), "CAPD only for boxes of +-.01"),
    "ARM-12": Figures(ANGLES, 0.2, 1.08, 45.0, (0.0078, 0.0194)),
    "ARM-11, set-points +-0.2": Figures(ANGLES, 0.5, own=1.1),
    "ARM-12, set-points +-0.2": Figures(ANGLES, 1.5, own=1.1),
    "ARM-0, w +-0.01": Figures(ANGLES),
    "ARM-0, w +-0.1": Figures(ANGLES),
    "ARM-0, bang-bang": Figures(ANGLES),
    "ARM PD +-0.1": Figures(ANGLES),
    "ARM PD +-0.2": Figures(ANGLES, 1.0),
    "ARM PD +-0.3": Figures(ANGLES, 3.0),
    "ARM PD +-0.5": Figures(ANGLES, 20.0),
    "ARM PD, w +-0.01": Figures(ANGLES),
    "ARM PD, w +-0.1": Figures(ANGLES),
    "ARM PD clipped +-0.02": Figures(ANGLES),
    "ARM PD clipped +-0.1": Figures(ANGLES),
    "QUAD20 +-0.1": Figures(("x3", "x6"), holds=HEIGHT),
    "QUAD20 +-0.4": Figures(("x3", "x6"), 0.5, flowstar_seconds=41.7, others="Flow*: safe", holds=HEIGHT),
    "QUAD20 +-0.8": Figures(("x3", "x6")),
    "QUAD-A": Figures(("x1", "x3"), 3.0, holds=HEIGHT),
    "QUAD20 +-.1, w +-0.01": Figures(("x3", "x6")),
    "QUAD20 +-.1, w +-0.1": Figures(("x3", "x6")),
    "SPRE22 approach": Figures(("x", "y")),
}

CLASSES = {"quadrotor": {"plan": 10.0, "contains": 20.0}, "arm_points": {"build": 60.0}}
"""Goals of graphs with continuous classes: a plan in ms, a look-up in us, a build in s."""
GOALS = {
    "import modegraph": (0.5, "s"),
    "build two_link_arm.py, kernels compiled": (5.0, "s"),
    "peak memory of that build": (1000.0, "MB"),
    "first build on a fresh machine, compiling": (40.0, "s"),
}
"""What a user may expect of this project on two cores."""
