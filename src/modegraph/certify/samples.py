"""Sampled starts of a piece: guesses where to cut, never proofs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..model.sets import Sublevel
from ..reach.start import Piece

Floats = NDArray[np.float64]

SAMPLES = 48


def sample_variables(piece: Piece) -> Floats:
    """Some starts of a piece, (SAMPLES, m) in its scaled variables; half of them extreme."""
    rng = np.random.default_rng(7)
    eta = rng.uniform(-1.0, 1.0, (SAMPLES, piece.variables))
    eta[: SAMPLES // 2] = np.sign(eta[: SAMPLES // 2])
    if piece.chart.round:
        f = piece.chart.free
        xi = piece.middle[:f] + piece.radius[:f] * eta[:, :f]
        length = np.sqrt((xi**2).sum(axis=1))
        xi = xi / np.maximum(length, 1.0)[:, None]
        eta[:, :f] = np.clip((xi - piece.middle[:f]) / np.maximum(piece.radius[:f], 1e-300), -1.0, 1.0)
    if piece.chart.sublevel is not None:
        _move_inside(piece, piece.chart.sublevel, eta)
    return eta


def _move_inside(piece: Piece, start: Sublevel, eta: Floats) -> None:
    """Replace samples by points of the set, where any are found; by the middle of the piece else."""
    chart, f = piece.chart, piece.chart.free
    axis = chart.axes.argmax(axis=0)
    points = start.draw_within(len(eta), np.random.default_rng(7), *chart.box(piece.lo[:f], piece.hi[:f]))
    xi = (points[:, axis] - chart.centre[axis]) / chart.axes.sum(axis=0)
    eta[:, :f] = 0.0
    eta[: len(xi), :f] = np.clip((xi - piece.middle[:f]) / np.maximum(piece.radius[:f], 1e-300), -1.0, 1.0)


def sample_powers(piece: Piece, exponents: NDArray[np.int64]) -> Floats:
    """Values (SAMPLES, N) of all monomials at the sampled starts."""
    return powers_at(sample_variables(piece), exponents)


def powers_at(eta: Floats, exponents: NDArray[np.int64]) -> Floats:
    """Values (S, N) of all monomials at scaled variables (S, m)."""
    powers = np.ones((len(eta), len(exponents)))
    for v in range(eta.shape[1]):
        powers *= eta[:, [v]] ** exponents[:, v]
    return powers
