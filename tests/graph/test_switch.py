"""A switch as a value."""

from __future__ import annotations

from modegraph.graph.switch import Switch
from tests.graph.fakes import certified, graph


def test_text_and_identity() -> None:
    made = graph("ab", {("a", "b"): certified(2.0, earliest=0.5, margin=0.25)})
    (switch,) = made.switches
    assert repr(switch) == "Switch(a -> b, time 0.5..2)"
    assert (switch.source, switch.target, switch.time, switch.energy, switch.margin) == (
        "a",
        "b",
        (0.5, 2.0),
        1.0,
        0.25,
    )
    # Two switches with equal figures are two: a proof is of its own pair.
    twin = Switch(switch.source, switch.target, switch.references, switch.time, switch.energy, switch.margin)
    assert twin != switch
    assert len({twin, switch}) == 2
