"""The trajectory of a counterexample, enclosed again to see how near it comes to the target."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from modegraph.certify.approach import approach_of
from modegraph.certify.counterexamples.trajectory import PointRun, scene_of
from modegraph.certify.switching.base import Nearest
from modegraph.certify.switching.common_time import Reach
from modegraph.certify.unit import POINT_STEPS, TargetSpec, goal_of
from modegraph.certify.verdict import Approach, Floats, Unproved, Witness
from modegraph.deadline import Deadline
from modegraph.model.mode import Mode
from modegraph.model.target import Target
from modegraph.reach.compiled import compile_mode

LOOKS = 400
"""Instants looked at, at least, where there is a horizon."""
LONG = 20.0
"""Seconds a trapped trajectory is followed where there is none."""


def witnessed(
    mode: Mode, p: Floats | None, witness: Witness, spec: TargetSpec, *, horizon: float | None, deadline: Deadline
) -> tuple[Approach | None, Unproved | None]:
    """How near the trajectory of a witness comes to the target, and which constraint it violates.

    The trajectory is validated; it is looked at at the ends of its steps, as long as no constraint is violated.
    Where it cannot be followed for as long as the witness says, nothing is told. An equilibrium is looked at
    where it is: that of a start beside it may go anywhere.

    Parameters
    ----------
    horizon : seconds; None: a little longer than the witness needs.
    deadline : after which the trajectory is followed no further.
    """
    compiled = compile_mode(mode, p)
    scene = scene_of(mode, compiled)
    goal = goal_of(spec, compiled.plant)
    end = LONG + 2.0 * witness.time if horizon is None else horizon
    if witness.kind == "trapped" and witness.time == 0.0:
        end = 0.0
    w = np.clip(np.zeros(len(scene.w_lo)), scene.w_lo, scene.w_hi) if witness.w is None else np.asarray(witness.w)
    d = np.array([witness.d.get(name, middle) for name, middle in zip(scene.unknowns, scene.constants(), strict=True)])
    run = PointRun(scene, np.asarray(witness.x0, float), w, d, end / LOOKS if end else np.inf)
    steps = 0
    while run.violation is None and run.flow.time < end and steps < POINT_STEPS and not deadline.is_over:
        steps += 50
        before = run.flow.time
        run.extend(end, steps)
        if run.flow.time == before:
            break
    reach = Reach(run.flow, end, goal.reset)
    if run.violation is None and run.flow.time < witness.time:
        return None, None
    if reach.usable < 0:
        return None, run.breach()
    region = goal.region
    sets = reach.sets(region.dim)
    gauges = region.gauges(sets)
    k = int(np.argmin(gauges))
    nearest = Nearest(float(reach.times[k]), float(gauges[k]), sets[k])
    names = compiled.loop.names if isinstance(spec.mode, Target) else spec.mode.state_names
    closest = approach_of(nearest, region, names)
    return closest and replace(closest, start=run.x0, origin="witness"), run.breach()
