"""Judges certificates by independent integration: a certificate is an upper bound on what any run may do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

import modegraph as mg
from tests.soundness.adversary import signals
from tests.soundness.loop import Loop, Signal, Trajectory, run
from tests.soundness.sets import excess, starts

Vector = np.ndarray


@dataclass(frozen=True)
class Violation:
    """One run that contradicts a certificate."""

    source: str
    target: str
    kind: str
    time: float
    amount: float
    start: tuple[float, ...]

    def __str__(self) -> str:
        pair = f"{self.source} -> {self.target}"
        return f"{pair}: {self.kind} at t = {self.time:.6g} by {self.amount:.3g} from {self.start}"


@dataclass(frozen=True)
class Claim:
    """A certified switch, as far as a run can contradict it."""

    target: str
    region: Any
    time: tuple[float, float]
    energy: float | None = None


def claims(verdicts: Mapping[str, tuple[Any, mg.Verdict]]) -> list[Claim]:
    """The certified ones among {target name: (set, verdict)}."""
    return [
        Claim(name, region, v.time, v.energy)
        for name, (region, v) in verdicts.items()
        if v.status is mg.Status.CERTIFIED and v.time is not None
    ]


def examine(
    mode: Any,
    made: Sequence[Claim],
    *,
    runs: int,
    seed: int = 0,
    p: Any = None,
    signal: Signal | None = None,
    breaks: Sequence[float] = (),
) -> list[Violation]:
    """Integrate ``runs`` random starts of the mode and hold every claim against each of them."""
    if not made:
        return []
    rng = np.random.default_rng(seed)
    unknowns = mode.system.unknowns or {}
    found: list[Violation] = []
    until = max(max(claim.time[1] for claim in made), 1e-6)
    points = starts(Loop(mode, p, _draw(unknowns, rng, 0), signal, tuple(breaks)).start_set(), runs, rng)
    sources = {}
    tolerance = None
    for k, x0 in enumerate(points):
        loop = Loop(mode, p, _draw(unknowns, rng, k), signal, tuple(breaks))
        aim = made[k % len(made)].region
        if id(aim) not in sources or unknowns:
            sources[id(aim)] = signals(loop, aim, rng)
        policy, hold = sources[id(aim)](k)
        trajectory = run(loop, x0, policy, hold, until)
        if tolerance is None:
            tolerance = integration_error(loop, x0, until)
        for claim in made:
            found += contradictions(loop, trajectory, claim, tolerance)
    return found


def _draw(unknowns: Mapping[str, tuple[float, float]], rng: np.random.Generator, k: int) -> dict[str, float]:
    if k % 2:
        return {name: float(rng.choice(list(bounds))) for name, bounds in unknowns.items()}
    return {name: float(rng.uniform(*bounds)) for name, bounds in unknowns.items()}


def integration_error(loop: Loop, x0: Vector, until: float) -> float:
    """Measured: largest difference of two runs at different tolerances, interpolation included, tenfold."""
    policy = lambda t, y: loop.rest
    usual = run(loop, x0, policy, np.inf, until)
    sharp = run(loop, x0, policy, np.inf, until, rtol=2.5e-14, atol=1e-16, max_step=0.05)
    worst = max(
        (
            float(np.max(np.abs(y - sharp.at(t))))
            for t, y in zip(usual.t[::7], usual.y[::7], strict=True)
            if t <= sharp.ended
        ),
        default=0.0,
    )
    return 10.0 * worst + 1e-13


def contradictions(loop: Loop, trajectory: Trajectory, claim: Claim, tolerance: float) -> list[Violation]:
    """What in this run the claim forbids."""
    earliest, latest = claim.time
    start = tuple(float(v) for v in trajectory.y[0])
    name = loop.mode.name

    def violation(kind: str, time: float, amount: float) -> Violation:
        return Violation(name, claim.target, kind, time, amount, start)

    entry = first_entry(loop, trajectory, claim.region, latest, tolerance)
    if entry is None:
        inside = trajectory.t <= latest
        least = float(np.min(excess(claim.region, trajectory.y[inside][:, : loop.n])))
        return [violation("has not entered the target", latest, least)]
    found = []
    soon = trajectory.t < earliest
    depth = -excess(claim.region, trajectory.y[soon][:, : loop.n]) if soon.any() else np.zeros(0)
    if np.any(depth > tolerance):
        first = float(trajectory.t[soon][int(np.argmax(depth > tolerance))])
        found.append(violation("entered the target before the earliest time", first, earliest - first))
    for t, y, w in zip(trajectory.t, trajectory.y, trajectory.w, strict=True):
        if t > entry:
            break
        broken = loop.broken(float(t), y, w, blur=tolerance)
        if broken:
            found.append(violation(f"violated {', '.join(broken)}", float(t), 0.0))
            break
    if claim.energy is not None:
        spent = energy(trajectory, entry)
        if spent > claim.energy * (1 + 1e-6) + 1e-9:
            found.append(violation("spent more energy", entry, spent - claim.energy))
    return found


def first_entry(loop: Loop, trajectory: Trajectory, region: Any, latest: float, tolerance: float) -> float | None:
    """First instant up to ``latest`` at which the run is inside the set (closest approaches are refined)."""
    t = trajectory.t
    value = excess(region, trajectory.y[:, : loop.n])
    last = int(np.searchsorted(t, latest, side="right"))
    for k in range(last):
        if value[k] <= tolerance:
            return float(t[k]) if k == 0 else _bisect(loop, trajectory, region, t[k - 1], t[k], tolerance)
        low = 0 < k < last - 1 and value[k] <= value[k - 1] and value[k] <= value[k + 1]
        if (low or k == last - 1) and t[max(k - 1, 0)] < min(t[min(k + 1, len(t) - 1)], latest):
            lo, hi = float(t[max(k - 1, 0)]), float(min(t[min(k + 1, len(t) - 1)], latest))
            dip = minimize_scalar(
                lambda s: float(excess(region, trajectory.at(s)[: loop.n])[0]),
                bounds=(lo, hi),
                method="bounded",
                options={"xatol": 1e-9},
            )
            if dip.fun <= tolerance:
                return float(dip.x)
    return None


def _bisect(loop: Loop, trajectory: Trajectory, region: Any, outside: float, inside: float, tolerance: float) -> float:
    while inside - outside > 1e-11:
        middle = (inside + outside) / 2
        if excess(region, trajectory.at(middle)[: loop.n])[0] <= tolerance:
            inside = middle
        else:
            outside = middle
    return float(inside)


def energy(trajectory: Trajectory, until: float) -> float:
    """Integral of u'u over the whole integrator steps before ``until`` (Boole's rule on five samples)."""
    power = np.sum(trajectory.u**2, axis=1)
    keep = trajectory.t <= until
    t, power = trajectory.t[keep], power[keep]
    if len(t) < 2:
        return 0.0
    total = 0.0
    for k in range(0, len(t) - 4, 5):
        h = (t[k + 4] - t[k]) / 4
        total += 2 * h / 45 * float(np.dot([7, 32, 12, 32, 7], power[k : k + 5]))
    return total


def refutation_holds(
    mode: Any,
    region: Any,
    verdict: mg.Verdict,
    horizon: float,
    *,
    p: Any = None,
    signal: Signal | None = None,
    breaks: Sequence[float] = (),
) -> str | None:
    """None if an independent run agrees with the witness, else what disagrees."""
    witness = verdict.witness
    if witness is None:
        return "refuted without a witness"
    loop = Loop(mode, p, dict(witness.d), signal, tuple(breaks))
    start = loop.start_set()
    n_start = len(witness.x0) if getattr(start, "dim", loop.n) > loop.n else loop.n
    if not start.contains(np.asarray(witness.x0)[:n_start]):
        return f"the witness {witness.x0} is not in the start set"
    w = loop.rest if witness.w is None else np.asarray(witness.w)
    until = max(witness.time * 1.02 + 1e-3 if witness.kind == "violates" else horizon, 1e-3)
    trajectory = run(loop, np.asarray(witness.x0), lambda t, y: w, np.inf, until)
    tolerance = 1e-9
    entry = first_entry(loop, trajectory, region, until, -tolerance)
    if witness.kind in ("trapped", "horizon"):
        if entry is None:
            return None
        broken = _first_broken(loop, trajectory)
        return None if broken is not None and broken <= entry else f"the witness enters the target at t = {entry}"
    broken = _first_broken(loop, trajectory) or _broken_near(loop, trajectory, witness.time)
    if broken is None:
        return f"the witness violates nothing up to t = {until}" if trajectory.ended >= until else None
    return None if entry is None or broken <= entry else f"the witness is in the target before t = {broken}"


def _broken_near(loop: Loop, trajectory: Trajectory, time: float) -> float | None:
    """A violation too short for the integrator's own samples, looked for around the claimed instant."""
    reach = np.concatenate([np.linspace(0, 0.02, 400), np.geomspace(1e-9, 0.02, 60)])
    for t in np.sort(np.concatenate([time - reach, time + reach])):
        if 0.0 <= t <= trajectory.ended and loop.broken(float(t), trajectory.at(float(t)), trajectory.w[0]):
            return float(t)
    return None


def _first_broken(loop: Loop, trajectory: Trajectory) -> float | None:
    for t, y, w in zip(trajectory.t, trajectory.y, trajectory.w, strict=True):
        if loop.broken(float(t), y, w):
            return float(t)
    return None
