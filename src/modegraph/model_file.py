"""A MODEL.py of the command line: loading it, and finding the shipped ones."""

from __future__ import annotations

import importlib.util
import sys
import traceback
from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from modegraph.errors import ModegraphError

if TYPE_CHECKING:
    from modegraph.graph.modegraph import ModeGraph

EXAMPLES = {"arm": "two_link_arm.py", "point-mass": "point_mass.py"}


@dataclass(frozen=True)
class ModelFile:
    """What a model module defines: ``modes`` and optionally horizon, period, noise, tasks."""

    path: Path
    modes: list[Any]
    horizon: Any = None
    period: Any = None
    noise: Any = None
    tasks: Mapping[str, Any] = field(default_factory=dict)

    def build(self, budget: float | None) -> ModeGraph:
        """The graph of the model, with a progress bar in a terminal."""
        from modegraph.enclosure import kernels_are_compiled
        from modegraph.graph.build import build

        if not kernels_are_compiled():
            print("first run: compiling the kernels, about half a minute, once", file=sys.stderr)
        return build(
            self.modes,
            horizon=self.horizon,
            period=self.period,
            noise=self.noise,
            progress=True,
            budget=budget,
        )

    def task(self, name: str) -> dict[str, Any]:
        """The arguments of ``plan`` under this name in ``tasks``."""
        if name not in self.tasks:
            raise ModegraphError(f"{self.path.name} has no task {name!r}; {_hint(name, list(self.tasks), 'tasks')}")
        task = self.tasks[name]
        if not isinstance(task, Mapping):
            raise ModegraphError(f"{self.path.name}: tasks[{name!r}] must be a dict such as dict(start=, goal=)")
        allowed = ("start", "goal", "minimize", "r_start", "r_goal", "x0", "via", "avoid", "max_switches")
        for key in task:
            if key not in allowed:
                raise ModegraphError(
                    f"{self.path.name}: tasks[{name!r}] has the unknown entry {key!r}; "
                    f"{_hint(str(key), list(allowed), 'entries')}"
                )
        return dict(task)

    def first_task(self) -> dict[str, Any]:
        """The first task; without tasks, from the first mode to the last."""
        if self.tasks:
            return self.task(next(iter(self.tasks)))
        return {"start": self.modes[0].name, "goal": self.modes[-1].name}

    def check_names(self, question: Mapping[str, Any]) -> None:
        """Fail on a mode name that does not exist before the proofs are begun."""
        names = [str(getattr(mode, "name", "")) for mode in self.modes]
        asked = [question.get("start"), question.get("goal")]
        for several in (question.get("via"), question.get("avoid")):
            asked += several if isinstance(several, list | tuple) else [several]
        for name in asked:
            if isinstance(name, str) and name not in names:
                raise ModegraphError(f"{self.path.name} has no mode {name!r}; {_hint(name, names, 'modes')}")


def load_model(path: Path) -> ModelFile:
    """Run the Python file and collect what it defines.

    Raises
    ------
    ModegraphError
        If there is no such file, it does not run, or it is no model. The message says where.
    """
    if not path.exists():
        raise ModegraphError(f"there is no file {path}")
    if not path.is_file():
        raise ModegraphError(f"{path} is not a file; give a Python file that defines `modes`")
    module = _run(path)
    if not hasattr(module, "modes"):
        raise ModegraphError(f"{path} is no model: it does not define `modes`, a list of modegraph.Mode and Target")
    try:
        modes = list(module.modes)
    except TypeError:
        raise ModegraphError(f"{path}: `modes` must be a list, not {type(module.modes).__name__}") from None
    tasks = getattr(module, "tasks", None) or {}
    if not isinstance(tasks, Mapping):
        raise ModegraphError(f"{path}: `tasks` must be a dict of dicts, not {type(tasks).__name__}")
    return ModelFile(
        path,
        modes,
        getattr(module, "horizon", None),
        getattr(module, "period", None),
        getattr(module, "noise", None),
        tasks,
    )


def shipped_example(name: str) -> Path:
    """Path of an example that comes with the package, or with the repository it runs from."""
    if name not in EXAMPLES:
        raise ModegraphError(f"there is no demo {name!r}; {_hint(name, list(EXAMPLES), 'demos')}")
    package = Path(__file__).resolve().parent
    for folder in (package / "examples", package.parent.parent / "examples"):
        if (folder / EXAMPLES[name]).is_file():
            return folder / EXAMPLES[name]
    raise ModegraphError(f"the demo {name!r} was not installed with the package")


def _run(path: Path) -> ModuleType:
    """Import the file as a module of its own; modules beside it can be imported by it."""
    name = f"modegraph_model_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path.resolve())
    if spec is None or spec.loader is None:
        raise ModegraphError(f"{path} is not a Python file (its name must end in .py)")
    module = importlib.util.module_from_spec(spec)
    folder = str(path.resolve().parent)
    sys.path.insert(0, folder)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except ModegraphError as error:
        raise ModegraphError(f"{_where(path, error)}: {error}") from error
    except (SyntaxError, UnicodeDecodeError) as error:
        raise ModegraphError(f"{path} is not valid Python: {error}") from error
    except SystemExit as error:
        raise ModegraphError(f"{path} ended the program while it was loaded (exit {error.code})") from error
    except Exception as error:
        raise ModegraphError(f"{_where(path, error)}: {type(error).__name__}: {error}") from error
    finally:
        sys.path.remove(folder)
    return module


def _where(path: Path, error: BaseException) -> str:
    """The file and the last of its lines on the way to the error."""
    own = str(path.resolve())
    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == own]
    return f"{path}, line {lines[-1]}" if lines else str(path)


def _hint(name: str, known: list[str], what: str) -> str:
    near = get_close_matches(name, known, n=1, cutoff=0.4)
    if near:
        return f"did you mean {near[0]!r}?"
    return f"{what}: {', '.join(known)}" if known else f"there are no {what}"
