"""``build`` around a proof engine that is replaced."""

from __future__ import annotations

import time
from typing import Any

import pytest

from modegraph.certify.reason import Outcome, Reason
from modegraph.certify.unit import UnitResult
from modegraph.certify.verdict import Status, Verdict
from modegraph.errors import ModegraphError, NotBuiltYet
from modegraph.graph import build as build_module
from modegraph.graph.build import build
from modegraph.model.mode import Mode
from modegraph.model.reference import setpoint
from modegraph.model.sets import Box
from modegraph.model.target import Target
from tests.graph.fakes import PLANT, because, certified, mode

Engine = Any
SETTLED = Verdict(Status.CERTIFIED, because("for all time"))


@pytest.fixture
def engine(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Install a replacement for ``certify_unit``; it gets a unit's mode, p, targets and keywords."""

    def install(function: Any) -> None:
        monkeypatch.setattr(build_module, "certify_unit", function)

    return install


def everything(mode: Any, p: Any, targets: Any, **_: Any) -> UnitResult:
    return UnitResult(verdicts=[certified() for _ in targets], check=SETTLED)


def test_units_targets_and_their_place_in_the_graph(engine: Engine) -> None:
    asked = []

    def fake(mode: Any, p: Any, targets: Any, *, horizon: Any, deadline: float, progress: Any) -> UnitResult:
        asked.append((mode.name, float(p[0]), [(t.name, None if t.p is None else float(t.p[0])) for t in targets]))
        assert deadline > time.monotonic()
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


def test_the_budget_ends(engine: Engine) -> None:
    def fake(mode: Any, p: Any, targets: Any, *, deadline: float, **_: Any) -> UnitResult:
        time.sleep(max(0.0, deadline - time.monotonic()))
        return everything(mode, p, targets)

    engine(fake)
    began = time.monotonic()
    g = build([mode(f"m{k}") for k in range(6)], budget=0.3)
    assert time.monotonic() - began < 2.0
    assert {g.verdict(i, j).status for i in g.modes for j in g.modes if i != j} <= {
        Status.CERTIFIED,
        Status.UNDECIDED,
    }


def test_every_unit_gets_its_share_of_the_budget(engine: Engine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build_module, "COUNT", 2)
    shares = []

    def fake(mode: Any, p: Any, targets: Any, *, deadline: float, **_: Any) -> UnitResult:
        shares.append(deadline - time.monotonic())
        return everything(mode, p, targets)

    engine(fake)
    build([mode(f"m{k}") for k in range(6)], budget=60.0)
    assert min(shares) > 19.0
    assert max(shares) <= 60.0


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
