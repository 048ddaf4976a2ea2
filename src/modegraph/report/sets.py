"""Matplotlib drawings of sets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from modegraph.errors import ModegraphError
from modegraph.model.sets import Set, Sublevel

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FINE = 121
"""Points along each axis where a Sublevel is evaluated."""
ABOVE_ALL = 1e300
"""Where fn is not defined, or overflows, for the contour."""


def draw_set(region: Set, ax: Axes | None, dims: tuple[int, int], style: dict[str, Any]) -> Axes:
    """The projection onto two coordinates, a slice of a Sublevel, an interval; see ``Set.plot``."""
    import matplotlib.pyplot as plt
    from matplotlib.patches import Polygon

    line = region.dim == 1 and (region.is_bounded() or not isinstance(region, Sublevel))
    if not line and (len(dims) != 2 or any(not 0 <= k < region.dim for k in dims)):
        raise ModegraphError(f"plot: dims={dims!r} must be two coordinates out of 0..{region.dim - 1}")
    if ax is None:
        ax = plt.subplots()[1]
    if line:
        (lo,), (hi,) = region.bounding_box()
        ax.plot([lo, hi], [0.0, 0.0], **style)
    elif isinstance(region, Sublevel):
        _draw_slice(region, ax, dims, style)
    else:
        ax.add_patch(Polygon(region.outline(dims), closed=True, **{"fill": False, **style}))
        ax.autoscale_view()
    return ax


def _draw_slice(region: Sublevel, ax: Axes, dims: tuple[int, int], style: dict[str, Any]) -> None:
    centre = region.center
    around = centre - 1.0 - np.abs(centre), centre + 1.0 + np.abs(centre)
    lo, hi = region.bounding_box() if region.is_bounded() else around
    pad = 0.05 * (hi - lo) + 1e-12
    across, up = (np.linspace(lo[k] - pad[k], hi[k] + pad[k], FINE) for k in dims)
    grid = np.tile(centre, (len(across) * len(up), 1))
    grid[:, dims[0]] = np.tile(across, len(up))
    grid[:, dims[1]] = np.repeat(up, len(across))
    values = np.minimum(region.function.values(grid), ABOVE_ALL).reshape(len(up), len(across))
    colour = style.get("edgecolor", style.get("color", style.get("colors")))
    drawing = {key: style[key] for key in ("alpha", "linewidths", "linestyles", "zorder") if key in style}
    ax.contour(across, up, values, levels=[region.level], colors="C0" if colour is None else [colour], **drawing)
    if style.get("label") is not None:
        ax.plot([], [], color="C0" if colour is None else colour, label=style["label"])
