"""How public objects of lower layers get methods of upper ones, without an import from below.

``api.py`` says which method belongs to which class; a class takes those that wait for it when it is made. The
package imports ``api.py`` before all else, so every class finds its methods, whichever module is imported first.
"""

from __future__ import annotations

from typing import Any, TypeVar

Class = TypeVar("Class", bound=type)

METHODS: dict[str, dict[str, Any]] = {}
"""Methods by the name of their class and their own."""


def attach(owner: str, **methods: Any) -> None:
    """Let functions, or class methods made of them, be methods of the class ``owner`` under these names."""
    for name, method in methods.items():
        function = getattr(method, "__func__", method)
        function.__name__, function.__qualname__ = name, f"{owner}.{name}"
    METHODS[owner] = methods


def with_methods(owner: Class) -> Class:
    """A class with the methods that wait for it; a class for which none does has no use for this."""
    for name, method in METHODS[owner.__name__].items():
        setattr(owner, name, method)
    return owner
