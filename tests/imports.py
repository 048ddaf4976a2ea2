"""Which file of the package imports which, at run time: absolute or relative, at the top or inside a function."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from pathlib import Path

Modules = Mapping[str, Path]
Imports = Mapping[str, frozenset[str]]


def modules(package: Path) -> dict[str, Path]:
    """The files of a package by the name Python gives them; a folder is its ``__init__``."""
    found = {}
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package.parent).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imports(known: Modules) -> dict[str, frozenset[str]]:
    """For every file the files of the package that it imports."""
    return {
        name: frozenset(_of(ast.parse(path.read_text(encoding="utf-8")), _folder(name, path), known)) - {name}
        for name, path in known.items()
    }


def _folder(name: str, path: Path) -> str:
    return name if path.stem == "__init__" else name.rpartition(".")[0]


def _of(node: ast.AST, folder: str, known: Modules) -> Iterator[str]:
    if isinstance(node, ast.If) and _is_for_types_only(node.test):
        for child in node.orelse:
            yield from _of(child, folder, known)
        return
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names if alias.name in known)
    if isinstance(node, ast.ImportFrom):
        above = folder.split(".")[: len(folder.split(".")) + 1 - node.level] if node.level else []
        home = ".".join([*above, *([node.module] if node.module else [])])
        for alias in node.names:
            inside = f"{home}.{alias.name}"
            yield from (name for name in (inside if inside in known else home,) if name in known)
    for child in ast.iter_child_nodes(node):
        yield from _of(child, folder, known)


def _is_for_types_only(test: ast.AST) -> bool:
    return isinstance(test, ast.Name | ast.Attribute) and ast.unparse(test).split(".")[-1] == "TYPE_CHECKING"


def circles(graph: Imports) -> list[list[str]]:
    """Sets of files that import each other, directly or on a way round; names in order."""
    reached: dict[str, set[str]] = {}
    for name in graph:
        seen: set[str] = set()
        open_ = list(graph[name])
        while open_:
            other = open_.pop()
            if other not in seen:
                seen.add(other)
                open_ += graph[other]
        reached[name] = seen
    rounds = {tuple(sorted(b for b in reached[a] if a in reached[b])) for a in graph if a in reached[a]}
    return [list(names) for names in sorted(rounds)]
