"""The command line: ``modegraph build | check | plan | simulate | explain | demo ... MODEL.py``.

Exit codes: 0 answered; 1 the answer is no; 2 the model or the call is wrong; 3 undecided.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, ParamSpec

import typer

from modegraph.certify.verdict import Status, Verdict
from modegraph.errors import ModegraphError, NotBuiltYet, Unreachable
from modegraph.model_file import ModelFile, load_model, shipped_example
from modegraph.plan.as_json import json_text, plan_data, verdict_data
from modegraph.report.tables import explanation_data, graph_data, print_checks, print_graph

YES, NO, WRONG, UNDECIDED = 0, 1, 2, 3

app = typer.Typer(
    name="modegraph",
    help="Prove which controllers can be chained, plan the best chain, run it.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

Model = Annotated[Path, typer.Argument(metavar="MODEL.py", help="A Python file that defines `modes`.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON; keys are the attribute names.")]
Budget = Annotated[float | None, typer.Option(help="Seconds of work for the proofs.")]
From = Annotated[str | None, typer.Option("--from", metavar="MODE", help="The mode that runs at first.")]
To = Annotated[str | None, typer.Option("--to", metavar="MODE", help="The mode or target to end in.")]
Minimize = Annotated[str | None, typer.Option(help="switches, time, energy, margin, or weights: time=1,switches=0.5")]
Via = Annotated[str | None, typer.Option(metavar="MODE,...", help="Visit these, in this order.")]
Avoid = Annotated[str | None, typer.Option(metavar="MODE,...", help="Never enter these.")]
MaxSwitches = Annotated[int | None, typer.Option(help="At most so many switches.")]
RStart = Annotated[str | None, typer.Option(metavar="NUMBERS", help="Reference of the first mode: 0.1,2")]
RGoal = Annotated[str | None, typer.Option(metavar="NUMBERS", help="Reference of the last mode.")]
Task = Annotated[str | None, typer.Option(help="An entry of the model's `tasks`; options override it.")]
StartState = Annotated[str | None, typer.Option("--start", metavar="NUMBERS", help="The state x0: 0.1,0.2,0,0")]

P = ParamSpec("P")


def answering(command: Callable[P, int]) -> Callable[P, None]:
    """Turn the result of a command into an exit code and every ModegraphError into one message."""

    @wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        as_json = bool(kwargs.get("as_json", False))
        try:
            code = command(*args, **kwargs)
        except Unreachable as error:
            data = {"error": str(error), "reachable": error.reachable, "helpful": error.helpful}
            _complain(str(error), data if as_json else None)
            code = UNDECIDED if error.helpful else NO
        except ModegraphError as error:
            _complain(str(error), {"error": str(error)} if as_json else None)
            code = WRONG
        except KeyboardInterrupt:
            _complain("interrupted", None)
            code = 130
        raise typer.Exit(code)

    return run


@app.command()
@answering
def build(model: Model, as_json: Json = False, budget: Budget = None) -> int:
    """Prove every ordered pair of modes: a table of certified, refuted and undecided, and why."""
    graph = load_model(model).build(budget)
    if as_json:
        typer.echo(json_text(graph_data(graph)))
    else:
        print_graph(graph)
    return YES


@app.command()
@answering
def check(model: Model, as_json: Json = False, budget: Budget = None) -> int:
    """Whether the constraints of each mode hold for all time. Exit 1 if one is refuted, 3 if undecided."""
    from modegraph.model.target import Target

    graph = load_model(model).build(budget)
    checks = {name: graph.check(name) for name, mode in graph.modes.items() if not isinstance(mode, Target)}
    if as_json:
        typer.echo(json_text({"checks": {name: verdict_data(v) for name, v in checks.items()}}))
    else:
        print_checks(checks)
    return _worst(checks)


@app.command()
@answering
def plan(
    model: Model,
    from_: From = None,
    to: To = None,
    minimize: Minimize = None,
    via: Via = None,
    avoid: Avoid = None,
    max_switches: MaxSwitches = None,
    r_start: RStart = None,
    r_goal: RGoal = None,
    task: Task = None,
    start: StartState = None,
    as_json: Json = False,
    budget: Budget = None,
) -> int:
    """The best chain of certified switches. Exit 1 if there is none, 3 if undecided pairs could help."""
    loaded = load_model(model)
    question = _question(loaded, task, from_, to, minimize, via, avoid, max_switches, r_start, r_goal, start)
    loaded.check_names(question)
    found = loaded.build(budget).plan(**question)
    typer.echo(json_text(plan_data(found)) if as_json else str(found))
    return YES


@app.command()
@answering
def simulate(
    model: Model,
    from_: From = None,
    to: To = None,
    start: StartState = None,
    minimize: Minimize = None,
    via: Via = None,
    avoid: Avoid = None,
    max_switches: MaxSwitches = None,
    r_start: RStart = None,
    r_goal: RGoal = None,
    task: Task = None,
    force: Annotated[bool, typer.Option(help="Also from a state outside the start set.")] = False,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Where to put the plot.")] = None,
    as_json: Json = False,
    budget: Budget = None,
) -> int:
    """Plan and integrate the real closed loop. Exit 1 if the run violates a constraint or gets stuck."""
    loaded = load_model(model)
    question = _question(loaded, task, from_, to, minimize, via, avoid, max_switches, r_start, r_goal, start)
    loaded.check_names(question)
    graph = loaded.build(budget)
    return _simulated(graph, question, force, output, as_json)


@app.command()
@answering
def explain(
    model: Model,
    source: Annotated[str, typer.Argument(metavar="FROM")],
    target: Annotated[str, typer.Argument(metavar="TO")],
    r_i: Annotated[str | None, typer.Option("--r-i", metavar="NUMBERS", help="Reference of FROM.")] = None,
    r_j: Annotated[str | None, typer.Option("--r-j", metavar="NUMBERS", help="Reference of TO.")] = None,
    seconds: Annotated[float, typer.Option(help="Of work on repairs, after the proofs.")] = 30.0,
    as_json: Json = False,
    budget: Budget = None,
) -> int:
    """Why there is, or is not, a switch from FROM to TO, and which changes were proved to give it."""
    loaded = load_model(model)
    loaded.check_names({"start": source, "goal": target})
    told = loaded.build(budget).explain(
        source,
        target,
        None if r_i is None else _numbers("--r-i", r_i),
        None if r_j is None else _numbers("--r-j", r_j),
        seconds=seconds,
    )
    typer.echo(json_text(explanation_data(told)) if as_json else str(told))
    return YES


@app.command()
@answering
def demo(
    name: Annotated[str, typer.Argument(help="Which example: arm or point-mass.")] = "arm",
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Where to put the plot.")] = None,
    as_json: Json = False,
) -> int:
    """Build, plan and run a shipped example; says where the plot is."""
    path = shipped_example(name)
    loaded = load_model(path)
    if not as_json:
        typer.echo(f"model: {path}")
    graph = loaded.build(None)
    if not as_json:
        print_graph(graph)
    question = loaded.first_task()
    return _simulated(graph, question, False, output or Path(f"modegraph-{name}.png"), as_json)


def _not_built(name: str, what: str) -> None:
    @app.command(name, help=f"{what} (not built yet)", context_settings={"ignore_unknown_options": True})
    @answering
    def command(arguments: Annotated[list[str] | None, typer.Argument(hidden=True)] = None) -> int:
        raise NotBuiltYet(f"modegraph {name} is not built yet")


for _name, _what in (
    ("report", "Write one self-contained page"),
    ("export", "Write a supervisor in C"),
    ("store", "Look after a file of results"),
    ("new", "Write a model to start from"),
    ("doctor", "Check the installation"),
):
    _not_built(_name, _what)


def main() -> None:
    """Entry point of the ``modegraph`` program."""
    app()


def _simulated(graph: Any, question: dict[str, Any], force: bool, output: Path | None, as_json: bool) -> int:
    from modegraph.report.plots import save_plot
    from modegraph.report.tables import print_run, run_data

    x0 = question.get("x0")
    if force:
        question = {key: value for key, value in question.items() if key != "x0" or "start" not in question}
    found = graph.plan(**question)
    if x0 is None:
        x0 = _some_start(graph, found)
    run = found.simulate(x0, force=force)
    if output is not None:
        import matplotlib as mpl

        mpl.use("Agg")
        save_plot(run.plot(), output)
    if as_json:
        typer.echo(json_text({"plan": plan_data(found), "run": run_data(run)}))
    else:
        typer.echo(str(found))
        print_run(run)
        if output is not None:
            typer.echo(f"plot: {output.resolve()}")
    return YES if run.ok else NO


def _some_start(graph: Any, found: Any) -> Any:
    from modegraph.graph.entry import Entry

    mode = graph.modes[found.modes[0]]
    chosen = Entry(mode, found.references[0]).set.sample(1, seed=0)[0][: graph.dimension]
    state = ", ".join(f"{v:.4g}" for v in chosen)
    typer.echo(f"starting from {state}, drawn from the start set of {mode.name!r}", err=True)
    return chosen


def _question(
    loaded: ModelFile,
    task: str | None,
    from_: str | None,
    to: str | None,
    minimize: str | None,
    via: str | None,
    avoid: str | None,
    max_switches: int | None,
    r_start: str | None,
    r_goal: str | None,
    x0: str | None,
) -> dict[str, Any]:
    """Arguments of ``ModeGraph.plan``: the task, overridden by the options given."""
    question = {} if task is None else loaded.task(task)
    options = {
        "start": from_,
        "goal": to,
        "minimize": None if minimize is None else _objective(minimize),
        "via": None if via is None else _names(via),
        "avoid": None if avoid is None else _names(avoid),
        "max_switches": max_switches,
        "r_start": None if r_start is None else _numbers("--r-start", r_start),
        "r_goal": None if r_goal is None else _numbers("--r-goal", r_goal),
        "x0": None if x0 is None else _numbers("--start", x0),
    }
    question.update({key: value for key, value in options.items() if value is not None})
    if "goal" not in question:
        tasks = ", ".join(loaded.tasks)
        raise ModegraphError("give --to MODE" + (f", or --task with one of: {tasks}" if tasks else ""))
    if "start" not in question and "x0" not in question:
        raise ModegraphError("give --from MODE, or --start with a state")
    return question


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",") if name.strip()]


def _numbers(option: str, text: str) -> list[float]:
    try:
        return [float(part) for part in text.replace(",", " ").split()]
    except ValueError:
        raise ModegraphError(f"{option}: {text!r} is not a list of numbers such as 0.1,-2,0") from None


def _objective(text: str) -> str | Mapping[str, float]:
    if "=" not in text:
        return text
    weights = {}
    for part in text.split(","):
        name, _, value = part.partition("=")
        try:
            weights[name.strip()] = float(value)
        except ValueError:
            raise ModegraphError(f"--minimize: {part!r} is not a weight such as time=1") from None
    return weights


def _worst(checks: Mapping[str, Verdict]) -> int:
    statuses = {v.status for v in checks.values()}
    if Status.REFUTED in statuses:
        return NO
    return UNDECIDED if Status.UNDECIDED in statuses else YES


def _complain(message: str, data: Any) -> None:
    if data is not None:
        typer.echo(json_text(data))
    sys.stdout.flush()
    typer.echo(f"modegraph: {message}", err=True)
