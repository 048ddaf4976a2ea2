"""Properties of the repository that no single module owns."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import pytest

import modegraph

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "modegraph"
LAYERS = ["errors", "cores", "expression", "enclosure", "model", "reach", "certify", "graph", "plan", "run", "report"]
MODULES = sorted(SOURCE.rglob("*.py"))


def imported(path: Path) -> set[str]:
    """Top-level parts of modegraph that a module imports at run time (not only for annotations)."""
    found: set[str] = set()

    def visit(node: ast.AST) -> None:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            return
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("modegraph."):
            found.add(node.module.split(".")[1])
        for child in ast.iter_child_nodes(node):
            visit(child)

    visit(ast.parse(path.read_text(encoding="utf-8")))
    return found


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(SOURCE)))
def test_data_flows_one_way(path: Path) -> None:
    parts = path.relative_to(SOURCE).parts
    if len(parts) == 1 or parts[0] not in LAYERS:
        return
    above = set(LAYERS[: LAYERS.index(parts[0]) + 1])
    # What the public contract puts on an object of a lower layer: graph.plan(), plan.simulate(), x.plot().
    promised = {"graph": {"plan"}, "plan": {"run"}}.get(parts[0], set()) | {"report"}
    assert imported(path) <= above | promised


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(SOURCE)))
def test_files_are_short_and_well_named(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) < 500
    assert path.stem not in {"utils", "helpers", "misc", "common"}


def test_models_and_expressions_read_no_clock() -> None:
    """What is simplified, and how a set is searched, depends on the model alone, not on a busy machine."""
    clocks = re.compile(r"^\s*(import|from) (time|datetime|random)\b|default_rng\(\)", re.M)
    readers = {p.relative_to(SOURCE) for p in MODULES if clocks.search(p.read_text(encoding="utf-8"))}
    assert not {str(p) for p in readers if p.parts[0] in ("expression", "model")}


def test_numba_lives_in_enclosure_only() -> None:
    users = {p.relative_to(SOURCE).parts[0] for p in MODULES if re.search(r"(import|from) numba", p.read_text())}
    assert users <= {"enclosure"}


def test_import_is_fast_and_light() -> None:
    code = (
        "import sys, time; t = time.perf_counter(); import modegraph; s = time.perf_counter() - t;"
        "heavy = {'numba', 'scipy', 'matplotlib', 'flint', 'rich', 'typer', 'rustworkx'} & set(sys.modules);"
        "print(s); print(sorted(heavy))"
    )
    best = 9.0
    for _ in range(3):
        begin = time.perf_counter()
        out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split(
            "\n"
        )
        best = min(best, float(out[0]), time.perf_counter() - begin)
        assert out[1] == "[]"
    assert best < 0.5


def test_examples_ship_with_the_package() -> None:
    config = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert config["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"] == {"examples": "modegraph/examples"}
    assert config["project"]["version"] == modegraph.__version__
