from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

from modegraph.errors import ModegraphError
from modegraph.graph.modegraph import ModeGraph
from modegraph.model.sets import Box
from modegraph.model.target import Target
from modegraph.report.plots import save_plot
from tests.graph.fakes import certified, graph, mode


@pytest.fixture
def chain() -> ModeGraph:
    g = graph(
        ["a", mode("b", 2), Target("dock", Box([-0.1], [0.1]))],
        {("a", "b"): certified(0.0), ("b", "b"): certified(), (("b", 0), "dock"): certified(4.0)},
    )
    yield g
    plt.close("all")


def test_graph_plot_shows_every_mode(chain: ModeGraph) -> None:
    ax = chain.plot()
    texts = [t.get_text() for t in ax.texts]
    assert {"a", "b", "dock"} <= set(texts)
    figure, mine = plt.subplots()
    assert chain.plot(ax=mine) is mine
    assert figure.axes == [mine]


def test_plan_plot_has_one_row_for_each_mode(chain: ModeGraph) -> None:
    ax = chain.plan("a", "dock").plot()
    assert [t.get_text() for t in ax.get_yticklabels()] == ["a", "b [0]", "dock"]


def test_run_plot_shows_states_inputs_modes_and_switches(chain: ModeGraph) -> None:
    run = chain.plan("a", "dock").simulate([0.4])
    states, inputs = run.plot()
    assert [line.get_label() for line in states.lines][:1] == ["x"]
    assert [line.get_label() for line in inputs.lines][:1] == ["u"]
    assert np.array_equal(states.lines[0].get_ydata(), run.x[:, 0])
    assert [t.get_text() for t in states.texts] == ["b"]
    assert len(states.patches) == 1
    dotted = [line for line in states.lines if line.get_linestyle() == ":"]
    assert [line.get_xdata()[0] for line in dotted] == list(run.switch_times)
    _, mine = plt.subplots()
    assert run.plot(ax=mine) is mine


def test_save_plot(chain: ModeGraph, tmp_path: Path) -> None:
    axes = chain.plan("a", "dock").simulate([0.4]).plot()
    save_plot(axes, tmp_path / "run.png")
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(ModegraphError, match="cannot write"):
        save_plot(axes, tmp_path / "run.docx")
    with pytest.raises(ModegraphError, match="cannot write"):
        save_plot(axes, tmp_path / "no" / "folder" / "run.png")
