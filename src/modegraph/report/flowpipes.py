"""Matplotlib drawings of flowpipes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from modegraph.errors import ModegraphError

if TYPE_CHECKING:
    from modegraph.model.sets import Set
    from modegraph.reach.flowpipe import Flowpipe


def draw_flowpipe(
    pipe: Flowpipe,
    ax: Any = None,
    dims: tuple[int, ...] | None = None,
    sections: Sequence[float] | None = None,
    target: Set | None = None,
) -> Any:
    """The flowpipe and a target: states over time, or with two ``dims`` the phase plane; returns the axes."""
    times, parts = pipe.tubes() if len(pipe.times) > 1 else (pipe.times, [])
    if not parts:
        raise ModegraphError(f"there is no flowpipe to draw: {pipe.reason}")
    if ax is None:
        import matplotlib.pyplot as plt

        _, ax = plt.subplots(figsize=(6.4, 4.8), constrained_layout=True)
    if dims is not None and len(dims) == 2:
        _sections(pipe, ax, dims, sections) if sections is not None else _phase_plane(pipe, ax, parts, dims)
        if target is not None:
            target.plot(ax, dims=(dims[0], dims[1]), edgecolor="black", linestyle="--", linewidth=1.5)
        return ax
    if sections is not None:
        raise ModegraphError("flowpipe.plot: sections are drawn in the plane of two states; give dims=")
    lo = np.full((len(times) - 1, len(pipe.states)), np.inf)
    hi = -lo
    for rows, below, above in parts:
        lo[rows], hi[rows] = np.minimum(lo[rows], below), np.maximum(hi[rows], above)
    for k in range(len(pipe.states)) if dims is None else dims:
        ax.stairs(hi[:, k], times, baseline=lo[:, k], fill=True, alpha=0.6, color=f"C{k % 10}", label=pipe.states[k])
    if target is not None:
        below, above = target.bounding_box()
        for k in range(min(target.dim, len(pipe.states))) if dims is None else dims:
            ax.hlines([below[k], above[k]], times[0], times[-1], color=f"C{k % 10}", linestyle="--", linewidth=1.0)
    ax.set_xlabel("time")
    if dims is None:
        ax.legend(loc="best", fontsize=8)
    else:
        ax.set_ylabel(pipe.states[dims[0]])
    return ax


def _sections(pipe: Flowpipe, ax: Any, dims: tuple[int, ...], times: Sequence[float]) -> None:
    """Outlines at a few instants, the later the darker."""
    from matplotlib import colormaps
    from matplotlib.patches import Polygon

    for k, t in enumerate(times):
        instant, polygons = pipe.sections(t, dims)
        colour = colormaps["viridis_r"](0.15 + 0.85 * k / max(1, len(times) - 1))
        for part, polygon in enumerate(polygons):
            label = f"t = {instant:.3g}" if part == 0 else None
            ax.add_patch(Polygon(polygon, closed=True, facecolor=(*colour[:3], 0.25), edgecolor=colour, label=label))
    ax.autoscale_view()
    ax.set_xlabel(pipe.states[dims[0]])
    ax.set_ylabel(pipe.states[dims[1]])
    ax.legend(loc="best", fontsize=8)


def _phase_plane(pipe: Flowpipe, ax: Any, parts: list[Any], dims: tuple[int, ...]) -> None:
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Rectangle

    a, b = dims
    boxes = [
        Rectangle((float(lo[a]), float(lo[b])), float(hi[a] - lo[a]), float(hi[b] - lo[b]))
        for _, below, above in parts
        for lo, hi in zip(below, above, strict=True)
    ]
    ax.add_collection(PatchCollection(boxes, facecolor="C0", edgecolor="C0", alpha=0.35, linewidth=0.4))
    ax.autoscale_view()
    ax.set_xlabel(pipe.states[a])
    ax.set_ylabel(pipe.states[b])
