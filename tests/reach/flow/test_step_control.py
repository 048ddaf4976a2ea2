"""Steps of a class of references are short where the remainder would feed itself."""

from __future__ import annotations

import numpy as np

from modegraph.reach.compiled import compile_mode
from modegraph.reach.flow.step_control import (
    LEAST_ROOM,
    LEAST_TIME_DEGREE,
    LONGER,
    MOST_TIME_DEGREE,
    ROOM,
    SLOW_RATE,
    error_guess,
    feeding_cap,
    time_degree,
)
from modegraph.reach.start.piece import Chart, Piece
from tests.soundness.families import pendulum


def outcome(rest: float, rate: float, share: float = 0.9) -> tuple[object, ...]:
    G = np.full((1, 2, 1), 1e-3)
    control = np.array([0.0, 0.0, 0.0, rate, share])
    return 0, 0, None, G, None, None, np.full(2, rest), control


def test_only_a_remainder_that_feeds_itself_shortens_steps() -> None:
    piece = compile_mode(pendulum().mode, None).whole()
    assert feeding_cap(piece, outcome(1e-3, 1.0, share=0.1)) == LONGER
    assert feeding_cap(piece, outcome(1e-9, 1.0)) > LONGER
    assert SLOW_RATE <= feeding_cap(piece, outcome(1e-3, 1.0)) < 0.5
    assert feeding_cap(piece, outcome(1e-3, 0.5 * SLOW_RATE)) == LONGER


def test_one_reference_keeps_its_steps() -> None:
    nothing = np.zeros(0)
    alone = Piece.whole(Chart(np.zeros(2), np.eye(2), False, None, nothing, nothing))
    assert feeding_cap(alone, outcome(1e-3, 1.0)) == LONGER


def test_the_degree_in_time_falls_only_where_a_lower_one_is_still_accurate() -> None:
    """One degree less costs about (degree + 1) / hA: 8 to 7 at hA = 0.3 some thirty times."""
    assert time_degree(8, 1e-4, 0.3) == 7
    assert time_degree(8, 1e-2, 0.3) == 8
    assert time_degree(8, 1e-4, 0.01) == 8
    assert time_degree(LEAST_TIME_DEGREE, 0.0, 0.3) == LEAST_TIME_DEGREE


def test_the_degree_in_time_rises_where_the_error_is_seen() -> None:
    assert time_degree(5, 0.5, 0.3) == 6
    assert time_degree(MOST_TIME_DEGREE, 0.5, 0.3) == MOST_TIME_DEGREE


def test_the_error_is_guessed_closely_where_it_grows_evenly() -> None:
    remainder, grown = np.array([1.0, 2.0]), np.array([1.05, 1.02])
    rest = np.array([0.1, 0.1])
    tube, narrow, room = error_guess(np.array([1.04, 2.03]), rest, remainder, grown, 1.0)
    # More than what grows as before, and less than a fifth more.
    assert (tube > remainder * grown).all()
    assert (tube < 1.1 * remainder).all()
    assert (narrow > rest).all()
    assert room == LEAST_ROOM
    # A longer step lets it grow more.
    longer, _, _ = error_guess(np.array([1.04, 2.03]), rest, remainder, grown, 1.6)
    assert (longer > remainder * (1.0 + 1.6 * (grown - 1.0))).all()


def test_nothing_is_foreseen_where_the_error_has_just_begun() -> None:
    tube = np.array([1e-3, 1e-3])
    for growth in (np.array([1e6, 1e6]), np.array([np.inf, np.nan])):
        assert (error_guess(tube, tube, 0.5 * tube, growth, 1.0)[0] == ROOM * tube).all()
    wide, _, room = error_guess(tube, tube, tube, None, 1.0)
    assert (wide == ROOM * tube).all()
    assert room == ROOM
