from __future__ import annotations

import numpy as np
import pytest

from modegraph.certify.verdict import Status, Verdict, Witness
from modegraph.errors import ModegraphError, NotBuiltYet
from modegraph.graph.modegraph import ModeGraph
from modegraph.model.memory import Memory
from modegraph.model.mode import Mode
from modegraph.model.reference import setpoint
from modegraph.model.sets import Box
from modegraph.model.target import Target
from tests.graph.fakes import PLANT, UNDECIDED, because, certified, graph, mode


@pytest.fixture
def small() -> ModeGraph:
    return graph(
        ["a", mode("b", 3), Target("dock", Box([-0.1], [0.1]))],
        {
            ("a", ("b", 0)): certified(1.0),
            ("a", ("b", 2)): certified(3.0, earliest=0.5, margin=0.1),
            ("a", ("b", 1)): UNDECIDED,
            ("b", "b"): certified(2.0),
            (("b", 0), ("b", 1)): UNDECIDED,
            (("b", 0), "dock"): certified(0.0),
        },
        {("b", 1): Verdict(Status.UNDECIDED, because("no tail"), until=3.0)},
    )


def test_switches_are_the_certified_ones_in_mode_order(small: ModeGraph) -> None:
    assert [(s.source, s.target) for s in small.switches] == [("a", "b"), ("b", "b"), ("b", "dock")]
    first = small.switches[0]
    assert first.time == (0.0, 3.0)
    assert first.margin == 0.1
    assert [b[0] for _, b in first.references if b is not None] == [0.0, 2.0]
    assert first.references.volume == (2.0, 3.0)
    assert len(small.switches[1].references) == 5


def test_verdict_is_existential(small: ModeGraph) -> None:
    assert small.verdict("a", "b").status is Status.CERTIFIED
    assert small.verdict("a", "b", r_j=1).status is Status.UNDECIDED
    assert small.verdict("a", "b", None, [2.0]).time == (0.5, 3.0)
    assert small.verdict("a", "b", (), 2).time == (0.5, 3.0)
    assert small.verdict("b", "dock", r_i=1).status is Status.REFUTED
    assert small.verdict("b", "dock").status is Status.CERTIFIED
    assert small.verdict(small.modes["b"], small.modes["b"]).status is Status.CERTIFIED


def test_verdicts_that_mean_nothing(small: ModeGraph) -> None:
    with pytest.raises(ModegraphError, match="single reference"):
        small.verdict("a", "a")
    with pytest.raises(ModegraphError, match="to itself"):
        small.verdict("b", "b", 1, 1)
    with pytest.raises(ModegraphError, match="never left"):
        small.verdict("dock", "a")
    with pytest.raises(ModegraphError, match="never left"):
        small.check("dock")
    with pytest.raises(ModegraphError, match="did you mean 'dock'"):
        small.verdict("a", "dok")
    with pytest.raises(ModegraphError, match="there are a, b, dock"):
        small.verdict("a", "zzzz")
    with pytest.raises(ModegraphError, match="mode 'b'"):
        small.verdict("a", "b", r_j=5)
    with pytest.raises(ModegraphError, match="has no references"):
        small.verdict("b", "dock", r_j=5)


def test_check_is_for_the_whole_class(small: ModeGraph) -> None:
    assert small.check("a").status is Status.CERTIFIED
    assert small.check("b").status is Status.UNDECIDED
    assert small.check("b").until == 3.0
    assert small.check("b", r=0).status is Status.CERTIFIED


def test_modes_is_a_read_only_mapping_in_order(small: ModeGraph) -> None:
    assert list(small.modes) == ["a", "b", "dock"]
    with pytest.raises(TypeError):
        small.modes["c"] = mode("c")  # type: ignore[index]


def test_modes_at(small: ModeGraph) -> None:
    found = {name: [r[0] for r in refs.target if r is not None] for name, refs in small.modes_at([0.5])}
    assert found == {"a": [0.0], "b": [0.0, 1.0]}
    ((name, refs),) = small.modes_at([2.25])
    assert name == "b"
    assert (None, 2) in refs
    assert [name for name, _ in small.modes_at(0.05)] == ["a", "b", "dock"]
    assert small.modes_at([99.0]) == []
    with pytest.raises(ModegraphError, match="shape"):
        small.modes_at([0.0, 1.0])


def test_modes_at_decides_a_start_on_memory_by_the_reset() -> None:
    dynamic = Mode(
        "dynamic",
        PLANT,
        controller=lambda x, z: -x - z,
        reference=setpoint([0.0]),
        start=Box([-1, -0.5], [1, 0.5]),
        memory=Memory("z", lambda x: x, lambda x, r: x - r),
    )
    g = graph([dynamic], {})
    assert [name for name, _ in g.modes_at([0.5])] == ["dynamic"]
    assert g.modes_at([0.6]) == []


def test_explain_tells_reason_figures_and_counterexample() -> None:
    witness = Witness(np.array([0.25]), np.array([0.125]), {"m": 2.0}, 3.5, "trapped")
    g = graph(
        "ab",
        {
            ("a", "b"): Verdict(
                Status.REFUTED, because("never arrives [really]"), margin=-0.5, witness=witness, horizon=9.0
            ),
            ("b", "a"): certified(2.0, slack={"speed": 0.25}, window=1.0),
        },
    )
    told = g.explain("a", "b")
    assert told.verdict.status is Status.REFUTED
    for part in (
        "a -> b: refuted",
        "never arrives [really]",
        "-0.5",
        "[0.25]",
        "[0.125]",
        "m = 2",
        "3.5 s",
        "9 s",
    ):
        assert part in str(told)
    assert "slack of speed: 0.25" in str(g.explain("b", "a"))


def test_networkx_export(small: ModeGraph) -> None:
    networkx = pytest.importorskip("networkx")
    exported = small.to_networkx()
    assert isinstance(exported, networkx.DiGraph)
    assert set(exported.nodes) == set(small.submodes)
    kinds = {data["kind"] for _, _, data in exported.edges(data=True)}
    assert kinds == {"switch", "stay"}
    start = next(s for s in small.submodes if s.mode == "a")
    end = next(s for s in small.submodes if s.mode == "dock")
    assert networkx.shortest_path_length(exported, start, end, weight="switches") == 2


def test_what_later_versions_add_is_an_error_that_says_so(small: ModeGraph) -> None:
    for ask in (
        lambda: small.add(mode("c")),
        lambda: small.replace(mode("a")),
        lambda: small.remove("a"),
        lambda: small.save("file"),
        lambda: ModeGraph.load("file"),
    ):
        with pytest.raises(NotBuiltYet, match="not built yet"):
            ask()
