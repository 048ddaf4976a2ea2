"""A settled loop in double precision: where it rests and how it moves there. Proposals; nothing here is proved."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from modegraph.expression.evaluate import Evaluator
from modegraph.reach.field import Field

Floats = NDArray[np.float64]

NEWTON_STEPS = 12


class FloatLoop:
    """x' = f(x, w, d) of one field that no longer depends on time.

    Parameters
    ----------
    fld : Field
    w_centre, w_radius : (q,) the disturbance set
    unknown_lo, unknown_hi : (d,) the unknown constants
    """

    def __init__(self, fld: Field, w_centre: Floats, w_radius: Floats, unknown_lo: Floats, unknown_hi: Floats) -> None:
        self.fld = fld
        self._middle = np.concatenate([w_centre, 0.5 * (unknown_lo + unknown_hi)])
        self._radius = np.concatenate([w_radius, 0.5 * (unknown_hi - unknown_lo)])
        self._rates = Evaluator(fld.rates)
        self._slopes = Evaluator(fld.jacobian)

    def _inputs(self, x: Floats, extreme: bool) -> Floats:
        """Tape variables (nv, K) at points x (K, n); disturbance and unknowns central, or at random corners."""
        fld = self.fld
        rng = np.random.default_rng(3)
        out = np.zeros((fld.variables, len(x)))
        out[: fld.states] = x.T
        out[fld.time_index] = fld.start
        sign = np.sign(rng.uniform(-1.0, 1.0, (len(self._radius), len(x)))) * extreme
        out[fld.first_w :] = self._middle[:, None] + self._radius[:, None] * sign
        return out

    def jacobian(self, x: Floats) -> Floats:
        """df/dx (n, n) at one point (n,), for the central disturbance and unknowns."""
        n = self.fld.states
        return np.asarray(self._slopes(self._inputs(x[None], False))[: n * n, 0].reshape(n, n))

    def jacobians(self, x: Floats) -> Floats:
        """df/dx at points (K, n) with disturbance and unknowns at random corners; those that are finite."""
        n = self.fld.states
        J = self._slopes(self._inputs(x, True))[: n * n].T.reshape(-1, n, n)
        return np.asarray(J[np.isfinite(J).all(axis=(1, 2))])

    def disturbance_matrix(self, x: Floats) -> Floats:
        """df/dw (n, q) at one point (n,)."""
        n, q = self.fld.states, self.fld.disturbances
        return np.asarray(self._slopes(self._inputs(x[None], False))[n * n : n * (n + q), 0].reshape(n, q))

    def equilibrium(self, x: Floats, states: Sequence[int]) -> Floats | None:
        """Newton's method from x (n,) in some of the states, the others fixed; None where it breaks down."""
        keep = list(states)
        x = x.copy()
        for _ in range(NEWTON_STEPS):
            rate = self._rates(self._inputs(x[None], False))[keep, 0]
            slope = self.jacobian(x)[np.ix_(keep, keep)]
            if not (np.isfinite(rate).all() and np.isfinite(slope).all()):
                return None
            step = np.linalg.lstsq(slope, -rate, rcond=1e-12)[0]
            x[keep] += step
            if np.abs(step).max(initial=0.0) < 1e-13 * (1.0 + np.abs(x).max(initial=0.0)):
                break
        return x if np.isfinite(x).all() else None
