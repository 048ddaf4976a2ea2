"""The errors a user meets."""

from __future__ import annotations

import pytest

from modegraph.errors import ModegraphError, NotBuiltYet, Unreachable


def test_every_error_is_of_one_kind() -> None:
    assert issubclass(NotBuiltYet, ModegraphError)
    assert issubclass(Unreachable, ModegraphError)
    assert not issubclass(ModegraphError, ValueError)


def test_unreachable_tells_what_is_known() -> None:
    error = Unreachable("no way", reachable=iter(["a", "b"]), helpful=iter([("a", "c")]))
    assert (str(error), error.reachable, error.helpful) == ("no way", ("a", "b"), (("a", "c"),))
    with pytest.raises(ModegraphError, match=r"^no way$"):
        raise Unreachable("no way")
