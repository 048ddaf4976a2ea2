"""Matplotlib maps of R^ij: for which references a switch is certified, undecided, refuted."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from modegraph.certify.references import match_parameter, parameter_text
from modegraph.errors import ModegraphError
from modegraph.model.sets import Box

if TYPE_CHECKING:
    from modegraph.certify.continuous import ContinuousReferences, Side

FINE = 240
"""Pairs looked at along each axis."""
COLOURS = {1: ("tab:green", "certified"), 0: ("lightgray", "undecided"), -1: ("tab:red", "refuted")}


def draw_references(refs: ContinuousReferences, ax: Any, r_i: Any, r_j: Any, dims: tuple[int, ...] | None) -> Any:
    """A map over one or two parameters; see ``ContinuousReferences.plot``."""
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    sides = refs.sides
    at = [_chosen(side, r, name) for side, r, name in zip(sides, (r_i, r_j), ("r_i", "r_j"), strict=True)]
    axes = _axes(sides, (r_i, r_j), dims)
    if ax is None:
        import matplotlib.pyplot as plt

        _, ax = plt.subplots(figsize=(5.8, 4.8 if len(axes) == 2 else 2.2), constrained_layout=True)
    ends = [(float(_box(sides[s]).lo[k]), float(_box(sides[s]).hi[k])) for s, k in axes]
    grid = np.meshgrid(*(np.linspace(lo, hi, FINE) for lo, hi in ends), indexing="ij")
    references = [np.repeat(p[None], grid[0].size, axis=0) for _, p in at]
    for (s, k), values in zip(axes, grid, strict=True):
        references[s][:, k] = values.ravel()
    status = refs.statuses(references[0], references[1], members=(at[0][0], at[1][0])).reshape(grid[0].shape)
    ax.imshow(
        status.T if len(axes) == 2 else status[None],
        origin="lower",
        extent=(*ends[0], *(ends[1] if len(axes) == 2 else (0.0, 1.0))),
        cmap=ListedColormap([COLOURS[s][0] for s in (-1, 0, 1)]),
        vmin=-1.5,
        vmax=1.5,
        aspect="auto",
        alpha=0.75,
        interpolation="nearest",
    )
    labels = [f"{('r_i', 'r_j')[s]}[{k}]" for s, k in axes]
    ax.set_xlabel(labels[0])
    if len(axes) == 2:
        ax.set_ylabel(labels[1])
    else:
        ax.set_yticks([])
    kept = [
        f"{name} = {parameter_text(p)}"
        for s, (name, (_, p)) in enumerate(zip(("r_i", "r_j"), at, strict=True))
        if len(p) and not any(side == s for side, _ in axes)
    ]
    side = axes[0][0]
    if kept and len(at[0][1]) == len(at[1][1]) and len(axes) == 2:
        # The other's reference, where both are points of one space.
        ax.plot(*at[1 - side][1][[k for _, k in axes]], "k+", markersize=10)
    shown = [s for s in (1, 0, -1) if (status == s).any()]
    ax.legend(handles=[Patch(color=COLOURS[s][0], alpha=0.75, label=COLOURS[s][1]) for s in shown], fontsize=8)
    ax.set_title(", ".join(kept), fontsize=9)
    return ax


def _box(side: Side) -> Box:
    assert isinstance(side, Box)
    return side


def _chosen(side: Side, r: Any, name: str) -> tuple[int, Any]:
    """Member of a finite class and parameters: as given, or the middle of a continuous class."""
    if not isinstance(side, Box):
        index = match_parameter(side, r) if r is not None else 0
        if index is None:
            raise ModegraphError(f"plot: {name} = {r!r} is not in that finite class")
        return index, np.zeros(0)
    p = np.array(side.center if r is None else r, dtype=float).reshape(-1)
    if p.shape != (side.dim,) or not side.contains(p):
        raise ModegraphError(f"plot: {name} = {r!r} is not in the class {side}")
    return 0, p


def _axes(sides: tuple[Side, Side], given: tuple[Any, Any], dims: tuple[int, ...] | None) -> list[tuple[int, int]]:
    """(side, parameter) drawn along x and y."""
    free = [s for s in (0, 1) if isinstance(sides[s], Box)]
    if not free:
        raise ModegraphError("plot: both classes are finite; iterate over their pairs")
    if len(free) == 2 and all(r is None for r in given) and dims is None and all(_box(s).dim == 1 for s in sides):
        return [(0, 0), (1, 0)]
    side = free[0] if len(free) == 1 or given[1] is not None else 1
    size = _box(sides[side]).dim
    chosen = tuple(range(min(2, size))) if dims is None else tuple(dims)
    if len(chosen) not in (1, 2) or any(not 0 <= k < size for k in chosen):
        raise ModegraphError(f"plot: dims={dims!r} must be one or two parameters out of 0..{size - 1}")
    return [(side, k) for k in chosen]
