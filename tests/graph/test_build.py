"""``build`` around a proof engine that is replaced."""

from __future__ import annotations

import time
from typing import Any

import pytest

from modegraph import deadline as deadline_module
from modegraph.certify.reason import Outcome, Reason
from modegraph.certify.unit import UnitResult
from modegraph.certify.verdict import Status, Verdict
from modegraph.deadline import Deadline
from modegraph.errors import ModegraphError, NotBuiltYet
from modegraph.graph import build as build_module
from modegraph.graph.build import build
from modegraph.model.mode import Mode
from modegraph.model.reference import setpoint
from modegraph.model.sets import Box
from modegraph.model.target import Target
from tests.graph.fakes import PLANT, because, certified, mode

Engine = Any
BEGUN = 1000.0
SETTLED = Verdict(Status.CERTIFIED, because("for all time"))


@pytest.fixture
def engine(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Install a replacement for ``certify_unit``; it gets a unit's mode, p, targets and keywords."""

    def install(function: Any) -> None:
        monkeypatch.setattr(build_module, "certify_unit", function)

    return install


class Clock:
    """Stands for the module ``time`` of the deadlines; it goes on only where a unit says how long it works."""

    def __init__(self) -> None:
        self.now = BEGUN

    def monotonic(self) -> float:
        return self.now

    def work(self, deadline: Deadline) -> None:
        """Work until a deadline, and see that it is over."""
        self.now += max(0.0, deadline.left)
        assert deadline.is_over


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(deadline_module, "time", made)
    return made


def everything(mode: Any, p: Any, targets: Any, **_: Any) -> UnitResult:
    return UnitResult(verdicts=[certified() for _ in targets], check=SETTLED)


def test_units_targets_and_their_place_in_the_graph(engine: Engine) -> None:
    asked = []

    def fake(mode: Any, p: Any, targets: Any, *, horizon: Any, deadline: Deadline, progress: Any) -> UnitResult:
        asked.append((mode.name, float(p[0]), [(t.name, None if t.p is None else float(t.p[0])) for t in targets]))
        assert not deadline.is_over
        verdicts = [
            Verdict(Status.UNDECIDED, because(f"{mode.name}{p} to {t.name}{t.p}"), horizon=horizon) for t in targets
        ]
        return UnitResult(verdicts=verdicts, check=Verdict(Status.CERTIFIED, because(f"check {mode.name}{p}")))

    engine(fake)
    dock = Target("dock", Box([0], [1]))
    g = build([mode("a"), mode("b", 2), dock], horizon=5.0)
    assert sorted(asked) == [
        ("a", 0.0, [("b", 0.0), ("b", 1.0), ("dock", None)]),
        ("b", 0.0, [("a", 0.0), ("b", 1.0), ("dock", None)]),
        ("b", 1.0, [("a", 0.0), ("b", 0.0), ("dock", None)]),
    ]
    assert g.verdict("b", "a", r_i=1).reason == "b[1.] to a[0.]"
    assert g.verdict("b", "b", 0, 1).reason == "b[0.] to b[1.]"
    assert g.verdict("a", "dock").reason == "a[0.] to dockNone"
    assert g.check("b", 1).reason == "check b[1.]"


def test_horizon_of_the_mode_overrides_that_of_build(engine: Engine) -> None:
    seen = {}

    def fake(mode: Any, p: Any, targets: Any, *, horizon: Any, **_: Any) -> UnitResult:
        seen[mode.name] = horizon
        return everything(mode, p, targets)

    engine(fake)
    own = Mode("own", PLANT, controller=lambda x: -x, reference=setpoint([0.0]), start=Box([0], [1]), horizon=2.0)
    build([own, mode("a")], horizon=7.0)
    assert seen == {"own": 2.0, "a": 7.0}
    build([mode("a")])
    assert seen["a"] is None


def test_an_exception_of_the_engine_leaves_its_unit_undecided(engine: Engine) -> None:
    def fake(mode: Any, p: Any, targets: Any, **_: Any) -> UnitResult:
        if mode.name == "a":
            raise ZeroDivisionError("no luck")
        return everything(mode, p, targets)

    engine(fake)
    g = build([mode("a"), mode("b")])
    assert g.verdict("a", "b").status is Status.UNDECIDED
    (reason,) = g.verdict("a", "b").why
    assert reason == Reason(Outcome.ENGINE_STOPPED, error="ZeroDivisionError", text="no luck")
    assert g.check("a").status is Status.UNDECIDED
    assert g.verdict("b", "a").status is Status.CERTIFIED


def test_a_wrong_model_is_an_error(engine: Engine) -> None:
    def fake(mode: Any, p: Any, targets: Any, **_: Any) -> UnitResult:
        raise ModegraphError("mode 'a': the denominator may vanish")

    engine(fake)
    with pytest.raises(ModegraphError, match="denominator"):
        build([mode("a"), mode("b")])


def test_the_budget_ends(engine: Engine, clock: Clock) -> None:
    def fake(mode: Any, p: Any, targets: Any, *, deadline: Deadline, **_: Any) -> UnitResult:
        clock.work(deadline)
        return everything(mode, p, targets)

    engine(fake)
    g = build([mode(f"m{k}") for k in range(6)], budget=600.0)
    assert clock.now == pytest.approx(BEGUN + 600.0)
    assert {g.verdict(i, j).status for i in g.modes for j in g.modes if i != j} <= {
        Status.CERTIFIED,
        Status.UNDECIDED,
    }


def test_every_unit_gets_its_share_of_the_budget(engine: Engine, clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build_module, "COUNT", 2)
    shares = []

    def fake(mode: Any, p: Any, targets: Any, *, deadline: Deadline, **_: Any) -> UnitResult:
        shares.append(deadline.left)
        return everything(mode, p, targets)

    engine(fake)
    build([mode(f"m{k}") for k in range(6)], budget=60.0)
    # Three rounds of two, and no time goes by.
    assert sorted(shares) == [20.0, 20.0, 30.0, 30.0, 60.0, 60.0]


def test_what_its_share_cut_short_is_done_once_more(
    engine: Engine, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One unit needs more than its share; the others leave it enough: no answer depends on the share."""
    monkeypatch.setattr(build_module, "COUNT", 1)
    asked: list[str] = []

    def fake(mode: Any, p: Any, targets: Any, *, deadline: Deadline, **_: Any) -> UnitResult:
        asked.append(mode.name)
        if mode.name == "m1" and deadline.left < 100.0:
            clock.work(deadline)
            nothing = Verdict(Status.UNDECIDED, because("the budget ended"))
            return UnitResult([certified(), *[nothing] * (len(targets) - 1)], nothing)
        return everything(mode, p, targets)

    engine(fake)
    g = build([mode(f"m{k}") for k in range(4)], budget=240.0)
    assert asked.count("m1") == 2
    assert sum(asked.count(f"m{k}") for k in (0, 2, 3)) == 3
    assert all(g.verdict("m1", j).status is Status.CERTIFIED for j in ("m0", "m2", "m3"))
    assert g.check("m1").status is Status.CERTIFIED


def test_when_the_budget_is_over_nothing_is_done_again(
    engine: Engine, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(build_module, "COUNT", 1)
    asked: list[str] = []

    def fake(mode: Any, p: Any, targets: Any, *, deadline: Deadline, **_: Any) -> UnitResult:
        asked.append(mode.name)
        clock.work(deadline)
        return UnitResult(
            [Verdict(Status.UNDECIDED, because("late")) for _ in targets], Verdict(Status.UNDECIDED, because("late"))
        )

    engine(fake)
    build([mode("a"), mode("b")], budget=10.0)
    assert sorted(asked) == ["a", "b"]


def test_an_interrupt_keeps_what_was_decided(engine: Engine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build_module, "COUNT", 1)

    def fake(mode: Any, p: Any, targets: Any, *, progress: Any, **_: Any) -> UnitResult:
        while mode.name == "b":
            time.sleep(0.01)
            progress()
        return everything(mode, p, targets)

    def report(done: int, total: int, text: str) -> None:
        if done == 1:
            raise KeyboardInterrupt

    engine(fake)
    g = build([mode("a"), mode("b"), mode("c")], progress=report)
    assert g.verdict("a", "b").status is Status.CERTIFIED
    assert g.verdict("b", "a").why == g.check("c").why == (Reason(Outcome.INTERRUPTED),)


def test_progress_is_reported(engine: Engine) -> None:
    def fake(mode: Any, p: Any, targets: Any, *, progress: Any, **_: Any) -> UnitResult:
        progress("half way")
        return everything(mode, p, targets)

    engine(fake)
    calls: list[tuple[int, int, str]] = []
    build([mode("a"), mode("b")], progress=lambda *call: calls.append(call))
    assert calls[0] == (0, 2, "")
    assert calls[-1][:2] == (2, 2)
    assert any("a: half way" in text for _, _, text in calls)


@pytest.mark.parametrize("option", ["period", "noise", "store", "executor"])
def test_options_of_later_versions_are_refused(option: str) -> None:
    with pytest.raises(NotBuiltYet, match=option):
        build([mode("a")], **{option: 0})  # type: ignore[arg-type]


@pytest.mark.parametrize("option", ["horizon", "budget"])
@pytest.mark.parametrize("value", [0, -1.0, float("inf"), float("nan"), "10", True])
def test_horizon_and_budget_are_positive_and_finite(option: str, value: Any) -> None:
    with pytest.raises(ModegraphError, match=option):
        build([mode("a")], **{option: value})


@pytest.mark.parametrize("modes", [[], None, mode("a"), [mode("a"), mode("a")], [3]])
def test_wrong_lists_of_modes(modes: Any) -> None:
    with pytest.raises(ModegraphError):
        build(modes)
