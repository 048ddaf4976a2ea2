"""Matplotlib drawings of graphs, plans and runs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from modegraph.certify.references import parameter_text
from modegraph.errors import ModegraphError

if TYPE_CHECKING:
    from modegraph.graph.modegraph import ModeGraph
    from modegraph.plan.plan import Plan
    from modegraph.run.simulate import Run


def draw_graph(graph: ModeGraph, ax: Any = None) -> Any:
    """Modes on a circle, an arrow for every certified switch; zero-time switches dashed."""
    ax = _axes(ax, (6.0, 6.0))
    names = list(graph.modes)
    place = {
        name: np.array([math.sin(2 * math.pi * k / len(names)), math.cos(2 * math.pi * k / len(names))])
        for k, name in enumerate(names)
    }
    for switch in graph.switches:
        style = "dashed" if switch.time[1] == 0 else "solid"
        if switch.source == switch.target:
            x, y = place[switch.source] * 1.17
            ax.text(x, y, "\u21ba", ha="center", va="center", fontsize=16, color="tab:blue")
            continue
        ax.annotate(
            "",
            xy=place[switch.target],
            xytext=place[switch.source],
            arrowprops={
                "arrowstyle": "-|>",
                "color": "tab:blue" if style == "solid" else "tab:gray",
                "linestyle": style,
                "shrinkA": 17,
                "shrinkB": 17,
                "connectionstyle": "arc3,rad=0.12",
            },
        )
    for name, (x, y) in place.items():
        ax.plot([x], [y], "o", markersize=30, color="white", markeredgecolor="black", zorder=3)
        ax.text(x, y, name, ha="center", va="center", zorder=4)
    ax.set_xlim(-1.35, 1.35)
    ax.set_ylim(-1.35, 1.35)
    ax.set_aspect("equal")
    ax.axis("off")
    return ax


def draw_plan(plan: Plan, ax: Any = None) -> Any:
    """For each mode, from when at the earliest to when at the latest it is entered and left."""
    ax = _axes(ax, (7.0, 0.6 + 0.5 * len(plan.modes)))
    earliest = latest = 0.0
    labels = []
    for row, (name, reference) in enumerate(zip(plan.modes, plan.references, strict=True)):
        labels.append(name if not plan.graph.has_choice(name) else f"{name} {parameter_text(reference)}")
        last = row == len(plan.switches)
        leave = (
            (earliest, latest)
            if last
            else tuple(bound + step for bound, step in zip((earliest, latest), plan.switches[row].time, strict=True))
        )
        ax.barh(row, max(leave[1] - earliest, 0.0), left=earliest, height=0.5, color=_colour(row), alpha=0.35)
        ax.plot([earliest, latest], [row, row], color=_colour(row), linewidth=4, solid_capstyle="butt")
        ax.plot([latest], [row], "|", color=_colour(row), markersize=14)
        earliest, latest = leave
    ax.set_yticks(range(len(labels)), labels)
    ax.invert_yaxis()
    ax.set_xlabel("time (thick: when the mode is entered; bar: until it is left at the latest)")
    return ax


def draw_run(run: Run, ax: Any = None) -> Any:
    """States and inputs over time, a coloured band for each mode, switch instants dotted.

    With ``ax`` given, only the states, into it. Returns the axes: one, or an array of two.
    """
    if ax is not None:
        _draw(run, ax, run.x, run.states, legend_modes=True)
        ax.set_xlabel("time")
        return ax
    import matplotlib.pyplot as plt

    _, axes = plt.subplots(2, 1, sharex=True, figsize=(8.0, 6.0), constrained_layout=True)
    _draw(run, axes[0], run.x, run.states, legend_modes=True)
    axes[0].set_ylabel("states")
    _draw(run, axes[1], run.u, run.inputs, legend_modes=False)
    axes[1].set_ylabel("inputs")
    axes[1].set_xlabel("time")
    return axes


def save_plot(axes: Any, path: Any) -> None:
    """Write the figure of ``axes`` to ``path``; the ending chooses the format.

    Raises
    ------
    ModegraphError
        If the format is unknown or the file cannot be written.
    """
    figure = np.ravel(np.asarray(axes, dtype=object))[0].figure
    try:
        figure.savefig(path, dpi=150)
    except (OSError, ValueError) as error:
        raise ModegraphError(f"cannot write the plot to {path}: {error}") from error


def _draw(run: Run, ax: Any, values: Any, names: Any, *, legend_modes: bool) -> None:
    for begin, end, visit, name in _bands(run):
        ax.axvspan(run.t[begin], run.t[end], color=_colour(visit), alpha=0.15, linewidth=0)
        if legend_modes:
            middle = 0.5 * (run.t[begin] + run.t[end])
            ax.text(middle, 1.01, name, transform=ax.get_xaxis_transform(), ha="center", va="bottom", fontsize=8)
    for k, name in enumerate(names):
        ax.plot(run.t, values[:, k], label=name, color=_colour(k))
    for instant in run.switch_times:
        ax.axvline(instant, color="black", linestyle=":", linewidth=0.8)
    if len(names):
        ax.legend(loc="best", fontsize=8)


def _bands(run: Run) -> list[tuple[int, int, int, str]]:
    """First and last sample of each visit of positive length, its number and mode."""
    found = []
    begin = 0
    visit = 0
    for k in range(1, len(run.t) + 1):
        if k == len(run.t) or run.visit[k] != run.visit[begin]:
            if run.t[k - 1] > run.t[begin]:
                found.append((begin, k - 1, visit, run.mode[begin]))
            begin = k
            visit += 1
    return found


def _axes(ax: Any, size: tuple[float, float]) -> Any:
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    _, axes = plt.subplots(figsize=size, constrained_layout=True)
    return axes


def _colour(k: int) -> str:
    return f"C{k % 10}"
