"""Sublevel sets of a function, a later addition."""

from __future__ import annotations

from typing import Any, NoReturn

from modegraph.errors import NotBuiltYet


class Sublevel:
    """{x : fn(x) <= level}; this version cannot prove anything about one, so constructing it is an error."""

    def __new__(cls, *args: Any, **kwargs: Any) -> NoReturn:
        raise NotBuiltYet(
            "Sublevel sets are not built yet; use Box, Ball, Ellipsoid, Zonotope or Polytope "
            "(for a quadratic function an Ellipsoid is the same set)"
        )
