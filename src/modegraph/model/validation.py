"""Checks on a list of modes before any work is done on it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from modegraph.errors import ModegraphError
from modegraph.model.class_start import class_start
from modegraph.model.mode import Mode
from modegraph.model.start import mode_start
from modegraph.model.target import Target


def validate_modes(modes: Iterable[Mode | Target]) -> tuple[Mode | Target, ...]:
    """Check the list a graph is built from.

    Names are unique, all modes have the same states, targets live in them, and every start set exists
    for every reference.

    Returns
    -------
    tuple of Mode and Target
        In the order given.

    Raises
    ------
    ModegraphError
        Names mode, function and remedy.
    """
    listed = _listed(modes)
    real = [mode for mode in listed if isinstance(mode, Mode)]
    if not real:
        raise ModegraphError("there are targets but no mode; add the modes whose controllers reach them")
    _require_unique_names(listed)
    _require_same_states(real)
    for target in listed:
        if not isinstance(target, Target):
            continue
        target.settle(real[0].system.n)
        if target.set.dim != real[0].system.n:
            raise ModegraphError(
                f"target {target.name!r}: its set has {target.set.dim} coordinates but the plant has "
                f"{real[0].system.n} states ({', '.join(real[0].system.states)}); give one for each state"
            )
    for mode in real:
        if mode.reference.region is not None:
            class_start(mode)
            continue
        for p in mode.reference.parameters():
            mode_start(mode, p)
    return listed


def _listed(modes: Any) -> tuple[Mode | Target, ...]:
    if isinstance(modes, Mode | Target):
        raise ModegraphError(f"expected a list of modes, got one {type(modes).__name__}; put it in a list: [mode]")
    if isinstance(modes, str | Mapping) or not isinstance(modes, Iterable):
        raise ModegraphError(f"expected a list of modes, got {type(modes).__name__}; pass [mode_1, mode_2, ...]")
    listed = tuple(modes)
    if not listed:
        raise ModegraphError("the list of modes is empty; give at least one Mode")
    for k, mode in enumerate(listed):
        if not isinstance(mode, Mode | Target):
            raise ModegraphError(
                f"entry {k} of the list of modes is a {type(mode).__name__}, expected a Mode or a Target"
            )
    return listed


def _require_unique_names(modes: Sequence[Mode | Target]) -> None:
    seen: set[str] = set()
    for mode in modes:
        if mode.name in seen:
            raise ModegraphError(f"two modes are called {mode.name!r}; give every mode and target its own name")
        seen.add(mode.name)


def _require_same_states(modes: Sequence[Mode]) -> None:
    first = modes[0]
    for mode in modes[1:]:
        if mode.system.states != first.system.states:
            same = set(mode.system.states) == set(first.system.states)
            raise ModegraphError(
                f"mode {mode.name!r} has the states {', '.join(mode.system.states)} but mode "
                f"{first.name!r} has {', '.join(first.system.states)}; all modes share the same "
                "states" + (" in the same order" if same else " (dynamics, inputs and disturbance may differ)")
            )
