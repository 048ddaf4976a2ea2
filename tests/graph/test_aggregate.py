from __future__ import annotations

import numpy as np

from modegraph.certify.verdict import Status, Verdict, Witness
from modegraph.graph.aggregate import every_member, some_pair
from tests.graph.fakes import because, certified

P = [np.array([0.0]), np.array([1.0]), np.array([2.0])]
WITNESS = Witness(np.array([0.1]), None, {}, 2.0, "horizon")


def refuted(margin: float | None = None, horizon: float | None = None) -> Verdict:
    return Verdict(Status.REFUTED, because("stays outside"), margin=margin, witness=WITNESS, horizon=horizon)


def undecided(margin: float | None = None, until: float | None = None) -> Verdict:
    return Verdict(Status.UNDECIDED, because("too wide"), margin=margin, until=until)


def test_one_certified_pair_is_enough_and_the_figures_hold_for_all_certified_pairs() -> None:
    v = some_pair(
        [
            (P[0], P[1], refuted()),
            (
                P[1],
                P[1],
                certified(2.0, earliest=0.5, energy=1.0, margin=0.9, slack={"u": 2.0, "v": 1.0}, window=3.0),
            ),
            (P[2], P[1], certified(1.0, earliest=0.7, energy=4.0, margin=0.2, slack={"u": 1.0}, window=1.0)),
        ]
    )
    assert v.status is Status.CERTIFIED
    assert v.time == (0.5, 2.0)
    assert (v.energy, v.margin, v.window) == (4.0, 0.2, 1.0)
    assert v.slack == {"u": 1.0}
    assert "2 of 3 pairs" in v.reason
    assert "from reference [1] to [1]: proved" in v.reason


def test_a_bound_that_one_pair_lacks_is_unknown() -> None:
    v = some_pair([(P[0], None, certified(energy=None)), (P[1], None, certified(energy=3.0, margin=None))])
    assert v.energy is None
    assert v.margin is None


def test_refuted_only_if_every_pair_is() -> None:
    v = some_pair([(P[0], P[1], refuted(-2.0, 5.0)), (P[1], P[0], refuted(-0.5))])
    assert v.status is Status.REFUTED
    assert v.margin == -0.5
    assert v.witness is not None
    assert v.witness.r_i is P[1]
    assert v.witness.r_j is P[0]
    assert v.horizon == 5.0
    mixed = some_pair([(P[0], P[1], refuted()), (P[1], P[0], undecided(-0.3, 1.5))])
    assert mixed.status is Status.UNDECIDED
    assert mixed.witness is None
    assert mixed.until == 1.5
    assert "undecided for 1 of 2 pairs of references, refuted for the others" in mixed.reason


def test_a_single_pair_keeps_its_reason_and_names_the_references_of_its_witness() -> None:
    v = some_pair([(P[0], None, refuted())])
    assert v.reason == "stays outside"
    assert v.witness is not None
    assert v.witness.r_i is P[0]


def test_a_check_is_for_every_member() -> None:
    good = Verdict(Status.CERTIFIED, because("proved"), slack={"u": 1.0}, tracking=np.array([0.1, 0.4]))
    better = Verdict(Status.CERTIFIED, because("proved"), slack={"u": 2.0}, tracking=np.array([0.2, 0.3]))
    both = every_member([(P[0], good), (P[1], better)])
    assert both.status is Status.CERTIFIED
    assert both.slack == {"u": 1.0}
    assert both.tracking is not None
    assert list(both.tracking) == [0.2, 0.4]
    one_open = every_member([(P[0], good), (P[1], undecided(until=3.0)), (P[2], undecided(until=2.0))])
    assert one_open.status is Status.UNDECIDED
    assert one_open.until == 2.0
    assert "2 of 3 references, e.g. [1]: too wide" in one_open.reason
    one_bad = every_member([(P[0], undecided()), (P[1], refuted())])
    assert one_bad.status is Status.REFUTED
    assert one_bad.witness is not None
    assert one_bad.witness.r_i is P[1]
    assert every_member([(None, good)]) is good
