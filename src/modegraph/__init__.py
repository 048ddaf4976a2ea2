"""Prove which controllers can be chained, plan the best chain, run it.

Public names are imported when they are first used, so that ``import modegraph`` stays fast.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, NoReturn

from modegraph import api  # noqa: F401  the methods that classes take when they are made
from modegraph.errors import ModegraphError, ModegraphWarning, NotBuiltYet, Unreachable

if TYPE_CHECKING:
    from modegraph.certify.largest_start import largest_start
    from modegraph.certify.reason import Outcome, Reason
    from modegraph.certify.references import References
    from modegraph.certify.verdict import Status, Verdict, Witness
    from modegraph.explain.explanation import Explanation
    from modegraph.explain.repairs import Repair
    from modegraph.graph.build import build
    from modegraph.graph.modegraph import ModeGraph
    from modegraph.graph.submodes import Submode
    from modegraph.graph.switch import Switch
    from modegraph.model.memory import Memory
    from modegraph.model.mode import Mode
    from modegraph.model.reference import Points, setpoint
    from modegraph.model.sets.ball import Ball
    from modegraph.model.sets.box import Box
    from modegraph.model.sets.ellipsoid import Ellipsoid
    from modegraph.model.sets.polytope import Polytope
    from modegraph.model.sets.sublevel import Sublevel
    from modegraph.model.sets.zonotope import Zonotope
    from modegraph.model.signals import minimum_energy, minimum_time, quintic
    from modegraph.model.system import System
    from modegraph.model.target import Target
    from modegraph.model.trajectory import trajectory
    from modegraph.plan.plan import Plan
    from modegraph.reach.flowpipe import flowpipe
    from modegraph.run.simulate import Run

__version__ = "0.1.0"

__all__ = [
    "Ball",
    "Box",
    "Ellipsoid",
    "Explanation",
    "Memory",
    "Mode",
    "ModeGraph",
    "ModegraphError",
    "ModegraphWarning",
    "NotBuiltYet",
    "Outcome",
    "Plan",
    "Points",
    "Polytope",
    "Reason",
    "References",
    "Repair",
    "Run",
    "Status",
    "Sublevel",
    "Submode",
    "Switch",
    "System",
    "Target",
    "Unreachable",
    "Verdict",
    "Witness",
    "Zonotope",
    "build",
    "flowpipe",
    "largest_start",
    "load",
    "minimum_energy",
    "minimum_time",
    "quintic",
    "setpoint",
    "trajectory",
]

_HOME = {
    "Ball": "model.sets.ball",
    "Box": "model.sets.box",
    "Ellipsoid": "model.sets.ellipsoid",
    "Explanation": "explain.explanation",
    "Memory": "model.memory",
    "Mode": "model.mode",
    "ModeGraph": "graph.modegraph",
    "Outcome": "certify.reason",
    "Plan": "plan.plan",
    "Points": "model.reference",
    "Polytope": "model.sets.polytope",
    "Reason": "certify.reason",
    "References": "certify.references",
    "Repair": "explain.repairs",
    "Run": "run.simulate",
    "Status": "certify.verdict",
    "Sublevel": "model.sets.sublevel",
    "Submode": "graph.submodes",
    "Switch": "graph.switch",
    "System": "model.system",
    "Target": "model.target",
    "Verdict": "certify.verdict",
    "Witness": "certify.verdict",
    "Zonotope": "model.sets.zonotope",
    "build": "graph.build",
    "flowpipe": "reach.flowpipe",
    "largest_start": "certify.largest_start",
    "minimum_energy": "model.signals",
    "minimum_time": "model.signals",
    "quintic": "model.signals",
    "setpoint": "model.reference",
    "trajectory": "model.trajectory",
}
"""Module of each public name that is imported on first use, relative to this package."""


def load(path: Any) -> NoReturn:
    """Read a saved graph; not built yet."""
    raise NotBuiltYet("load: saving and loading graphs is not built yet; build the graph from its modes")


def __getattr__(name: str) -> Any:
    if name == "Supervisor":
        raise NotBuiltYet("Supervisor is not built yet; run a plan with plan.simulate(x0)")
    home = _HOME.get(name)
    if home is None:
        raise AttributeError(f"module 'modegraph' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"modegraph.{home}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
