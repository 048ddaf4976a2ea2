"""Sets of states: membership and inclusion are decided exactly."""

from modegraph.model.sets.ball import Ball
from modegraph.model.sets.base import Set
from modegraph.model.sets.box import Box
from modegraph.model.sets.ellipsoid import Ellipsoid
from modegraph.model.sets.inclusion import is_subset
from modegraph.model.sets.parametrised import ParametrisedSet
from modegraph.model.sets.polytope import Polytope
from modegraph.model.sets.sublevel import Sublevel
from modegraph.model.sets.zonotope import Zonotope

__all__ = ["Ball", "Box", "Ellipsoid", "ParametrisedSet", "Polytope", "Set", "Sublevel", "Zonotope", "is_subset"]
