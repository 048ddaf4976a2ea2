"""Readable infix text of a node, for error messages, reasons and tape labels."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

from modegraph.expression.ops import (
    ADD,
    ADDC,
    ATAN,
    CONST,
    COS,
    EXP,
    LOG,
    MUL,
    MULC,
    RECIP,
    RELU,
    SIN,
    SQR,
    STEP,
    SUB,
    VAR,
    WHERE,
)  # fmt: skip

if TYPE_CHECKING:
    from modegraph.expression.graph import Nodes

SUM, PRODUCT, POWER, ATOM = 0, 1, 2, 3
"""Binding strength of a text: it needs brackets inside anything stronger."""

KEPT = 240
_FUNCTIONS = {SIN: "sin", COS: "cos", EXP: "exp", LOG: "log", ATAN: "arctan", STEP: "step"}


def number(value: Fraction) -> str:
    """A constant for reading: at most 6 significant digits."""
    if value.denominator == 1 and abs(value.numerator) < 10**9:
        return str(value.numerator)
    try:
        return f"{float(value):.6g}"
    except OverflowError:
        return "huge" if value > 0 else "-huge"


def shorten(text: str, width: int) -> str:
    """Cut the middle out of a text that is longer than `width`."""
    if len(text) <= width:
        return text
    head = (width - 3) // 2
    return f"{text[:head]}...{text[len(text) - (width - 3 - head) :]}"


def render(graph: Nodes, index: int, width: int) -> str:
    """Infix text of a node, at most `width` characters."""
    return shorten(_text(graph, index)[0], width)


def _text(graph: Nodes, index: int) -> tuple[str, int]:
    known = graph.texts
    if index not in known:
        for k in graph.reachable([index]):
            if k not in known:
                text, level = _compose(graph, k)
                known[k] = (text, level) if len(text) <= KEPT else (shorten(text, KEPT), ATOM)
    return known[index]


def _compose(graph: Nodes, index: int) -> tuple[str, int]:
    op, a, b, c, const = graph.nodes[index]

    def inner(k: int, level: int) -> str:
        text, own = graph.texts[k]
        return text if own >= level else f"({text})"

    origin = graph.origins.get(index)
    if origin is not None:
        kind, operands = origin
        name = {"max": "maximum", "min": "minimum"}.get(kind, kind)
        return f"{name}({', '.join(_text(graph, k)[0] for k in operands)})", ATOM
    if op == CONST and const is not None:
        return number(const), ATOM if const >= 0 else SUM
    if op == VAR:
        return graph.names[a], ATOM
    if op == ADD:
        second = graph.texts[b][0]
        if graph.nodes[b].op == MULC and second.startswith("-"):
            return f"{inner(a, SUM)} - {second[1:]}", SUM
        return f"{inner(a, SUM)} + {inner(b, PRODUCT)}", SUM
    if op == SUB:
        return f"{inner(a, SUM)} - {inner(b, PRODUCT)}", SUM
    if op == ADDC and const is not None:
        return f"{inner(a, SUM)} {'+' if const > 0 else '-'} {number(abs(const))}", SUM
    if op == MULC and const is not None:
        if const == -1:
            return f"-{inner(a, PRODUCT)}", SUM
        return f"{number(const)}*{inner(a, POWER)}", PRODUCT if const > 0 else SUM
    if op == MUL:
        for top, bottom in ((a, b), (b, a)):
            if graph.nodes[bottom].op == RECIP:
                return f"{inner(top, PRODUCT)}/{inner(graph.nodes[bottom].a, ATOM)}", PRODUCT
        return f"{inner(a, PRODUCT)}*{inner(b, POWER)}", PRODUCT
    if op == SQR:
        return f"{inner(a, ATOM)}**2", POWER
    if op == RECIP:
        return f"1/{inner(a, ATOM)}", PRODUCT
    if op == RELU:
        return f"maximum({inner(a, SUM)}, 0)", ATOM
    if op == WHERE:
        return f"where({inner(c, SUM)} > 0, {inner(a, SUM)}, {inner(b, SUM)})", ATOM
    return f"{_FUNCTIONS[op]}({inner(a, SUM)})", ATOM
