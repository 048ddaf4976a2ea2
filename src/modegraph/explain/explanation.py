"""Why there is, or is not, a switch: what ``ModeGraph.explain`` returns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from modegraph.certify.approach import OWN_SIZE
from modegraph.certify.reason import size_text
from modegraph.certify.references import Parameter, parameter_text
from modegraph.certify.verdict import Approach, Floats, Status, Verdict, Widths
from modegraph.explain.repairs import Repair

Origin = Literal["counterexample", "sampled", "middle", ""]

ORIGIN = {
    "counterexample": "that of the counterexample, proved to be a start",
    "sampled": "the worst of the sampled starts",
    "middle": "the middle of the worst part of the starts",
}


@dataclass(frozen=True, eq=False)
class Blocking:
    """What stands in the way of an absent switch, or is nearest to it for a present one.

    Attributes
    ----------
    kind : {"face", "constraint", "horizon"}
    name : str
        A face of the set to be entered, in words ("position <= 0.1"); the name of a constraint; "the horizon of 2 s".
    missing : float
        How much is missing, in ``unit``; negative: the room that is left.
    unit : str
    time : float or None
        Seconds after entering the source: of the closest approach to the face, or from when on the constraint
        cannot be proved.
    """

    kind: Literal["face", "constraint", "horizon"]
    name: str
    missing: float
    unit: str
    time: float | None = None


@dataclass(frozen=True, eq=False)
class Explanation:
    """Why there is, or is not, a switch; ``str()`` is the text.

    Attributes
    ----------
    source, target : str
    verdict : Verdict
    text : str
    r_i, r_j : array or None
        The references it is about: those given, or the pair that decides the verdict.
    closest : Approach or None
        The closest approach to the target: of the counterexample's trajectory where there is one, else of
        everything that the worst part of the starts can reach. None where none was computed.
    reach : Approach or None
        That of everything the worst part of the starts can reach.
    worst_start : (n,) array or None
        The start to look at; ``worst_start_is`` says what is known of it.
    worst_start_is : {"counterexample", "sampled", "middle", ""}
        Proved to be a start that fails; the worst of some sampled starts; the middle of the worst part.
    block : Blocking or None
        What stands in the way; ``blocking`` and ``missing`` are its name and its number.
    repairs : tuple of Repair
        Changes that were proved to give the switch.
    notes : tuple of str
        Which repairs were not found, and why.
    """

    source: str
    target: str
    verdict: Verdict
    text: str = ""
    r_i: Parameter = None
    r_j: Parameter = None
    closest: Approach | None = None
    reach: Approach | None = None
    worst_start: Floats | None = None
    worst_start_is: Origin = ""
    block: Blocking | None = None
    repairs: tuple[Repair, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def blocking(self) -> str:
        """The face or constraint in the way, in words; "" where it is not known."""
        return "" if self.block is None else self.block.name

    @property
    def missing(self) -> float | None:
        """What is missing there, in its unit; negative: the room that is left."""
        return None if self.block is None else self.block.missing

    def __str__(self) -> str:
        return self.text


def explanation_text(e: Explanation, several: bool) -> str:
    """The explanation for a person; ``several``: the modes have other references too."""
    lines = _verdict_lines(e.source, e.target, e.verdict)
    if several and (e.r_i is not None or e.r_j is not None):
        lines.append(f"  told of the references {parameter_text(e.r_i)} to {parameter_text(e.r_j)}")
    lines += _approach_lines(e)
    if e.repairs:
        lines.append("  repairs, each proved on the changed modes as build does it:")
        lines += [f"    {repair.kind}: {repair.text}" for repair in e.repairs]
    if e.notes:
        lines.append("  no other repair is known:" if e.repairs else "  no repair is known:")
        lines += [f"    {note}" for note in e.notes]
    if e.verdict.widths is not None:
        lines += _widths_table(e.verdict.widths)
    return "\n".join(lines)


def _approach_lines(e: Explanation) -> list[str]:
    lines = []
    certified = e.verdict.status is Status.CERTIFIED
    if e.closest is not None and e.closest is not e.reach:
        lines.append(
            f"  closest approach of the counterexample (validated): {size_text(e.closest.gauge)} "
            f"at t = {e.closest.time:.4g} s"
        )
    if e.reach is not None:
        at = f"{size_text(e.reach.gauge)} at t = {e.reach.time:.4g} s"
        what = "deepest inside" if certified else "closest approach"
        lines.append(f"  {what}, of all that the worst part of the starts can reach: {at}")
    if e.block is not None:
        b = e.block
        unit = f" {b.unit}" if b.unit == OWN_SIZE else f" ({b.unit})" if b.unit else ""
        if certified:
            lines.append(f"  nearest face: {b.name}, {-b.missing:.4g}{unit} of room")
        else:
            when = "" if b.time is None else f" at t = {b.time:.4g} s"
            lines.append(f"  blocked by: {b.name}, {b.missing:.4g}{unit} missing{when}")
    near = e.reach or e.closest
    if near is not None and near.detail:
        lines.append(f"    farthest out is {near.detail}")
    if e.worst_start is not None and not certified:
        lines.append(f"  worst start: {parameter_text(e.worst_start)} ({ORIGIN[e.worst_start_is]})")
    return lines


def _verdict_lines(i: str, j: str, v: Verdict) -> list[str]:
    lines = [f"{i} -> {j}: {v.status.value}", f"  {v.reason}"]
    if v.time is not None:
        lines.append(f"  time: enters between {v.time[0]:.6g} and {v.time[1]:.6g} s")
    for label, value, unit in (
        ("margin", v.margin, ""),
        ("energy", v.energy, ""),
        ("stays inside", None if v.window == math.inf else v.window, " s"),
        ("examined up to", v.horizon, " s"),
        ("constraints proved up to", v.until, " s"),
    ):
        if value is not None:
            lines.append(f"  {label}: {value:.4g}{unit}")
    if v.window == math.inf:
        lines.append("  stays inside: for ever")
    for name, slack in v.slack.items():
        lines.append(f"  slack of {name}: {slack:.4g}")
    if v.witness is not None:
        w = v.witness
        what = {
            "violates": f"violates a constraint at {w.time:.6g} s",
            "trapped": f"never arrives (trapped from {w.time:.6g} s on)",
            "horizon": f"has not arrived by {w.time:.6g} s",
        }[w.kind]
        lines.append(f"  counterexample: the start x0 = {parameter_text(np.asarray(w.x0))} {what}")
        if w.w is not None:
            lines.append(f"    with the constant disturbance w = {parameter_text(w.w)}")
        if w.d:
            lines.append("    with " + ", ".join(f"{n} = {value:.6g}" for n, value in w.d.items()))
        if w.r_i is not None:
            lines.append(f"    with r_i = {parameter_text(w.r_i)}")
        if w.r_j is not None:
            lines.append(f"    with r_j = {parameter_text(w.r_j)}")
    return lines


def _widths_table(widths: Widths) -> list[str]:
    """Lines of a table: one row an instant, one column a state."""
    columns = [max(len(name), 9) for name in widths.states]
    lines = ["  width of the reach set over time:"]
    lines.append(
        "    " + f"{'t, s':>9s}" + "".join(f"  {n:>{c}s}" for n, c in zip(widths.states, columns, strict=True))
    )
    for t, row in zip(widths.times, widths.values, strict=True):
        lines.append(f"    {t:9.4g}" + "".join(f"  {value:>{c}.4g}" for value, c in zip(row, columns, strict=True)))
    return lines
