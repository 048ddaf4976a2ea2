"""Names as users give them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from modegraph.errors import ModegraphError
from modegraph.model.names import names_of, require_callable, require_name


@pytest.mark.parametrize(
    ("given", "names"),
    [
        ("q1 q2", ("q1", "q2")), ("q1, q2", ("q1", "q2")), (["q 1", "q2"], ("q 1", "q2")), (2, ("x[0]", "x[1]")),
        (np.int64(1), ("x[0]",)), (0, ()), ((), ()), ("", ()),
    ],
)  # fmt: skip
def test_counts_strings_and_lists(given: Any, names: tuple[str, ...]) -> None:
    assert names_of(given, "x", "System: states") == names


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (True, "must be names or a count, got True"),
        (-1, "a count >= 0"),
        (2.5, "a list of names, one spaced string or a count, got 2.5"),
        ("q q", "'q' appears twice"),
        (["q", 3], "a name must be a non-empty string, got 3"),
        (["q "], "must not begin or end with a blank"),
    ],
)
def test_mistakes_are_named(given: Any, message: str) -> None:
    with pytest.raises(ModegraphError, match=f"^System: states.*{message}"):
        names_of(given, "x", "System: states")


def test_names_and_functions() -> None:
    assert require_name("arm", "Mode: name") == "arm"
    with pytest.raises(ModegraphError, match="Mode: name must be a non-empty string"):
        require_name("  ", "Mode: name")
    require_callable(len, "Mode: controller")
    with pytest.raises(ModegraphError, match="Mode: controller must be a function, got float"):
        require_callable(1.0, "Mode: controller")
