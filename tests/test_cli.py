"""The command line around a proof engine that is replaced."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from modegraph import cli, model_file
from modegraph.certify.unit import UnitResult
from modegraph.certify.verdict import Status, Verdict
from modegraph.cli import app
from modegraph.graph import build as build_module
from modegraph.model_file import shipped_example
from tests.graph.fakes import because

MODEL = """
import numpy as np
import modegraph as mg

plant = mg.System(lambda x, u: np.array([u[0] - x[0]]), states="x", inputs="u")

def mode(name, r, radius=0.5):
    return mg.Mode(name, plant, controller=lambda r: r, reference=mg.setpoint(r),
                   start=lambda r: mg.Box([r[0] - radius], [r[0] + radius]))

modes = [mode("slow", [0.0], 5.0), mode("fast", mg.Points([[0.0], [1.0]])), mode("far", [9.0])]
horizon = 5.0
tasks = {
    "go": {"start": "slow", "goal": "fast", "minimize": "time"},
    "home": {"x0": [2.0], "goal": "fast"},
    "odd": {"start": "slow", "target": "fast"},
}
"""


@pytest.fixture
def engine(monkeypatch: pytest.MonkeyPatch) -> dict[Any, Verdict]:
    """Verdicts by (source, target) and checks by name; slow -> fast is certified, the rest refuted."""
    answers: dict[Any, Verdict] = {
        ("slow", "fast"): Verdict(
            Status.CERTIFIED, because("proved"), time=(0.0, 4.0), margin=float("inf"), energy=float("nan")
        ),
    }

    def certify(mode: Any, p: Any, targets: Any, **_: Any) -> UnitResult:
        refuted = Verdict(Status.REFUTED, because("stays outside [1, 2]"))
        settled = Verdict(Status.CERTIFIED, because("for all time"))
        return UnitResult(
            verdicts=[answers.get((mode.name, t.name), refuted) for t in targets],
            check=answers.get(mode.name, settled),
        )

    monkeypatch.setattr(build_module, "certify_unit", certify)
    return answers


@pytest.fixture
def model(tmp_path: Path, engine: Any) -> str:
    path = tmp_path / "model.py"
    path.write_text(MODEL)
    return str(path)


def run(*arguments: str) -> Result:
    result = CliRunner().invoke(app, list(arguments))
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


def loads(text: str) -> Any:
    return json.loads(text, parse_constant=pytest.fail)


def wrong(result: Result) -> str:
    assert result.exit_code == 2, result.output
    assert "Traceback" not in result.output
    return result.stderr


def test_build_prints_a_table(model: str) -> None:
    result = run("build", model)
    assert result.exit_code == 0
    assert "stays outside [1, 2]" in result.stdout
    assert "1 certified, 6 refuted, 0 undecided of 7 pairs" in result.stdout
    assert result.stderr == ""


def test_build_json(model: str) -> None:
    data = loads(run("build", model, "--json").stdout)
    assert {v["status"] for v in data["verdicts"]} == {"certified", "refuted"}
    assert data["switches"][0]["margin"] is None
    assert data["switches"][0]["references"] == [[[0.0], [0.0]], [[0.0], [1.0]]]


@pytest.mark.parametrize(("status", "code"), [(Status.CERTIFIED, 0), (Status.REFUTED, 1), (Status.UNDECIDED, 3)])
def test_check_exit_codes(model: str, engine: Any, status: Status, code: int) -> None:
    engine["fast"] = Verdict(status, because("because"))
    result = run("check", model)
    assert result.exit_code == code
    assert "because" in result.stdout or status is Status.CERTIFIED
    data = loads(run("check", model, "--json").stdout)
    assert data["checks"]["fast"]["status"] == status.value


def test_plan(model: str) -> None:
    result = run("plan", model, "--from", "slow", "--to", "fast", "--minimize", "time")
    assert result.exit_code == 0
    assert result.stdout.startswith("slow fast")
    data = loads(run("plan", model, "--from", "slow", "--to", "fast", "--r-goal", "1", "--json").stdout)
    assert data["modes"] == ["slow", "fast"]
    assert data["references"] == [[0.0], [1.0]]
    assert data["energy"] is None


def test_plan_options(model: str, engine: Any) -> None:
    good = Verdict(Status.CERTIFIED, because("proved"), time=(0.0, 1.0), margin=0.5, energy=1.0)
    engine.update({("slow", "far"): good, ("far", "fast"): good})

    def modes(*options: str) -> list[str]:
        result = run("plan", model, "--from", "slow", "--to", "fast", "--json", *options)
        assert result.exit_code == 0, result.output
        return list(loads(result.stdout)["modes"])

    assert modes() == ["slow", "fast"]
    assert modes("--minimize", "time") == ["slow", "far", "fast"]
    assert modes("--minimize", "time=1,switches=3") == ["slow", "fast"]
    assert modes("--minimize", "time", "--max-switches", "1") == ["slow", "fast"]
    assert modes("--minimize", "time", "--avoid", "far") == ["slow", "fast"]
    assert modes("--via", "far") == ["slow", "far", "fast"]
    assert modes("--task", "go") == ["slow", "far", "fast"]
    assert modes("--task", "go", "--minimize", "switches") == ["slow", "fast"]


def test_plan_from_a_state(model: str) -> None:
    data = loads(run("plan", model, "--start", "-2", "--to", "fast", "--json").stdout)
    assert data["modes"] == ["slow", "fast"]
    assert loads(run("plan", model, "--task", "home", "--json").stdout)["modes"] == ["slow", "fast"]


def test_plan_exit_codes_where_there_is_no_plan(model: str, engine: Any) -> None:
    ask = ("plan", model, "--from", "fast", "--to", "slow")
    no = run(*ask)
    assert no.exit_code == 1
    assert "no undecided pair could help" in no.stderr
    engine["fast", "slow"] = Verdict(Status.UNDECIDED, because("too wide"))
    open_ = run(*ask, "--json")
    assert open_.exit_code == 3
    data = loads(open_.stdout)
    assert data["reachable"] == ["fast"]
    assert data["helpful"] == [["fast", "slow"]]


def test_simulate(model: str, tmp_path: Path) -> None:
    plot = tmp_path / "plot.png"
    result = run("simulate", model, "--from", "slow", "--to", "fast", "--start", "-4", "-o", str(plot))
    assert result.exit_code == 0, result.output
    assert "enters fast" in result.stdout
    assert plot.stat().st_size > 1000
    assert str(plot) in result.stdout
    data = loads(run("simulate", model, "--task", "go", "--start", "2", "--json").stdout)
    assert data["run"]["ok"] is True
    assert data["plan"]["modes"] == ["slow", "fast"]


def test_simulate_without_a_start_draws_one_and_says_so(model: str) -> None:
    result = run("simulate", model, "--from", "slow", "--to", "fast")
    assert result.exit_code == 0
    assert "drawn from the start set of 'slow'" in result.stderr


def test_simulate_from_outside(model: str) -> None:
    outside = ("simulate", model, "--from", "slow", "--to", "fast", "--start", "7")
    assert run(*outside).exit_code == 1
    assert run(*outside, "--force").exit_code == 0


def test_explain(model: str) -> None:
    result = run("explain", model, "fast", "far", "--r-i", "1", "--seconds", "3")
    assert result.exit_code == 0
    assert "fast -> far: refuted" in result.stdout
    data = loads(run("explain", model, "fast", "far", "--r-i", "1", "--seconds", "0", "--json").stdout)
    assert (data["status"], data["r_i"], data["repairs"]) == ("refuted", [1.0], [])
    assert data["notes"]
    assert {"closest", "worst_start", "blocking", "missing"} <= set(data)
    assert "seconds must be" in wrong(run("explain", model, "fast", "far", "--r-i", "1", "--seconds", "-1"))
    assert loads(run("explain", model, "slow", "fast", "--json").stdout)["status"] == "certified"


@pytest.mark.parametrize("name", ["report", "export", "store", "new", "doctor"])
def test_commands_of_later_versions_say_so(name: str) -> None:
    for arguments in ([], ["model.py", "--from", "a", "-o", "x"]):
        assert "not built yet" in wrong(run(name, *arguments))


def test_no_such_file(engine: Any, tmp_path: Path) -> None:
    assert "there is no file" in wrong(run("build", str(tmp_path / "none.py")))
    assert "not a file" in wrong(run("build", str(tmp_path)))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("x = 1\n", "does not define `modes`"),
        ("modes = 3\n", "`modes` must be a list"),
        ("modes = []\n", "empty"),
        ("modes = [1]\n", "expected a Mode"),
        ("def (\n", "not valid Python"),
        ("\n\nmodes = 1 / 0\n", "line 3: ZeroDivisionError"),
        ("import nothing_of_this_name\n", "ModuleNotFoundError"),
        ("import modegraph as mg\nmodes = [mg.Box([1], [0])]\n", "line 2"),
        ("raise SystemExit(5)\n", "ended the program"),
        (MODEL + "tasks = 3\n", "`tasks` must be a dict"),
        (MODEL + "period = 0.1\n", "period= is not built yet"),
        (MODEL + "horizon = -1\n", "horizon must be a positive"),
        ("\0\0", "not valid Python"),
    ],
)
def test_a_file_that_is_no_model(tmp_path: Path, engine: Any, text: str, told: str) -> None:
    path = tmp_path / "bad.py"
    path.write_text(text)
    assert told in wrong(run("build", str(path)))


def test_a_file_that_is_no_python(tmp_path: Path, engine: Any) -> None:
    path = tmp_path / "plot.png"
    path.write_bytes(b"\x89PNG")
    assert "not a Python file" in wrong(run("build", str(path)))


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--from", "slwo", "--to", "fast"], "did you mean 'slow'"),
        (["--from", "slow", "--to", "fsat"], "did you mean 'fast'"),
        (["--from", "slow", "--to", "fast", "--via", "fra"], "did you mean 'far'"),
        (["--from", "slow"], "give --to"),
        (["--to", "fast"], "give --from"),
        (["--task", "og"], "did you mean 'go'"),
        (["--task", "odd"], "unknown entry 'target'"),
        (["--from", "slow", "--to", "fast", "--minimize", "money"], "minimize='money'"),
        (["--from", "slow", "--to", "fast", "--minimize", "time=x"], "is not a weight"),
        (["--from", "slow", "--to", "fast", "--minimize", "length"], "is unknown; use"),
        (["--from", "slow", "--to", "fast", "--r-goal", "a,b"], "not a list of numbers"),
        (["--from", "slow", "--to", "fast", "--r-goal", "3"], "names no reference"),
        (["--from", "slow", "--to", "fast", "--start", "1,2"], "shape (1,)"),
    ],
)
def test_wrong_calls(model: str, arguments: list[str], told: str) -> None:
    assert told in wrong(run("plan", model, *arguments))
    failed = run("plan", model, *arguments, "--json")
    assert told in loads(failed.stdout)["error"]


def test_the_shipped_examples_are_found() -> None:
    assert shipped_example("arm").name == "two_link_arm.py"
    assert "did you mean 'arm'" in wrong(run("demo", "arn"))


def test_examples_installed_with_the_package_come_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "site" / "modegraph"
    for folder in (package / "examples", tmp_path / "examples"):
        folder.mkdir(parents=True)
        (folder / "two_link_arm.py").write_text(MODEL)
    monkeypatch.setattr(model_file, "__file__", str(package / "model_file.py"))
    assert shipped_example("arm").parent == package / "examples"
    (package / "examples" / "two_link_arm.py").unlink()
    assert shipped_example("arm").parent == tmp_path / "examples"
    assert "was not installed" in wrong(run("demo", "point-mass"))


def test_demo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, model: str) -> None:
    monkeypatch.setattr(cli, "shipped_example", lambda name: Path(model))
    monkeypatch.chdir(tmp_path)
    result = run("demo", "arm")
    assert result.exit_code == 0, result.output
    assert "slow fast" in result.stdout
    assert str(tmp_path / "modegraph-arm.png") in result.stdout
    assert (tmp_path / "modegraph-arm.png").stat().st_size > 1000


def test_a_program_of_its_own_without_traceback(tmp_path: Path) -> None:
    path = tmp_path / "bad.py"
    path.write_text("modes = undefined_name\n")
    done = subprocess.run(
        [sys.executable, "-m", "modegraph", "build", str(path)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "NameError" in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
