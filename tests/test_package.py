"""The public names of the package, and what using them loads."""

import subprocess
import sys

import pytest

import modegraph as mg
from modegraph.errors import NotBuiltYet

MOST_LOADED = 60
"""Files of the package behind the building blocks of a model."""
CODE = """
import sys
import modegraph as mg
for name in ("System", "Mode", "Target", "Memory", "Polytope", "setpoint", "minimum_time"):
    getattr(mg, name)
print(*sys.modules)
"""


def test_a_model_is_stated_without_what_proofs_and_drawings_need():
    answer = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=True)
    loaded = answer.stdout.split()
    assert not {"numba", "scipy", "matplotlib", "flint", "clarabel", "rich", "typer"} & set(loaded)
    own = {name.split(".")[1] for name in loaded if name.startswith("modegraph.")}
    assert not {"reach", "certify", "graph", "plan", "explain", "run", "report"} & own
    assert sum(name.startswith("modegraph.") for name in loaded) < MOST_LOADED


def test_names_are_listed_and_found():
    assert {"System", "build", "Unreachable", "largest_start"} <= set(dir(mg))
    assert set(mg.__all__) <= set(dir(mg))
    assert set(mg._HOME) | {"ModegraphError", "ModegraphWarning", "NotBuiltYet", "Unreachable", "load"} == set(
        mg.__all__
    )
    assert mg.Status.CERTIFIED.value == "certified"
    assert mg.Box is mg.Box


@pytest.mark.parametrize("name", sorted(mg._HOME))
def test_every_name_has_a_home(name):
    assert getattr(mg, name).__name__ == name


def test_what_is_not_built_says_so():
    for ask in (lambda: mg.load("file"), lambda: mg.Supervisor):
        with pytest.raises(NotBuiltYet, match="not built yet"):
            ask()


def test_unknown_names():
    with pytest.raises(AttributeError, match="no attribute 'Boxes'"):
        mg.Boxes  # noqa: B018
