"""Sampled starts of a piece: guesses where to cut, never proofs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from modegraph.reach.reach_set import ReachSets
from modegraph.reach.start.piece import Piece

Floats = NDArray[np.float64]

SAMPLES = 48


def sample_variables(piece: Piece) -> Floats:
    """Some starts of a piece, (SAMPLES, m) in its scaled variables; half of them extreme.

    Of a Sublevel those that were found, in turn; the middle of a piece where none is `known`.
    """
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
        found = piece.points if piece.known else np.zeros((1, piece.chart.free))
        eta[:, : piece.chart.free] = found[np.arange(SAMPLES) % len(found)]
    return eta


def points_of(sets: ReachSets, eta: Floats) -> Floats:
    """Points (K, S, n) of the polynomial parts at scaled variables (S, m)."""
    return np.asarray(np.einsum("kin,sn->ksi", sets.p, powers_at(eta, sets.bounds.exponents)))


def sample_powers(piece: Piece, exponents: NDArray[np.int64]) -> Floats:
    """Values (SAMPLES, N) of all monomials at the sampled starts."""
    return powers_at(sample_variables(piece), exponents)


def powers_at(eta: Floats, exponents: NDArray[np.int64]) -> Floats:
    """Values (S, N) of all monomials at scaled variables (S, m)."""
    powers = np.ones((len(eta), len(exponents)))
    for v in range(eta.shape[1]):
        powers *= eta[:, [v]] ** exponents[:, v]
    return powers
