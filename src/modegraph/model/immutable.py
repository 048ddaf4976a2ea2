"""What an engineer stated stays as it was stated: a proof is about it."""

from __future__ import annotations

import difflib
import functools
import inspect
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NoReturn, Self

from modegraph.errors import ModegraphError, NoSuchAttribute

_BUILT = "_built"


class Immutable:
    """An object whose attributes are set by its constructor, and by nothing else.

    A cached property keeps its value in the ``__dict__`` and is not stopped.
    """

    _remedy = "make another one"
    """What to do instead of changing it."""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if "__init__" in cls.__dict__:
            cls.__init__ = _closing(cls.__dict__["__init__"])  # type: ignore[method-assign]

    def __setattr__(self, name: str, value: Any) -> None:
        if _BUILT in self.__dict__:
            self._refuse(name)
        super().__setattr__(name, value)

    def __delattr__(self, name: str) -> None:
        self._refuse(name)

    if not TYPE_CHECKING:  # a type checker would take every name for an attribute

        def __getattr__(self, name: str) -> NoReturn:
            if name.startswith("_"):
                raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")
            if hasattr(type(self), name):
                # A property of that name failed with an AttributeError of its own, which is the one to show.
                object.__getattribute__(self, name)
            raise NoSuchAttribute(f"{_named(self)} has no attribute {name!r}{_similar(name, self)}")

    def _refuse(self, name: str) -> NoReturn:
        hint = "" if name in _public(self) else f" It has no attribute {name!r}{_similar(name, self)}."
        raise ModegraphError(
            f"{_named(self)} cannot be changed after it was made: what is proved about it would be about something "
            f"else.{hint} Instead of setting {name}, {self._remedy}"
        )


class Replaceable(Immutable):
    """An immutable object that keeps what its constructor was given under the same names."""

    _remedy = "use .replace(name=value): another one, with everything else the same"

    def replace(self, **changes: Any) -> Self:
        """Another one with these constructor arguments instead; everything else stays the same.

        Raises
        ------
        ModegraphError
            If there is no such argument, or the constructor refuses a value.
        """
        known = list(inspect.signature(type(self)).parameters)
        for name in changes:
            if name not in known:
                raise ModegraphError(
                    f"{_named(self)}: replace has no argument {name!r}{_near(name, known)}; it takes {', '.join(known)}"
                )
        return type(self)(**{name: getattr(self, name) for name in known} | changes)


def _closing(init: Callable[..., None]) -> Callable[..., None]:
    """The constructor, after which nothing can be set: that of a subclass closes, not the one it calls."""

    @functools.wraps(init)
    def construct(self: Immutable, *args: Any, **kwargs: Any) -> None:
        init(self, *args, **kwargs)
        if type(self).__init__ is construct:
            self.__dict__[_BUILT] = True

    return construct


def _named(instance: Immutable) -> str:
    kind, name = type(instance).__name__, instance.__dict__.get("name")
    return f"{kind} {name!r}" if isinstance(name, str) else f"this {kind}"


def _public(instance: Immutable) -> list[str]:
    return [name for name in dir(instance) if not name.startswith("_")]


def _similar(name: str, instance: Immutable) -> str:
    return _near(name, _public(instance))


def _near(name: str, known: list[str]) -> str:
    found = difflib.get_close_matches(name, known, n=1)
    return f"; did you mean {found[0]!r}?" if found else ""
