"""The quick start of the README runs as it stands, and its tables name things that exist."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

import modegraph as mg

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def quick_start() -> dict[str, Any]:
    blocks = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)
    assert len(blocks) == 2
    names: dict[str, Any] = {}
    exec(compile(blocks[0], "README.md", "exec"), names)
    return names


@pytest.fixture(scope="module")
def classes(quick_start: dict[str, Any]) -> dict[str, Any]:
    """The second block goes on where the first ends."""
    names = dict(quick_start)
    exec(compile(re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)[1], "README.md", "exec"), names)
    return names


def test_the_plan_is_the_one_the_text_promises(quick_start: dict[str, Any]) -> None:
    plan = quick_start["plan"]
    assert plan.modes == ["gentle", "brisk"]
    earliest, latest = plan.time
    assert 0.0 <= earliest <= latest <= 20.0


def test_the_run_goes_through(quick_start: dict[str, Any]) -> None:
    run, plan = quick_start["run"], quick_start["plan"]
    assert run.ok
    assert len(run.switch_times) == 1
    assert run.switch_times[0] <= plan.time[1]
    assert run.mode[0] == "gentle"
    assert run.mode[-1] == "brisk"


def test_both_directions_and_the_checks(quick_start: dict[str, Any]) -> None:
    graph = quick_start["graph"]
    assert graph.verdict("brisk", "gentle").status is mg.Status.CERTIFIED
    assert str(graph.explain("brisk", "gentle"))
    for name in ("gentle", "brisk"):
        assert graph.check(name).status is mg.Status.CERTIFIED


def test_the_planner_chooses_references(classes: dict[str, Any]) -> None:
    plan, pairs = classes["plan"], classes["pairs"]
    assert len(plan.references) == len(plan.modes) >= 3
    assert pairs.contains([0.2], [0.25])
    assert not pairs.contains([0.2], [0.5])
    lower, upper = pairs.volume
    assert 0.0 < lower <= upper < 4.0
    assert plan.simulate([-0.6, 0.1]).ok


def test_public_names_in_the_text_exist() -> None:
    for name in set(re.findall(r"\bmg\.(\w+)", README)):
        assert hasattr(mg, name), name


def test_files_in_the_text_exist() -> None:
    for link in re.findall(r"\]\((?!http)([^)]+)\)", README):
        assert (Path(__file__).parents[1] / link).exists(), link
