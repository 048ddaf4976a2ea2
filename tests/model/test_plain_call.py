"""Calling functions with plain numbers."""

import pytest

from modegraph.errors import ModegraphError
from modegraph.model.plain_call import call_numeric


def test_injection_by_name():
    available = {"x": 1.0, "r": 2.0}
    assert call_numeric(lambda r, x, k=3.0: (r, x, k), available, role="f", owner="m") == (2.0, 1.0, 3.0)
    with pytest.raises(ModegraphError, match="m, f reads an unknown argument 'y'; it may read x, r"):
        call_numeric(lambda y: y, available, role="f", owner="m")
    with pytest.raises(ModegraphError, match="m, f: KeyError"):
        call_numeric(lambda x: {}["a"], available, role="f", owner="m")
