"""What is said of an outcome: a kind with fields. Prose is made where it is shown, and nothing reads it back."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import Enum
from string import Formatter
from typing import Any

Prose = str | Callable[..., str]
"""A template over the fields ("at t = {time:.4g} s"), or a function that takes them by name."""


class Kind(Enum):
    """A kind of statement. Each member is a pair of `Prose`: what is so, and what would change it.

    The text names all fields there are; those with a default in a function may be left out.
    """

    @property
    def text(self) -> Prose:
        """What is so."""
        return self.value[0]

    @property
    def remedy(self) -> Prose:
        """What would change it."""
        return self.value[1]

    @property
    def key(self) -> str:
        """The name in data: "no_common_time"."""
        return self.name.lower()

    def complain(self, fields: Mapping[str, Any]) -> None:
        """TypeError where the fields are not those of the text."""
        if callable(self.text):
            inspect.signature(self.text).bind(**fields)
        elif (names := {name for _, name, _, _ in Formatter().parse(self.text) if name}) != set(fields):
            raise TypeError(f"{self.name} has the fields {sorted(names)}, not {sorted(fields)}")


class Statement:
    """A kind and its fields; ``str()`` is the text, ``remedy`` what would change it. Immutable; equal by value.

    Attributes
    ----------
    kind : Kind
    fields : Mapping[str, Any]
        Numbers, texts, tuples of numbers, None, and other statements (or tuples of them).
    """

    __slots__ = ("fields", "kind")
    label = "kind"
    """The name of the kind in data."""

    def __init__(self, kind: Kind, /, **fields: Any) -> None:
        kind.complain(fields)
        self.kind = kind
        self.fields: Mapping[str, Any] = fields

    def __str__(self) -> str:
        return _made(self.kind.text, self.fields)

    @property
    def remedy(self) -> str:
        """What would change it, in words."""
        return _made(self.kind.remedy, self.fields)

    def data(self) -> dict[str, Any]:
        """The name of the kind, and the fields, as data."""
        return {self.label: self.kind.key, **{name: _plain(value) for name, value in self.fields.items()}}

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and (other.kind, other.fields) == (self.kind, self.fields)

    def __hash__(self) -> int:
        return hash((self.kind, *self.fields))

    def __repr__(self) -> str:
        fields = "".join(f", {name}={value!r}" for name, value in self.fields.items())
        return f"{type(self).__name__}({self.kind.name}{fields})"


def remedies(statements: Iterable[Statement]) -> str:
    """What would help, each once; not where the text says it itself."""
    return _joined(s.remedy for s in statements if s.remedy != str(s))


def told(statements: Sequence[Statement]) -> str:
    """What is so, and then what would help."""
    return _joined([texts(statements), remedies(statements)])


def texts(statements: Iterable[Statement]) -> str:
    """What is so."""
    return _joined(map(str, statements))


def _joined(parts: Iterable[str]) -> str:
    return "; ".join(dict.fromkeys(part for part in parts if part))


def _made(prose: Prose, fields: Mapping[str, Any]) -> str:
    return prose.format(**fields) if isinstance(prose, str) else prose(**fields)


def _plain(value: Any) -> Any:
    if isinstance(value, Statement):
        return value.data()
    return [_plain(v) for v in value] if isinstance(value, tuple | list) else value
