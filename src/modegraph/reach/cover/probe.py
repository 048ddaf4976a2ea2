"""A run of low degree over a class of references, which shows in which variables its flow is nearly straight."""

from __future__ import annotations

import numpy as np

from modegraph.reach.compiled import CompiledMode
from modegraph.reach.cover.chain import Chain
from modegraph.reach.cover.degrees import class_orders, pipe_orders
from modegraph.reach.cover.looseness import is_loose, is_very_loose
from modegraph.reach.flow.records import Order
from modegraph.reach.start.piece import Piece

FEEDING = 0.5
"""Share of a remainder that comes from itself, at which the run has shown enough."""
STRAIGHT = 0.2
"""A variable counts twice where its nonlinear terms are smaller than this, relative to the geometric mean."""


def orders_of(compiled: CompiledMode, piece: Piece, end: float) -> list[Order]:
    """Degrees to try for a piece until ``end`` seconds, lowest first."""
    found = pipe_orders(compiled, piece.variables)
    if not compiled.parameters or compiled.flat or len(found) == 1:
        return found
    probe = Chain(compiled, piece, found[0])
    disturbed = bool(compiled.w_radius.any())
    done = probe.run(end, _feeds_itself if disturbed else None)
    if done and not disturbed and not is_loose(probe):
        return found[:1]
    return class_orders(_weights(probe), disturbed, low=disturbed or (done and not is_very_loose(probe)))


def _feeds_itself(chain: Chain) -> bool:
    """Whether the remainder of a disturbed flow comes mostly from itself: it is about to break down in small steps."""
    return chain.flows[-1].feedback > FEEDING


def _weights(chain: Chain) -> tuple[int, ...]:
    flow = chain.flows[0]
    exponents = flow.bounds.exponents
    share = np.zeros(flow.piece.variables)
    for step in flow.steps:
        size = np.abs(step.p)
        scale = np.maximum(size[:, 1:].sum(axis=1), 1e-300)
        for v in range(len(share)):
            share[v] = max(share[v], float((size[:, exponents[:, v] > 1].sum(axis=1) / scale).max()))
    typical = np.exp(np.log(np.maximum(share, 1e-12)).mean())
    return tuple(np.where(share < STRAIGHT * typical, 2, 1).tolist())
