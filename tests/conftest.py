"""What several folders of tests share."""

from __future__ import annotations

from typing import Any

import pytest

from tests.soundness.examples import build, load


@pytest.fixture(scope="session")
def quadrotor() -> Any:
    """The graph of examples/quadrotor.py: it takes longer to build than all else here."""
    return build(load("quadrotor"))
