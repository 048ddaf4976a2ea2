"""Matplotlib drawings of flowpipes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from modegraph.errors import ModegraphError

if TYPE_CHECKING:
    from modegraph.reach.flowpipe import Flowpipe


def plot_flowpipe(pipe: Flowpipe, ax: Any = None, dims: tuple[int, ...] | None = None) -> Any:
    """Boxes of the flowpipe: states over time, or with two ``dims`` the phase plane; returns the axes."""
    times, parts = pipe.tubes() if len(pipe.times) > 1 else (pipe.times, [])
    if not parts:
        raise ModegraphError(f"there is no flowpipe to draw: {pipe.reason}")
    if ax is None:
        import matplotlib.pyplot as plt

        _, ax = plt.subplots(figsize=(6.4, 4.8), constrained_layout=True)
    if dims is not None and len(dims) == 2:
        return _phase_plane(pipe, ax, parts, dims)
    lo = np.full((len(times) - 1, len(pipe.states)), np.inf)
    hi = -lo
    for rows, below, above in parts:
        lo[rows], hi[rows] = np.minimum(lo[rows], below), np.maximum(hi[rows], above)
    for k in range(len(pipe.states)) if dims is None else dims:
        ax.stairs(hi[:, k], times, baseline=lo[:, k], fill=True, alpha=0.6, color=f"C{k % 10}", label=pipe.states[k])
    ax.set_xlabel("time")
    if dims is None:
        ax.legend(loc="best", fontsize=8)
    else:
        ax.set_ylabel(pipe.states[dims[0]])
    return ax


def _phase_plane(pipe: Flowpipe, ax: Any, parts: list[Any], dims: tuple[int, ...]) -> Any:
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
    return ax
