"""The width of the reachable set as sampled: no sound width is smaller. Floats, nothing is proved here."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853, solve_ivp

from benchmarks.case import Case
from modegraph.expression.evaluate import Evaluator
from modegraph.reach.compiled import CompiledMode, compile_mode
from modegraph.reach.field import Field

Floats = NDArray[np.float64]

STARTS, DISTURBED_STARTS = 4000, 100
MOST_CORNERS = 2048
PERIODS = 150
"""Intervals on which a sampled disturbance is constant."""
TIGHT = {"rtol": 1e-10, "atol": 1e-12}


def sampled_spread(case: Case) -> Floats:
    """Largest minus smallest end value (n,) over corners, edges' middles and random starts.

    A disturbance is sampled by the signals that are worst, for each state, along the run of the centre.
    """
    compiled = compile_mode(case.mode(), None, observed=False)
    disturbed = bool(compiled.w_radius.any())
    x, d = _starts(case, compiled, DISTURBED_STARTS if disturbed else STARTS)
    if not disturbed:
        w = np.repeat(compiled.w_centre[:, None], x.shape[1], axis=1)
        for fld in compiled.fields:
            x = _run(fld, x, w, d, fld.start, min(fld.end, case.until))
        return np.asarray(np.ptp(x, axis=1))
    signals = _worst_signals(case, compiled)
    count = x.shape[1]
    many = np.tile(x, signals.shape[2])
    unknown = np.tile(d, signals.shape[2])
    for k, (fld, a, b) in enumerate(_intervals(case, compiled)):
        many = _run(fld, many, np.repeat(signals[k], count, axis=1), unknown, a, b)
    return np.asarray(np.ptp(many, axis=1))


def _starts(case: Case, compiled: CompiledMode, count: int) -> tuple[Floats, Floats]:
    """States (n, N) and unknowns with parameters (nd, N): the centre, corners (all, or some), then random ones."""
    constants = [*compiled.unknowns.values(), *compiled.parameters]
    lo = np.concatenate([case.start.lo, [lo for lo, _ in constants]])
    hi = np.concatenate([case.start.hi, [hi for _, hi in constants]])
    free = np.flatnonzero(hi > lo)
    rng = np.random.default_rng(5)
    signs = np.zeros((1, len(lo)))
    most = min(MOST_CORNERS, count // 2)
    corners = list(itertools.product((-1.0, 1.0), repeat=len(free))) if 2 ** len(free) <= most else None
    block = np.zeros((most if corners is None else len(corners), len(lo)))
    block[:, free] = rng.choice([-1.0, 1.0], (most, len(free))) if corners is None else corners
    inside = np.zeros((count - len(block), len(lo)))
    inside[:, free] = rng.uniform(-1.0, 1.0, (len(inside), len(free)))
    # Extremes are often on a face, with one or two coordinates inside.
    faces = rng.random(inside.shape) < 0.6
    inside = np.where(faces, np.sign(inside), inside)
    points = np.vstack([signs, block, inside])
    values = (0.5 * (lo + hi) + 0.5 * (hi - lo) * points).T
    return values[: case.start.dim], values[case.start.dim :]


def _run(fld: Field, x: Floats, w: Floats, d: Floats, a: float, b: float) -> Floats:
    """States (n, N) at time b, all starts together."""
    if b <= a:
        return x
    evaluate = Evaluator(fld.rates)
    n, count = x.shape
    inputs = np.vstack([x, np.zeros((1, count)), w, d])

    def rate(t: float, y: Floats) -> Floats:
        inputs[:n] = y.reshape(n, count)
        inputs[n] = t
        return evaluate(inputs)[:n].ravel()

    solver = DOP853(rate, a, x.ravel(), b, **TIGHT)
    while solver.status == "running":
        solver.step()
    if solver.status == "failed":
        raise ArithmeticError("the sampled runs cannot be integrated")
    return np.asarray(solver.y.reshape(n, count))


def _intervals(case: Case, compiled: CompiledMode) -> list[tuple[Field, float, float]]:
    found = []
    for fld in compiled.fields:
        a, b = fld.start, min(fld.end, case.until)
        if b > a:
            marks = np.linspace(a, b, max(2, round(PERIODS * (b - a) / case.until)) + 1)
            found += [(fld, float(s), float(t)) for s, t in itertools.pairwise(marks)]
    return found


def _worst_signals(case: Case, compiled: CompiledMode) -> Floats:
    """Disturbances (intervals, nw, 2 n + 2 nw): for each state the two that push it furthest, and constant ones."""
    n, nw = compiled.fields[0].states, len(compiled.w_centre)
    intervals = _intervals(case, compiled)
    x, d = _starts(case, compiled, 2)
    x, d = x[:, :1], d[:, :1]
    slopes = []
    pushes = np.zeros((len(intervals), n, nw))
    for k, (fld, a, b) in enumerate(intervals):
        slope = Evaluator(fld.jacobian)
        column = np.concatenate([x[:, 0], [a], compiled.w_centre, d[:, 0]])[:, None]
        values = slope(column)[:, 0]
        A = values[: n * n].reshape(n, n)
        pushes[k] = values[n * n : n * (n + nw)].reshape(n, nw)
        slopes.append(
            solve_ivp(lambda t, v, A=A: (A @ v.reshape(n, n)).ravel(), (0.0, b - a), np.eye(n).ravel()).y[:, -1]
        )
        x = _run(fld, x, compiled.w_centre[:, None], d, a, b)
    signals = np.zeros((len(intervals), nw, 2 * n + 2 * nw))
    adjoint = np.eye(n)
    for k in range(len(intervals) - 1, -1, -1):
        sign = np.sign(adjoint @ pushes[k]).T
        signals[k, :, :n], signals[k, :, n : 2 * n] = sign, -sign
        adjoint = adjoint @ slopes[k].reshape(n, n)
    signals[:, :, 2 * n : 2 * n + nw], signals[:, :, 2 * n + nw :] = np.eye(nw), -np.eye(nw)
    return np.asarray(compiled.w_centre[:, None] + compiled.w_radius[:, None] * signals)
