"""How near the starts come to a target, said in the target's own faces and units."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from modegraph.certify.switching.base import Nearest
from modegraph.certify.targets.region import Region
from modegraph.certify.verdict import Approach, Floats
from modegraph.model.sets import Ball, Ellipsoid, Sublevel

OWN_SIZE = "times its size"
"""The unit of distances from an ellipsoid."""


def approach_of(nearest: Nearest | None, region: Region, names: Sequence[str]) -> Approach | None:
    """What the nearest set of the worst part says of a target over the states ``names``; None where it is unbounded."""
    if nearest is None or not np.isfinite(nearest.gauge):
        return None
    face, missing = region.binding(nearest.set.project(region.dim))
    if not np.isfinite(missing):
        return None
    words, unit, scale = face_in_words(region, face, names)
    return Approach(nearest.time, nearest.gauge, words, missing * scale, unit, _farthest(nearest, region, names))


def _farthest(nearest: Nearest, region: Region, names: Sequence[str]) -> str:
    """In which state a set is farthest from the centre of a round target."""
    target, n = region.set, region.dim
    if not isinstance(target, Ball | Ellipsoid):
        return ""
    lo, hi = nearest.set.project(n).ranges()
    c = np.asarray(target.c, float)
    out = np.maximum(hi - c, c - lo)
    allowed = np.full(n, target.radius) if isinstance(target, Ball) else np.sqrt(np.diag(np.asarray(target.shape)))
    k = int(np.argmax(out / np.maximum(allowed, 1e-300)))
    return f"{names[k]} up to {out[k]:.4g} from its centre, where {allowed[k]:.4g} is allowed"


def face_in_words(region: Region, face: int, names: Sequence[str]) -> tuple[str, str, float]:
    """A face of a region, the unit of its distances, and what to multiply those of ``binding`` by.

    A face across one state is told, and measured, in that state.
    """
    target = region.set
    if face >= 0:
        row, bound = region.A[face], float(region.b[face])
        used = np.flatnonzero(row)
        if len(used) == 1:
            k = int(used[0])
            a, name = float(row[k]), names[k]
            return f"{name} {'<=' if a > 0.0 else '>='} {bound / a + 0.0:.6g}", name, 1.0 / abs(a)
        combination = _sum([(float(row[k]), names[k]) for k in used.tolist()])
        return f"{combination} <= {bound:.6g}", combination, 1.0
    if isinstance(target, Sublevel):
        return f"fn <= {target.level:.6g}", "fn", 1.0
    where = _point(np.asarray(target.center, float))
    if isinstance(target, Ball):
        return f"the ball of radius {target.radius:.6g} around {where}", "distance", float(target.radius)
    assert isinstance(target, Ellipsoid)
    return f"the ellipsoid around {where}", OWN_SIZE, 1.0


def _sum(terms: Sequence[tuple[float, str]]) -> str:
    text = ""
    for a, name in terms:
        sign = ("-" if a < 0.0 else "") if not text else (" - " if a < 0.0 else " + ")
        text += sign + (name if abs(a) == 1.0 else f"{abs(a):.4g} {name}")
    return text


def _point(x: Floats) -> str:
    return "(" + ", ".join(f"{v:.4g}" for v in x) + ")"
