"""Print the figures: python -m benchmarks (or make bench)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from benchmarks import anchors, cases, measure


def row(what: str, value: float, goal: tuple[float, str]) -> None:
    limit, unit = goal
    mark = "" if value <= limit else "   over"
    print(f"{what:44s} {value:9.2f} {unit:3s} goal {limit:g} {unit}{mark}")


def numbers(values: Sequence[float]) -> str:
    return " / ".join(f"{v:.3g}" for v in values)


def builds() -> None:
    goals = anchors.GOALS
    what = list(goals)
    row(what[0], measure.import_seconds(), goals[what[0]])
    cold = measure.build("two_link_arm", cold=True)
    warm = min((measure.build("two_link_arm") for _ in range(2)), key=lambda run: float(run["seconds"]))
    row(what[1], warm["seconds"], goals[what[1]])
    row(what[2], warm["megabytes"], goals[what[2]])
    row(what[3], cold["total"] - warm["total"], goals[what[3]])
    small = measure.build("point_mass")
    print(f"{'build point_mass.py, kernels compiled':44s} {small['seconds']:9.2f} s")
    for name, run in (("two_link_arm", warm), ("point_mass", small)):
        pairs, checks = Counter(run["statuses"]), Counter(run["checks"])
        print(f"    {name}: pairs {dict(pairs)}, checks {dict(checks)}")


def flowpipes() -> None:
    print(
        f"\n{'flowpipe':22s} {'seconds':>8s} {'steps':>6s} {'width':>22s} {'/ spread':>14s} "
        f"{'Flow* s':>8s} {'Flow* width':>16s}  others"
    )
    for anchor, mode, until in (
        (anchors.VDP, cases.van_der_pol(), 7.0),
        (anchors.LALO, cases.laub_loomis(), 20.0),
        (anchors.ARM_0, cases.arm_0(), 3.0),
    ):
        figure = measure.flowpipe(mode, until, anchor.states)
        ratios = [w / s for w, s in zip(figure.widths, anchor.spread, strict=True)]
        print(
            f"{anchor.name:22s} {figure.seconds:8.3f} {figure.steps:6d} {numbers(figure.widths):>22s} "
            f"{numbers(ratios):>14s} {anchor.flowstar_seconds:8.1f} {numbers(anchor.flowstar_width):>16s}  "
            f"{anchor.others}"
        )
        if not figure.complete:
            print(f"    incomplete: {figure.reason}")


if __name__ == "__main__":
    builds()
    flowpipes()
