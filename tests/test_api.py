"""Methods of upper layers on public objects: there whatever is imported first, and imported late themselves."""

from __future__ import annotations

import ast
import inspect
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import modegraph as mg
from modegraph import api
from modegraph.attach import METHODS

HOMES = {
    "Set": "modegraph.model.sets.base",
    "Flowpipe": "modegraph.reach.flowpipe",
    "ContinuousReferences": "modegraph.certify.continuous",
    "ModeGraph": "modegraph.graph.modegraph",
    "Plan": "modegraph.plan.plan",
    "Run": "modegraph.run.simulate",
}


def declared(owner: str) -> dict[str, str]:
    """What the class declares for type checkers: its name of a method, and the name of the function in api.py."""
    path = inspect.getsourcefile(import_module(HOMES[owner]))
    assert path is not None
    tree = ast.parse(Path(path).read_text(encoding="utf-8"))
    (body,) = (node.body for node in tree.body if isinstance(node, ast.ClassDef) and node.name == owner)
    (block,) = (node.body for node in body if isinstance(node, ast.If))
    found = {}
    for line in block:
        assert isinstance(line, ast.Assign)
        name, value = line.targets[0], line.value
        function = value.args[0] if isinstance(value, ast.Call) else value
        assert isinstance(name, ast.Name)
        assert isinstance(function, ast.Attribute)
        found[name.id] = function.attr
    return found


def test_every_class_with_methods_has_a_home() -> None:
    assert set(METHODS) == set(HOMES)


@pytest.mark.parametrize("owner", HOMES)
def test_a_class_has_what_it_declares_and_nothing_else(owner: str) -> None:
    cls = getattr(import_module(HOMES[owner]), owner)
    told = declared(owner)
    assert set(told) == set(METHODS[owner])
    for name, function in told.items():
        method = getattr(cls, name)
        assert getattr(method, "__func__", method) is getattr(api, function)
        assert method.__name__ == name
        assert method.__qualname__ == f"{owner}.{name}"
        assert inspect.getdoc(method)


def test_help_shows_parameters_and_errors() -> None:
    text = inspect.getdoc(mg.ModeGraph.plan)
    assert text is not None
    for word in ("minimize :", "r_start, r_goal :", "Raises", "Unreachable"):
        assert word in text
    assert list(inspect.signature(mg.ModeGraph.plan).parameters)[:3] == ["self", "start", "goal"]


def test_subclasses_have_them_too() -> None:
    assert mg.Box.plot is mg.Sublevel.plot is api.plot_set


@pytest.mark.parametrize(
    "first",
    [
        "from modegraph.graph.build import build; from modegraph.graph.modegraph import ModeGraph",
        "from modegraph.graph.modegraph import ModeGraph",
        "from modegraph import ModeGraph",
        "import modegraph; ModeGraph = modegraph.ModeGraph",
    ],
)
def test_whatever_is_imported_first(first: str) -> None:
    """And neither the planner nor what draws is loaded before it is asked for."""
    late = "'modegraph.plan', 'modegraph.explain', 'modegraph.report', 'modegraph.run', 'matplotlib'"
    code = f"import sys; {first}; print(ModeGraph.plan.__name__, sorted({{{late}}} & set(sys.modules)))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.strip() == "plan []"


def test_what_is_not_built_says_so(tmp_path: Path) -> None:
    graph = mg.ModeGraph([], {}, {})
    with pytest.raises(mg.NotBuiltYet, match="saving"):
        graph.save(tmp_path / "graph")
    with pytest.raises(mg.NotBuiltYet, match="loading"):
        mg.ModeGraph.load(tmp_path / "graph")
