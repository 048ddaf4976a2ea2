"""Maps of R^ij show what the relation says."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import modegraph as mg
from tests.certify.class_graphs import double_integrators


@pytest.fixture(scope="module", params=[1, 2])
def graph(request: Any) -> mg.ModeGraph:
    goal = mg.Target("goal", mg.Ball(np.zeros(2 * request.param), 0.4))
    return mg.build([*double_integrators(request.param), goal], horizon=12.0)


def drawn(ax: Any) -> Any:
    (image,) = ax.images
    return np.asarray(image.get_array())


def test_a_map_holds_the_statuses(graph: mg.ModeGraph) -> None:
    refs = graph.references("wide", "narrow")
    k = graph.regions["wide"].dim
    values = drawn(refs.plot(r_i=None if k == 1 else np.full(k, 0.3)))
    assert set(np.unique(values)) >= {-1, 1}
    ticks = np.linspace(-1.0, 1.0, len(values))
    rng = np.random.default_rng(1)
    for row, column in rng.integers(0, len(values), (40, 2)):
        if k == 1:
            source, target = [ticks[column]], [ticks[row]]
        else:
            source, target = [0.3] * k, [ticks[column], ticks[row]]
        assert values[row, column] == refs.statuses([source], [target])[0]


def test_a_finite_side_leaves_the_other(graph: mg.ModeGraph) -> None:
    refs = graph.references("wide", "goal")
    k = graph.regions["wide"].dim
    ax = refs.plot()
    assert drawn(ax).shape[0] == (1 if k == 1 else drawn(ax).shape[1])
    assert ax.get_xlabel() == "r_i[0]"
    labels = {text.get_text() for text in ax.get_legend().get_texts()}
    assert labels >= {"certified", "refuted"}


def test_what_cannot_be_drawn_is_told(graph: mg.ModeGraph) -> None:
    refs = graph.references("wide", "narrow")
    k = graph.regions["wide"].dim
    with pytest.raises(mg.ModegraphError, match="not in the class"):
        refs.plot(r_i=np.full(k, 3.0))
    with pytest.raises(mg.ModegraphError, match="one or two parameters"):
        refs.plot(dims=(0, 1, 2))
