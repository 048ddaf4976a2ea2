"""An approximate inverse and a bound of how far it is from one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from modegraph.enclosure.rounding import UNIT

Floats = NDArray[np.float64]


def near_inverse(axes: Floats) -> tuple[Floats, float] | None:
    """N (n, n) near A^-1 and an upper bound of |N A - I| in the infinity norm; None where A is singular.

    With R = N A - I, A^-1 = (I + R)^-1 N: any norm of A^-1 y is within 1 / (1 - |R|) of that of N y.
    """
    n = len(axes)
    try:
        N = np.asarray(np.linalg.inv(axes), float)
    except np.linalg.LinAlgError:
        return None
    miss = np.abs(N @ axes - np.eye(n)) + 2.0 * (n + 2) * UNIT * (np.abs(N) @ np.abs(axes))
    return N, float(miss.sum(axis=1).max()) * (1.0 + 8.0 * n * UNIT)
