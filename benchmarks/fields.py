"""Systems without an input: oscillators, enzymes, a stiff reaction, predator and prey."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

import modegraph as mg
from benchmarks.case import Case, around, autonomous

VDP_START = mg.Box([1.25, 2.35], [1.55, 2.45])
CVDP_START = mg.Box([1.25, 2.35] * 2, [1.55, 2.45] * 2)
LALO_CENTRE = (1.2, 1.05, 1.5, 2.4, 1.0, 0.1, 0.45)


def van_der_pol(start: mg.Box, *, disturbance: float = 0.0, limit: float | None = None) -> mg.Mode:
    def field(x: Any) -> Any:
        return np.array([x[1], (1 - x[0] ** 2) * x[1] - x[0]])

    def pushed(x: Any, w: Any) -> Any:
        return field(x) + np.array([0.0, w[0]])

    if disturbance:
        box = mg.Box([-disturbance], [disturbance])
        mode = autonomous("van der Pol, pushed", pushed, "x y", start, disturbance=box)
    else:
        mode = autonomous("van der Pol", field, "x y", start)
    if limit is not None:
        mode = mode.replace(constraints=lambda x: {"y": x[1] <= limit})
    return mode


def coupled_van_der_pol(start: mg.Box, *, b: tuple[float, float], limit: float | None = None) -> mg.Mode:
    def field(x: Any, d: Any) -> Any:
        x1, y1, x2, y2 = x
        pull = d["b"] * (x2 - x1)
        return np.array([y1, (1 - x1**2) * y1 + pull - x1, y2, (1 - x2**2) * y2 - pull - x2])

    mode = autonomous("coupled van der Pol", field, "x1 y1 x2 y2", start, unknowns={"b": b})
    if limit is not None:
        mode = mode.replace(constraints=lambda x: {"y": x[1::2] <= limit})
    return mode


def laub_loomis(start: mg.Box) -> mg.Mode:
    def field(x: Any) -> Any:
        x1, x2, x3, x4, x5, x6, x7 = x
        return np.array(
            [
                1.4 * x3 - 0.9 * x1,
                2.5 * x5 - 1.5 * x2,
                0.6 * x7 - 0.8 * x2 * x3,
                2 - 1.3 * x3 * x4,
                0.7 * x1 - x4 * x5,
                0.3 * x1 - 3.1 * x6,
                1.8 * x6 - 1.5 * x2 * x7,
            ]
        )

    return autonomous("Laub-Loomis", field, "x1 x2 x3 x4 x5 x6 x7", start)


def robertson(start: mg.Box, *, b: float, g: float) -> mg.Mode:
    def field(x: Any) -> Any:
        first, second, third = x
        forth = 0.4 * first - b * second * third
        return np.array([-forth, forth - g * second**2, g * second**2])

    return autonomous("Robertson", field, "x y z", start)


def lotka_volterra(start: mg.Box) -> mg.Mode:
    return autonomous(
        "Lotka-Volterra", lambda x: np.array([3 * x[0] - 3 * x[0] * x[1], x[0] * x[1] - x[1]]), "x y", start
    )


CASES = [
    Case("VDP", van_der_pol, VDP_START, 7.0),
    Case("VDP y <= 2.75", partial(van_der_pol, limit=2.75), VDP_START, 7.0),
    *(Case(f"VDP, w +-{w:g}", partial(van_der_pol, disturbance=w), VDP_START, 7.0) for w in (0.01, 0.1)),
    *(Case(f"LALO20 W = {w:g}", laub_loomis, around(LALO_CENTRE, [w] * 7), 20.0) for w in (0.01, 0.05, 0.1)),
    Case("CVDP23 b in [1, 3]", partial(coupled_van_der_pol, b=(1.0, 3.0)), CVDP_START, 7.0),
    Case("CVDP23 y <= 2.75", partial(coupled_van_der_pol, b=(1.0, 3.0), limit=2.75), CVDP_START, 7.0),
    Case("CVDP b in [.95, 1.05]", partial(coupled_van_der_pol, b=(0.95, 1.05)), CVDP_START, 7.0),
    *(
        Case(f"ROBE25 b = {b:g}, g = {g:g}", partial(robertson, b=b, g=g), around((1.0, 0.0, 0.0), [0.0] * 3), 40.0)
        for b, g in ((1e2, 1e3), (1e3, 1e5))
    ),
    Case("LOVO25, no guard", lotka_volterra, around((1.3, 1.0), (0.012, 0.0)), 3.64),
]
