"""The methods of public objects that belong to upper layers, and only here: what a plan is, a graph does not know.

Each function becomes a method of a class, by the table at the end; its docstring is what ``help`` shows there.
Whatever a method needs is imported when it is called: the package imports this file first of all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NoReturn

from modegraph.attach import attach
from modegraph.errors import ModegraphError, NotBuiltYet

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from modegraph.certify.continuous import ContinuousReferences
    from modegraph.explain.explanation import Explanation
    from modegraph.graph.modegraph import ModeGraph
    from modegraph.model.mode import Mode
    from modegraph.model.sets import Set
    from modegraph.model.target import Target
    from modegraph.plan.plan import Plan
    from modegraph.reach.flowpipe import Flowpipe
    from modegraph.run.simulate import Run

# -- sets, flowpipes, references ---------------------------------------------------------------------


def plot_set(self: Set, ax: Axes | None = None, dims: tuple[int, int] = (0, 1), **style: Any) -> Axes:
    """Draw the projection onto two coordinates (an interval when there is one) and return the axes.

    Of a Sublevel, the slice through its point of least fn; where it is unbounded, the part near that point.
    """
    from modegraph.report.sets import draw_set

    return draw_set(self, ax, dims, style)


def plot_flowpipe(
    self: Flowpipe,
    ax: Any = None,
    dims: int | str | Sequence[int | str] | None = None,
    *,
    sections: Sequence[float] | None = None,
    target: Set | None = None,
) -> Any:
    """Draw the boxes of the flowpipe and return the axes.

    Parameters
    ----------
    dims : state number(s) or name(s), optional
        One state: over time. Two: the phase plane. None: all states over time.
    sections : seconds, optional
        In the phase plane: outlines of the reach set at these instants, instead of all boxes.
    target : Set, optional
        To be drawn too: its outline in the phase plane, or its range over time.
    """
    from modegraph.report.flowpipes import draw_flowpipe

    return draw_flowpipe(self, ax, self.state_numbers(dims), sections, target)


def plot_references(
    self: ContinuousReferences, ax: Any = None, *, r_i: Any = None, r_j: Any = None, dims: tuple[int, ...] | None = None
) -> Any:
    """Draw which references are certified, undecided and refuted; returns the axes.

    Two classes of one parameter each are drawn against each other. Otherwise the map is over one or two
    parameters (``dims``) of the target, for the source's reference ``r_i``; or over those of the source,
    where ``r_j`` is given. What is not given is in the middle of its class.
    """
    from modegraph.report.references import draw_references

    return draw_references(self, ax, r_i, r_j, dims)


# -- graphs ------------------------------------------------------------------------------------------


def plan(
    self: ModeGraph,
    start: str | Mode | None = None,
    goal: str | Mode | Target | None = None,
    *,
    minimize: str | Mapping[str, float] = "switches",
    r_start: Any = None,
    r_goal: Any = None,
    x0: Any = None,
    via: Sequence[str | Mode] = (),
    avoid: Sequence[str | Mode | Target] = (),
    max_switches: int | None = None,
) -> Plan:
    """The best chain of certified switches from ``start`` (or from the state ``x0``) to ``goal``.

    Ties are broken by fewer switches, then smaller latest time, then mode order.

    Parameters
    ----------
    start : str or Mode, optional
        The mode that runs at first. Without it, any mode that ``x0`` allows to enter.
    goal : str, Mode or Target
        Where to end. If it is also the start, one mode at no cost, unless ``r_start`` and
        ``r_goal`` differ.
    minimize : {"switches", "time", "energy", "margin"} or mapping
        Worst-case time, worst-case energy, largest bottleneck margin; or non-negative weights
        by "switches", "time", "energy".
    r_start, r_goal : reference, optional
        Fix the reference of the first and the last mode.
    x0 : (n,) array, optional
        The state at the beginning; it must lie in the first mode's start set.
    via : sequence of modes
        To be visited in this order; a mode left in zero time does not count.
    avoid : sequence of modes
        Never entered. (A start mode is not entered: it runs already.)
    max_switches : int, optional

    Raises
    ------
    Unreachable
        If no chain of certified switches does it.
    ModegraphError
        If the question makes no sense.
    """
    return self.plans(
        1,
        start,
        goal,
        minimize=minimize,
        r_start=r_start,
        r_goal=r_goal,
        x0=x0,
        via=via,
        avoid=avoid,
        max_switches=max_switches,
    )[0]


def plans(
    self: ModeGraph, k: int, start: str | Mode | None = None, goal: str | Mode | Target | None = None, **options: Any
) -> list[Plan]:
    """The ``k`` best plans, best first; fewer if there are no more. Options as for ``plan``.

    Two plans differ in their modes or references. None visits the same mode with the same
    reference twice, except where ``via`` makes it.
    """
    from modegraph.plan import planner

    return planner.plans(self, k, start, goal, **options)


def explain(
    self: ModeGraph, i: str | Mode, j: str | Mode | Target, r_i: Any = None, r_j: Any = None, *, seconds: float = 30.0
) -> Explanation:
    """Why there is, or is not, a switch i -> j, and for an absent one which changes were proved to give it.

    Without references it is about the pair that decides the verdict: the certified one with the least
    margin, or the one that comes closest.

    Parameters
    ----------
    seconds : float
        Of work on what the proofs of ``build`` have not shown yet, above all on repairs. What is not
        found by then is left out, and said to be.

    Raises
    ------
    ModegraphError
        As for ``verdict``, or if ``seconds`` is not a number >= 0.
    """
    from modegraph.explain.explain import explained

    source, target = self.name_of(i), self.name_of(j)
    return explained(self, source, target, self.verdict(source, target, r_i, r_j), r_i, r_j, seconds)


def plot_graph(self: ModeGraph, ax: Any = None) -> Any:
    """Draw modes and certified switches; returns the matplotlib axes."""
    from modegraph.report.plots import draw_graph

    return draw_graph(self, ax)


def save_graph(self: ModeGraph, path: Any) -> NoReturn:
    """Write the graph to a file; not built yet."""
    raise NotBuiltYet("saving a graph is not built yet")


def load_graph(cls: type[ModeGraph], path: Any) -> NoReturn:
    """Read a graph from a file; not built yet."""
    raise NotBuiltYet("loading a graph is not built yet")


# -- plans and runs ----------------------------------------------------------------------------------


def simulate(self: Plan, x0: Any = None, plant: Any = None, force: bool = False, *, stay: float | None = None) -> Run:
    """Integrate the real closed loop with its switching logic; see ``modegraph.run.simulate``.

    Parameters
    ----------
    x0 : (n,) array
        By default the state the plan was asked for.
    plant : System or callable(t, x, u), optional
        What really happens; by default the model of each mode, with disturbance and unknowns at
        the centre of their ranges.
    force : bool
        Also from an ``x0`` outside the first start set, for which nothing is certified.
    stay : float, optional
        Seconds in the goal mode; by default until it has settled.
    """
    from modegraph.run import simulate as run

    if x0 is None:
        x0 = self.x0
    if x0 is None:
        raise ModegraphError("simulate: give x0, the state at the beginning")
    modes = [self.graph.modes[name] for name in self.modes]
    times = [s.time for s in self.switches]
    return run.simulate(modes, self.references, times, x0, plant=plant, force=force, stay=stay)


def supervisor(self: Plan) -> NoReturn:
    """What runs the plan beside a real plant; not built yet."""
    raise NotBuiltYet("Plan.supervisor is not built yet; use Plan.simulate")


def export_c(self: Plan, folder: Any) -> NoReturn:
    """Write the supervisor of the plan in C; not built yet."""
    raise NotBuiltYet("Plan.export_c is not built yet")


def plot_plan(self: Plan, ax: Any = None) -> Any:
    """Draw the certified time line of the plan; returns the matplotlib axes."""
    from modegraph.report.plots import draw_plan

    return draw_plan(self, ax)


def plot_run(self: Run, ax: Any = None) -> Any:
    """Draw states and inputs over time; with ``ax``, only the states. Returns the axes."""
    from modegraph.report.plots import draw_run

    return draw_run(self, ax)


# -- which method belongs to which class -------------------------------------------------------------

attach("Set", plot=plot_set)
attach("Flowpipe", plot=plot_flowpipe)
attach("ContinuousReferences", plot=plot_references)
attach(
    "ModeGraph", plan=plan, plans=plans, explain=explain, plot=plot_graph, save=save_graph, load=classmethod(load_graph)
)
attach("Plan", simulate=simulate, supervisor=supervisor, export_c=export_c, plot=plot_plan)
attach("Run", plot=plot_run)
