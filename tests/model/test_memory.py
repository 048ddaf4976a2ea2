"""Memory of dynamic controllers."""

import pytest

import modegraph as mg
from modegraph.errors import ModegraphError


def test_keeps_what_it_was_given():
    def dynamics(x, r):
        return r - x[:1]

    def reset(x, r):
        return [0.0]

    memory = mg.Memory("integral", dynamics, reset)
    assert memory.states == ("integral",)
    assert memory.dynamics is dynamics
    assert memory.reset is reset
    assert memory.k == 1
    assert mg.Memory(2, dynamics, reset).states == ("z[0]", "z[1]")


@pytest.mark.parametrize(
    "given, words",
    [
        ((0, len, len), "empty"),
        (("a", 1, len), "dynamics must be a function"),
        (("a", len, None), "reset must be a function"),
    ],
)
def test_bad_memories(given, words):
    with pytest.raises(ModegraphError, match="Memory") as error:
        mg.Memory(*given)
    assert words in str(error.value)
