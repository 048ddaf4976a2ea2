"""What several tails say together is what the weakest of them says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from modegraph.reach.tail.base import Tail

ONE = Tail(1.0, np.array([-0.5, -0.1]), np.array([0.2]), np.array([-1.0, 0.0]), np.array([1.0, np.inf]), 2.0)
OTHER = Tail(3.0, np.array([-0.2, -0.3]), np.array([0.1]), np.array([-0.5, -np.inf]), np.array([2.0, 1.0]), 0.5)


def test_together_the_last_start_and_the_widest_box_count() -> None:
    both = Tail.together([ONE, OTHER])
    assert (both.start, both.decay) == (3.0, 0.5)
    assert both.face_upper.tolist() == [-0.2, -0.1]
    assert both.tracking.tolist() == [0.2]
    assert both.lo.tolist() == [-1.0, -np.inf]
    assert both.hi.tolist() == [2.0, np.inf]


@pytest.mark.parametrize("worst, legal", [(0.0, True), (1e-300, False), (np.nan, False), (np.inf, False)])
def test_a_tail_is_legal_where_every_face_is_proved(worst: float, legal: bool) -> None:
    assert replace(ONE, face_upper=np.array([-1.0, worst])).is_legal is legal
