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


PROSE = {"reason", "remedy", "failure", "in_full", "text", "message"}
SEARCHES = {"partition", "rpartition", "split", "startswith", "endswith", "find", "index", "count", "removeprefix"}


def reads_prose(tree: ast.AST) -> list[int]:
    """Lines that look for words in the text of an error, a reason or another statement."""

    def is_prose(node: ast.AST) -> bool:
        if isinstance(node, ast.Call):
            return isinstance(node.func, ast.Name) and node.func.id in {"str", "repr", "texts", "told"}
        return isinstance(node, ast.Attribute) and node.attr in PROSE

    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            prose = any(map(is_prose, sides))
            words = any(isinstance(side, ast.Constant) and isinstance(side.value, str) and side.value for side in sides)
            member = any(isinstance(op, ast.In | ast.NotIn) for op in node.ops)
            found += [node.lineno] * bool(prose and (member or words))
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            found += [node.lineno] * (node.func.attr in SEARCHES and is_prose(node.func.value))
    return found


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(SOURCE)))
def test_no_code_reads_prose(path: Path) -> None:
    assert not reads_prose(ast.parse(path.read_text(encoding="utf-8")))


@pytest.mark.parametrize(
    "code",
    [
        "sunk.reason.partition(':')[0]",
        "'read-only' not in str(error)",
        "sunk.mechanism in course.reason",
        "verdict.reason == 'the budget ended'",
        "b.failure.startswith('at t')",
    ],
)
def test_reading_prose_would_be_seen(code: str) -> None:
    assert reads_prose(ast.parse(code))
