"""Ellipsoids that shrink along every given Jacobian, proposed by a semidefinite program (floats)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

LEAST = 1e-7
"""Multiples of the weight below this are none."""


def shrinking_ellipsoid(
    slopes: Floats, push: Floats, alpha: float, level: float, points: Floats, inside: Floats | None, weight: Floats
) -> Floats | None:
    """P (n, n) with V = y'Py <= 1 at the points, and V' <= -alpha (V - level) along every slope.

    Parameters
    ----------
    slopes : (K, n, n) Jacobians
    push : (k, n) columns of the zonotope that acts from outside
    alpha : 1/s
    level : below 1, the level that is kept
    points : (M, n)
    inside : (n, n) or None: the ellipsoid y' inside y <= 1 must lie in the new one
    weight : (n, n): the largest l with P >= l weight is sought

    None where there is none.
    """
    import clarabel
    from scipy import sparse

    n, k = slopes.shape[1], len(push)
    rows, columns = np.triu_indices(n)
    entries = len(rows)
    count = entries + k + 1
    basis = np.zeros((entries, n, n))
    basis[np.arange(entries), rows, columns] = 1.0
    basis[np.arange(entries), columns, rows] = 1.0
    blocks: list[Floats] = []
    constants: list[Floats] = []
    cones: list[object] = []

    def semidefinite(matrices: Floats, constant: Floats) -> None:
        """constant + sum_i x_i matrices_i is positive semidefinite."""
        size = matrices.shape[1]
        c, r = np.tril_indices(size)
        scale = np.where(r == c, 1.0, np.sqrt(2.0))
        blocks.append(-(matrices[:, r, c] * scale).T)
        constants.append(constant[r, c] * scale)
        cones.append(clarabel.PSDTriangleConeT(size))

    linear = np.zeros((len(points) + k + 1, count))
    bound = np.zeros(len(points) + k + 1)
    linear[: len(points), :entries] = np.einsum("eij,mi,mj->me", basis, points, points)
    bound[: len(points)] = 1.0
    linear[len(points) : len(points) + k, entries : entries + k] = -np.eye(k)
    linear[-1, entries : entries + k] = 1.0
    bound[-1] = alpha * level
    blocks.append(linear)
    constants.append(bound)
    cones.append(clarabel.NonnegativeConeT(len(bound)))
    for J in slopes:
        M = np.zeros((count, n + k, n + k))
        PJ = basis @ J
        M[:entries, :n, :n] = -(PJ + np.swapaxes(PJ, 1, 2) + alpha * basis)
        M[:entries, :n, n:] = -basis @ push.T
        M[:entries, n:, :n] = -push @ basis
        for j in range(k):
            M[entries + j, n + j, n + j] = 1.0
        semidefinite(M, np.zeros((n + k, n + k)))
    M = np.zeros((count, n, n))
    M[:entries] = basis
    M[-1] = -weight
    semidefinite(M, np.zeros((n, n)))
    if inside is not None:
        M = np.zeros((count, n, n))
        M[:entries] = -basis
        semidefinite(M, inside)
    q = np.zeros(count)
    q[-1] = -1.0
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    A = sparse.csc_matrix(np.vstack(blocks))
    solution = clarabel.DefaultSolver(
        sparse.csc_matrix((count, count)), q, A, np.concatenate(constants), cones, settings
    ).solve()
    if solution.status not in (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved):
        return None
    x = np.array(solution.x)
    if not x[-1] > LEAST:
        return None
    P = np.tensordot(x[:entries], basis, axes=1)
    return P if np.isfinite(P).all() and np.linalg.eigvalsh(P).min() > 0.0 else None
