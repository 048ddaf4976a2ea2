"""A row of text for what a case showed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from benchmarks.figures import Figures

HEADER = (
    f"{'case':28s} {'seconds':>8s} {'goal':>5s} {'steps':>6s} {'pieces':>6s} {'width':>19s} {'/ spread':>13s} "
    f"{'goal':>5s} {'Flow* s':>8s} {'/ Flow* width':>13s}  remarks"
)


def numbers(values: Sequence[float]) -> str:
    return " / ".join(f"{v:.3g}" for v in values)


def ratios(values: Sequence[float], to: Sequence[float]) -> list[float]:
    return [v / t if t > 0.0 else float("nan") for v, t in zip(values, to, strict=True)]


def missed(figures: Figures, seen: dict[str, Any]) -> list[str]:
    """Which figures miss their goals, or the row of Flow*."""
    found = []
    if not seen.get("complete"):
        found.append("incomplete")
    if figures.seconds is not None and not seen.get("seconds", float("inf")) <= figures.seconds:
        found.append("seconds")
    widths = seen.get("widths", [])
    if figures.ratio is not None and not all(r <= figures.ratio for r in ratios(widths, seen.get("spread", widths))):
        found.append("width")
    if figures.own is not None and not seen.get("own", float("inf")) <= figures.own:
        found.append("width of one reference")
    if seen.get("holds") is False:
        found.append("property")
    return found


def row(name: str, figures: Figures, seen: dict[str, Any]) -> str:
    """One line; columns without a figure hold a dash."""

    def number(value: Any, form: str) -> str:
        return format(value, form) if value is not None else "-"

    widths = seen.get("widths", [])
    to_spread = numbers(ratios(widths, seen["spread"])) if "spread" in seen else "-"
    to_flowstar = numbers(ratios(widths, figures.flowstar_width)) if widths and figures.flowstar_width else "-"
    remarks = [text for text in (seen.get("reason"), figures.others) if text]
    if figures.holds is not None and "holds" in seen:
        remarks.insert(0, f"{figures.holds[0]}: {'proved' if seen['holds'] else 'not proved'}")
    if figures.own is not None and "own" in seen:
        remarks.insert(0, f"one reference: at most {seen['own']:.3g} times its own flowpipe (goal {figures.own:g})")
    over = missed(figures, seen)
    if over:
        remarks.insert(0, f"over ({', '.join(over)})")
    return (
        f"{name:28s} {number(seen.get('seconds'), '.3f'):>8s} {number(figures.seconds, 'g'):>5s} "
        f"{number(seen.get('steps'), 'd'):>6s} {number(seen.get('pieces'), 'd'):>6s} {numbers(widths) or '-':>19s} "
        f"{to_spread:>13s} {number(figures.ratio, 'g'):>5s} {number(figures.flowstar_seconds, 'g'):>8s} "
        f"{to_flowstar:>13s}  {'; '.join(remarks)}"
    ).rstrip()
