"""The reader of imports, on a package made for it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.imports import circles, imports, modules

FILES = {
    "__init__.py": "from modest.low import first",
    "low/__init__.py": "",
    "low/first.py": "from ..high import top\nimport os",
    "low/second.py": "def late():\n    from modest.low import first\n    import modest.high.top",
    "low/third.py": "from . import second as s\nfrom .first import name",
    "high/__init__.py": "",
    "high/top.py": (
        "from typing import TYPE_CHECKING\nimport typing\n"
        "if TYPE_CHECKING:\n    from modest.low import third\nelse:\n    from modest.low.second import late\n"
        "if typing.TYPE_CHECKING:\n    from modest.low import first\n"
        "if not TYPE_CHECKING:\n    import modest\n"
    ),
}


@pytest.fixture
def package(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        path = tmp_path / "modest" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path / "modest"


def test_every_way_to_import_is_read(package: Path) -> None:
    assert imports(modules(package)) == {
        "modest": {"modest.low.first"},
        "modest.low": set(),
        "modest.low.first": {"modest.high.top"},
        "modest.low.second": {"modest.low.first", "modest.high.top"},
        "modest.low.third": {"modest.low.second", "modest.low.first"},
        "modest.high": set(),
        "modest.high.top": {"modest.low.second", "modest"},
    }


def test_circles_are_found_once_each() -> None:
    graph = {"a": {"b"}, "b": {"c"}, "c": {"a", "d"}, "d": {"e"}, "e": {"d"}, "f": {"a"}, "g": set()}
    assert circles({name: frozenset(others) for name, others in graph.items()}) == [["a", "b", "c"], ["d", "e"]]
