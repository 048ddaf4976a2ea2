"""A tail keeps the constraints only where each of their faces is proved."""

from __future__ import annotations

import numpy as np
import pytest

from modegraph.reach.tail.base import Tail


@pytest.mark.parametrize("upper, legal", [([], True), ([0.0, -1.0], True), ([0.0, 1e-300], False), ([np.nan], False)])
def test_every_face_counts(upper: list[float], legal: bool) -> None:
    tail = Tail(1.0, np.array(upper), np.zeros(0), np.array([-1.0]), np.array([1.0]), 1.0)
    assert tail.is_legal == legal
