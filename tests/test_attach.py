"""Methods that wait for their class."""

from __future__ import annotations

import pytest

from modegraph import attach


def test_a_class_takes_the_methods_that_wait_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(attach, "METHODS", {})

    def how_large(self: object) -> int:
        """How large it is."""
        return 3

    def made(cls: type) -> object:
        """One of them."""
        return cls()

    attach.attach("Thing", size=how_large, make=classmethod(made))

    class Thing:
        pass

    class Larger(attach.with_methods(Thing)):  # type: ignore[misc]
        pass

    assert Thing().size() == 3  # type: ignore[attr-defined]
    assert isinstance(Larger.make(), Larger)
    assert Thing.size.__qualname__ == "Thing.size"  # type: ignore[attr-defined]
    assert Thing.make.__name__ == "make"  # type: ignore[attr-defined]
    assert Thing.size.__doc__ == "How large it is."  # type: ignore[attr-defined]


def test_a_class_that_nothing_waits_for_is_a_mistake() -> None:
    with pytest.raises(KeyError, match="Nothing"):
        attach.with_methods(type("Nothing", (), {}))
