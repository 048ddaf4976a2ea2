"""Constraints as a mode's function returns them, turned into faces g <= 0."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from modegraph.errors import ModegraphError
from modegraph.expression.relation import Relation
from modegraph.expression.scalar import Expr


@dataclass(frozen=True)
class Face:
    """One face of a constraint, satisfied where ``expr`` <= 0.

    ``name`` is the constraint's name, with an index for an array ("speed[0]"); the two faces of
    ``abs(e) <= c`` share it.
    """

    name: str
    expr: Expr


def faces_of(returned: Any, where: str) -> list[Face]:
    """Read {name: relation or array of relations}.

    Raises
    ------
    ModegraphError
        For anything else; ``where`` opens the message.
    """
    if not isinstance(returned, Mapping):
        raise ModegraphError(
            f"{where} returned a {type(returned).__name__}, expected a dict of relations such as "
            '{"speed": abs(x[1]) <= 1.0}'
        )
    faces = []
    for name, value in returned.items():
        if not isinstance(name, str) or not name.strip():
            raise ModegraphError(f"{where}: the name {name!r} of a constraint must be a non-empty string")
        for suffix, relation in relations(value):
            label = name + suffix
            if not isinstance(relation, Relation):
                raise ModegraphError(f"{where}: {label!r} {_complaint(relation)}")
            faces += [Face(label, expr) for expr in relation.faces()]
    return faces


def relations(value: Any) -> Iterator[tuple[str, Any]]:
    """Index text and entry of a scalar, list or array."""
    if isinstance(value, list | tuple):
        for k, entry in enumerate(value):
            for suffix, relation in relations(entry):
                yield f"[{k}]{suffix}", relation
    elif isinstance(value, np.ndarray) and value.ndim:
        plain = value.view(np.ndarray)
        for index in np.ndindex(plain.shape):
            yield "".join(f"[{k}]" for k in index), plain[index]
    else:
        yield "", value


def _complaint(value: Any) -> str:
    if isinstance(value, bool | np.bool_):
        return (
            f"is the plain truth value {bool(value)}, not a relation; write it with <= or >= between values "
            "that depend on x, u, r, t, z, w or d (== and != cannot be proved)"
        )
    if isinstance(value, Expr):
        return f"is the number {value.text(40)}, not a relation; compare it with its limit, such as e <= 1.0"
    if value is None:
        return "is None, not a relation; leave the entry out or write a <= b"
    return f"is a {type(value).__name__}, not a relation; write a <= b or a >= b"
