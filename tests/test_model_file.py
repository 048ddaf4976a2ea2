"""Model files: what they may define, and errors that say where."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from modegraph.errors import ModegraphError
from modegraph.model_file import EXAMPLES, ModelFile, load_model, shipped_example
from tests.graph.fakes import mode


def written(folder: Path, text: str, name: str = "model.py") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def test_what_a_file_defines(tmp_path: Path) -> None:
    written(tmp_path, "names = ['a', 'b']", "beside.py")
    loaded = load_model(written(tmp_path, "from beside import names\nmodes = tuple(names)\nhorizon = 3.0\n"))
    assert loaded.modes == ["a", "b"]
    assert (loaded.horizon, loaded.period, loaded.noise, loaded.tasks) == (3.0, None, None, {})
    assert str(tmp_path) not in sys.path


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("horizon = 1", "does not define `modes`"),
        ("modes = 3", "`modes` must be a list, not int"),
        ("modes = []\ntasks = [1]", "`tasks` must be a dict of dicts, not list"),
        ("modes = [", "is not valid Python"),
        ("\n\nmodes = [1 / 0]", r"model.py, line 3: ZeroDivisionError"),
        ("raise SystemExit(3)", r"ended the program while it was loaded \(exit 3\)"),
        ("import modegraph as mg\nmg.Ball([0.0], -1.0)", r"model.py, line 2: Ball"),
    ],
)
def test_a_file_that_is_no_model(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ModegraphError, match=message):
        load_model(written(tmp_path, text))


def test_no_file(tmp_path: Path) -> None:
    with pytest.raises(ModegraphError, match="there is no file"):
        load_model(tmp_path / "model.py")
    with pytest.raises(ModegraphError, match="is not a file"):
        load_model(tmp_path)
    with pytest.raises(ModegraphError, match=r"must end in \.py"):
        load_model(written(tmp_path, "modes = []", "model.txt"))


def test_tasks() -> None:
    loaded = ModelFile(Path("m.py"), [mode("slow"), mode("fast")], tasks={"go": {"goal": "fast"}, "odd": {"aim": 1}})
    assert loaded.first_task() == loaded.task("go") == {"goal": "fast"}
    with pytest.raises(ModegraphError, match="no task 'goo'; did you mean 'go'"):
        loaded.task("goo")
    with pytest.raises(ModegraphError, match="unknown entry 'aim'"):
        loaded.task("odd")
    assert ModelFile(Path("m.py"), loaded.modes).first_task() == {"start": "slow", "goal": "fast"}


def test_names_are_checked_before_the_proofs() -> None:
    loaded = ModelFile(Path("m.py"), [mode("slow"), mode("fast")])
    loaded.check_names({"start": "slow", "goal": loaded.modes[1], "via": ["fast"]})
    for question in ({"start": "slwo"}, {"goal": "slwo"}, {"via": ["slwo"]}, {"avoid": "slwo"}):
        with pytest.raises(ModegraphError, match="no mode 'slwo'; did you mean 'slow'"):
            loaded.check_names(question)


def test_demos() -> None:
    assert all(shipped_example(name).is_file() for name in EXAMPLES)
    with pytest.raises(ModegraphError, match="no demo 'amr'; did you mean 'arm'"):
        shipped_example("amr")
