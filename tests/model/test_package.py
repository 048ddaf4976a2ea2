"""The public names of the package and the price of importing it."""

import subprocess
import sys

import pytest

import modegraph as mg
from modegraph.errors import NotBuiltYet

CODE = """
import sys, time
begun = time.perf_counter()
import modegraph as mg
for name in ("System", "Mode", "Target", "Memory", "Polytope", "setpoint", "minimum_time"):
    getattr(mg, name)
print(time.perf_counter() - begun)
print([name for name in ("numba", "scipy", "matplotlib", "flint") if name in sys.modules])
"""


def test_import_is_fast_and_light():
    answer = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=True)
    seconds, loaded = answer.stdout.splitlines()
    assert float(seconds) < 0.5
    assert loaded == "[]"


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
