"""Sublevel sets are a later addition and say so."""

import pytest

from modegraph.errors import NotBuiltYet
from modegraph.model.sets import Sublevel


def test_not_built_yet():
    with pytest.raises(NotBuiltYet, match="Sublevel"):
        Sublevel(lambda x: x @ x, 1.0)
