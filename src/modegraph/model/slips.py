"""Models that are legitimate and yet hardly what their author meant: a warning each."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from functools import cache
from types import FunctionType, ModuleType
from typing import Any

import numpy as np

from modegraph.errors import ModegraphWarning
from modegraph.expression.ops import VAR
from modegraph.expression.scalar import Expr, Graph
from modegraph.model.closed_loop import ClosedLoop
from modegraph.model.mode import Mode
from modegraph.model.reference import Reference, Setpoint
from modegraph.model.trajectory import Trajectory


def warn_of_slips(modes: Sequence[Mode], loops: Sequence[Sequence[ClosedLoop]]) -> None:
    """Warn of inputs that nothing reads, and of functions made in a loop that are all the same.

    Parameters
    ----------
    loops : the closed loops of each mode, one for each of its references.
    """
    for text in [*_idle_inputs(modes, loops), *_twins(modes, loops)]:
        warnings.warn(text, ModegraphWarning, stacklevel=4)


def _idle_inputs(modes: Sequence[Mode], loops: Sequence[Sequence[ClosedLoop]]) -> Iterator[str]:
    told: set[int] = set()
    for mode, own in zip(modes, loops, strict=True):
        if id(mode.system) in told or not own[0].idle:
            continue
        told.add(id(mode.system))
        names = ", ".join(map(repr, own[0].idle))
        yield (
            f"the dynamics of {mode.system.label} (mode {mode.name!r}) never read the input {names}: whatever a "
            "controller does with it has no effect. Use it in the dynamics, or leave it out of inputs="
        )


def _twins(modes: Sequence[Mode], loops: Sequence[Sequence[ClosedLoop]]) -> Iterator[str]:
    """Modes with the same closed loop, though each was given a function of its own, made by the same line."""

    @cache
    def structure(k: int) -> list[tuple[Any, ...]]:
        return [_structure(loop) for loop in loops[k]]

    def alike(i: int, k: int) -> bool:
        a, b = modes[i], modes[k]
        return bool(_made_alike(a, b) and _same_references(a.reference, b.reference) and structure(i) == structure(k))

    groups: list[list[int]] = []
    for k in range(len(modes)):
        group = next((group for group in groups if alike(group[0], k)), None)
        if group is None:
            groups.append([k])
        else:
            group.append(k)
    for first, *others in groups:
        if not others:
            continue
        names = ", ".join(repr(modes[k].name) for k in (first, *others))
        role = _made_alike(modes[first], modes[others[0]])
        yield (
            f"the modes {names} are one and the same closed loop, though the {role} of each is a function of its own. "
            "Was it made in a loop? A function looks its names up when it is called, so all of them use the last "
            "value: bind it, as in `lambda x, k=k: ...`. If the same is meant, give all of them the same function "
            "object"
        )


def _functions(mode: Mode) -> dict[str, FunctionType]:
    """The functions that shape the closed loop and were made by a def or a lambda."""
    memory = mode.memory
    found = {"controller": mode.controller, "dynamics": mode.system.dynamics}
    found |= {} if memory is None else {"memory dynamics": memory.dynamics, "memory reset": memory.reset}
    return {role: function for role, function in found.items() if isinstance(function, FunctionType)}


def _made_alike(a: Mode, b: Mode) -> str:
    """The role in which two modes have functions of one line that nothing tells apart; "" for none.

    Functions from two calls of one factory, such as ``pd(1, 2)``, are not meant, unless the starts are the same, too.
    """
    theirs = _functions(b)
    for role, f in _functions(a).items():
        g = theirs.get(role)
        if g is None or f is g or f.__code__ is not g.__code__:
            continue
        if _binds_late(f, g) or a.start is b.start:
            return role
    return ""


def _binds_late(f: FunctionType, g: FunctionType) -> bool:
    """Whether two functions of the same code share the variables they look up, as those made in one loop do."""
    if f.__defaults__ or f.__kwdefaults__ or g.__defaults__ or g.__kwdefaults__:
        return False
    if f.__closure__ and g.__closure__:
        return all(x is y for x, y in zip(f.__closure__, g.__closure__, strict=True))
    looked_up = [f.__globals__[name] for name in f.__code__.co_names if name in f.__globals__]
    at_top_level = "<locals>" not in f.__qualname__
    return at_top_level and any(not callable(value) and not isinstance(value, ModuleType) for value in looked_up)


def _same_references(a: Reference, b: Reference) -> bool:
    if a is b:
        return True
    if type(a) is not type(b) or a.duration != b.duration or a.breakpoints != b.breakpoints:
        return False
    if (a.region is None) != (b.region is None):
        return False
    if a.region is not None:
        if a.region != b.region:
            return False
    elif not _equal(a.parameters(), b.parameters()):
        return False
    if isinstance(a, Setpoint):
        return True
    assert isinstance(a, Trajectory)
    graph = Graph()
    time = graph.variable("t")
    parameters = graph.variables([f"p[{k}]" for k in range(a.region.dim)]) if a.region is not None else None
    return all(
        [e.index for piece in a.pieces(graph, time, p, "") for e in piece.value]
        == [e.index for piece in b.pieces(graph, time, p, "") for e in piece.value]
        for p in ([parameters] if parameters is not None else a.parameters())
    )


def _equal(a: Sequence[Any], b: Sequence[Any]) -> bool:
    return len(a) == len(b) and all(
        (p is None and q is None) or (p is not None and q is not None and np.array_equal(p, q))
        for p, q in zip(a, b, strict=True)
    )


def _structure(loop: ClosedLoop) -> tuple[Any, ...]:
    """The closed loop as nested tuples that two tracings share exactly where they compute the same."""
    return tuple(
        (
            segment.start,
            segment.end,
            _numbered([*segment.rhs, *(face.expr for face in segment.constraints), *loop.reset]),
            tuple(face.name for face in segment.constraints),
        )
        for segment in loop.segments
    )


def _numbered(exprs: Sequence[Expr]) -> tuple[Any, ...]:
    """The operations that make up expressions of one graph, numbered anew in the order of their use."""
    if not exprs:
        return ()
    graph = exprs[0].graph
    numbers: dict[int, int] = {}
    rows: list[tuple[Any, ...]] = []
    for index in graph.reachable([e.index for e in exprs]):
        op, a, b, c, const = graph.nodes[index]
        operands = (graph.names[a],) if op == VAR else tuple(numbers.get(k, -1) for k in (a, b, c))
        numbers[index] = len(rows)
        rows.append((op, operands, const))
    return tuple(rows), tuple(numbers[e.index] for e in exprs)
