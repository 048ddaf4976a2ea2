"""Properties of the repository that no single module owns."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import modegraph
from tests.imports import circles, imports, modules

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "modegraph"
FILES = modules(SOURCE)
IMPORTS = imports(FILES)

LAYERS = (
    "errors", "attach", "deadline", "guarded", "cores", "workers", "expression", "enclosure", "model", "reach",
    "certify", "graph", "plan", "explain", "store", "run", "report", "importers",
    "api", "", "model_file", "cli", "__main__",
)  # fmt: skip
"""Folders and files of the package, each above those that may import it; "" is ``modegraph/__init__.py``."""
UPWARD: dict[tuple[str, str], str] = {}
"""Imports against the order that are granted: (file, what it imports), and why."""
CIRCULAR: dict[frozenset[str], str] = {}
"""Files that may import each other, and why."""


def layer(name: str) -> int:
    """The place of a module in the order."""
    return LAYERS.index(name.partition(".")[2].partition(".")[0])


@pytest.mark.parametrize("name", FILES)
def test_data_flows_one_way(name: str) -> None:
    against = {(name, other) for other in IMPORTS[name] if layer(other) > layer(name)}
    assert against <= set(UPWARD)


def test_what_is_granted_is_needed() -> None:
    against = {(a, b) for a, others in IMPORTS.items() for b in others if layer(b) > layer(a)}
    assert against == set(UPWARD)


def test_files_do_not_import_each_other() -> None:
    assert {frozenset(names) for names in circles(IMPORTS)} == set(CIRCULAR)


TESTED_ELSEWHERE = {
    "enclosure/arguments.py": "enclosure/test_operations.py: records that kernels take, nothing of their own",
    "enclosure/adjoint.py": "enclosure/test_jets_and_remainder.py: it tightens what jets leave",
    "enclosure/disturbance.py": "enclosure/test_exponential.py: its columns are integrals of that exponential",
    "enclosure/elementary.py": "enclosure/test_jets_and_remainder.py: series, through the nodes that use them",
    "enclosure/jets.py": "enclosure/test_jets_and_remainder.py: what jets propose is what remainders check",
    "enclosure/polynomial.py": "enclosure/test_operations.py: kernels one by one against exact rationals",
    "enclosure/quadratic.py": "enclosure/test_generators.py: bounds over generators",
    "enclosure/remainder.py": "enclosure/test_jets_and_remainder.py: what jets propose is what remainders check",
    "enclosure/variational.py": "enclosure/test_operations.py: kernels one by one against exact rationals",
    "expression/arrayfunctions.py": "expression/test_array.py: called as users do, by NumPy",
    "expression/ufuncs.py": "expression/test_array.py: called as users do, by NumPy",
    "expression/protocol.py": "expression/test_array.py: called as users do, by NumPy",
    "expression/depth.py": "expression/test_namespace.py: a pause is one of a trace",
    "reach/flow/passed.py": "reach/flow/test_flow.py: what a flow says, by the flow",
    "reach/flow/observation.py": "reach/flow/test_flow.py: what is observed along the steps of a flow",
    "__main__.py": "test_main.py: a test's name has no underscores of its own",
}
"""Files whose tests are in a file of another name, and why."""
NOT_YET = {
    "certify/continuous.py", "certify/counterexamples/witnessed.py", "certify/question.py",
    "reach/compiled.py", "reach/field.py", "reach/flow/error_table.py", "reach/flow/records.py", "reach/pointwise.py",
}  # fmt: skip
"""Files without tests of their own; this list only gets shorter."""


def test_tests_mirror_the_sources_file_by_file() -> None:
    files = {path.relative_to(SOURCE).as_posix() for path in FILES.values() if path.stem != "__init__"}
    tested = {name for name in files if (ROOT / "tests" / name).with_name(f"test_{Path(name).name}").is_file()}
    assert files - tested == set(TESTED_ELSEWHERE) | NOT_YET
    for reason in TESTED_ELSEWHERE.values():
        assert (ROOT / "tests" / reason.partition(": ")[0]).is_file()


MOST_LINES = {"enclosure": 460, "expression": 420}
"""Lines of a file, where that is not 400: kernels, and the graph of expressions."""


@pytest.mark.parametrize("path", FILES.values(), ids=lambda p: str(p.relative_to(SOURCE)))
def test_files_are_short_and_well_named(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= MOST_LINES.get(path.relative_to(SOURCE).parts[0], 400)
    assert path.stem not in {"utils", "helpers", "misc", "common"}


def test_models_and_expressions_read_no_clock() -> None:
    """What is simplified, and how a set is searched, depends on the model alone, not on a busy machine."""
    clocks = re.compile(r"^\s*(import|from) (time|datetime|random)\b|default_rng\(\)", re.M)
    readers = {p.relative_to(SOURCE) for p in FILES.values() if clocks.search(p.read_text(encoding="utf-8"))}
    assert not {str(p) for p in readers if p.parts[0] in ("expression", "model")}


def test_numba_lives_in_enclosure_only() -> None:
    users = {p.relative_to(SOURCE).parts[0] for p in FILES.values() if re.search(r"(import|from) numba", p.read_text())}
    assert users <= {"enclosure"}


MOST_LOADED = 60
HEAVY = {"numpy", "numba", "scipy", "matplotlib", "flint", "clarabel", "rich", "typer"}


def test_import_is_light() -> None:
    """Nothing of the package but errors, and what waits for its classes; the standard library's share is bounded."""
    code = (
        "import sys; before = set(sys.modules); import modegraph, json; print(json.dumps([*set(sys.modules) - before]))"
    )
    loaded = set(json.loads(subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout))
    own = {name for name in loaded if name.split(".")[0] == "modegraph"}
    assert own == {"modegraph", "modegraph.api", "modegraph.attach", "modegraph.errors"}
    assert not HEAVY & loaded
    assert len(loaded) < MOST_LOADED


def test_examples_ship_with_the_package() -> None:
    config = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert config["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"] == {"examples": "modegraph/examples"}


def test_the_version_stands_in_one_place() -> None:
    config = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert "version" not in config["project"]
    assert config["project"]["dynamic"] == ["version"]
    source = ROOT / config["tool"]["hatch"]["version"]["path"]
    assert source == SOURCE / "__init__.py"
    assert re.findall(r'^__version__ = "(.+)"$', source.read_text(encoding="utf-8"), re.MULTILINE) == [
        modegraph.__version__
    ]
    assert f"What will be {modegraph.__version__}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_every_commit_is_checked_as_make_lint_does() -> None:
    """The hooks are those of the Makefile, from the same tools."""
    recipe = (ROOT / "Makefile").read_text(encoding="utf-8").partition("\nlint:")[2].partition("\n\n")[0]
    hooks = re.findall(r"entry: (.+)", (ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))
    assert hooks == [line.strip().replace("$(BIN)", ".venv/bin") for line in recipe.splitlines()[1:]]
    assert len(hooks) == 3


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


@pytest.mark.parametrize("path", FILES.values(), ids=lambda p: str(p.relative_to(SOURCE)))
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
