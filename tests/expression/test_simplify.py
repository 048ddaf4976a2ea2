"""Exact cancellation: same values, cheaper tape, obligations kept."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from modegraph.errors import ModegraphError
from modegraph.expression import Evaluator, Expr, Graph, TracedArray, as_vector, call, compile_tape, simplify
from modegraph.expression.simplify import Simplified
from modegraph.expression.tape import LOG, RECIP

Function = Callable[[Any, Any], Any]


def simplified(fn: Function, n: int, m: int = 0) -> tuple[list[Expr], Simplified, list[Expr]]:
    g = Graph()
    x, w = (
        TracedArray(g.variables([f"x{k}" for k in range(n)])),
        TracedArray(g.variables([f"w{k}" for k in range(m)])),
    )
    value = call(fn, {"x": x, "w": w}, role="dynamics", owner="test")
    exprs = as_vector(value, None, role="dynamics", owner="test", graph=g)
    result = simplify(exprs)
    variables = [*x, *w]
    before, after = compile_tape(exprs, variables), compile_tape(result.exprs, variables)
    points = np.random.default_rng(0).uniform(0.4, 1.6, (n + m, 30))
    np.testing.assert_allclose(Evaluator(after)(points), Evaluator(before)(points), rtol=1e-7, atol=1e-9)
    return exprs, result, variables


def two_link(m2: float, state: Any) -> tuple[Any, Any]:
    q, w = state[:2], state[2:]
    a, b, d = 1 / 3 + 4 / 3 * m2, 0.5 * m2, m2 / 3
    c, s = np.cos(q[1]), np.sin(q[1])
    inertia = np.array([[a + 2 * b * c, d + b * c], [d + b * c, d]])
    coriolis = np.array([[-b * s * w[1], -b * s * (w[0] + w[1])], [b * s * w[0], 0]])
    return inertia, coriolis


def computed_torque(x: Any, w: Any) -> Any:
    q, qd = x[:2], x[2:]
    inertia, coriolis = two_link(1.0, x)
    v = -np.array([16.0, 9.0]) * (q - np.array([1.0, 0.8])) - 8 * qd
    u = inertia @ v + coriolis @ qd
    return np.concatenate([qd, np.linalg.solve(inertia, u + (w if len(w) else 0.0) - coriolis @ qd)])


def test_two_link_computed_torque_collapses() -> None:
    _, result, variables = simplified(computed_torque, 4)
    tape = compile_tape(result.exprs, variables)
    assert tape.size <= 14
    assert RECIP not in tape.ops[:, 0]
    assert result.exprs[2].text() == "-16*(x0 - 1) - 8*x2"
    assert result.kinds == ["nonzero"]
    assert "cos(x1)" in result.dropped[0].text()
    assert compile_tape(result.guards, variables).ops[:, 0].tolist().count(RECIP) == 1


def test_a_disturbance_stays_over_the_determinant() -> None:
    exprs, result, variables = simplified(computed_torque, 4, 2)
    assert compile_tape(result.exprs, variables).size < compile_tape(exprs, variables).size
    assert result.dropped == [], "the determinant is still there"
    assert result.exprs[2].text().startswith("-16*(x0 - 1) - 8*x2")


def test_three_links_collapse() -> None:
    def fn(x: Any, w: Any) -> Any:
        q, qd = x[:3], x[3:]
        a, b, c, d, e, f = 3.1, 1.2, 0.4, 0.7, 0.3, 0.2
        c2, c3, c23 = np.cos(q[1]), np.cos(q[2]), np.cos(q[1] + q[2])
        s2, s3, s23 = np.sin(q[1]), np.sin(q[2]), np.sin(q[1] + q[2])
        m01, m02, m12 = b + d * c2 + 2 * e * c3 + f * c23, c + e * c3 + f * c23, c + e * c3
        inertia = np.array(
            [[a + 2 * d * c2 + 2 * e * c3 + 2 * f * c23, m01, m02], [m01, b + 2 * e * c3, m12], [m02, m12, c]]
        )
        bias = np.array([-(d * s2 + f * s23) * qd[1] ** 2, (d * s2 + f * s23) * qd[0] ** 2, e * s3 * qd[0] * qd[1]])
        gravity = 9.81 * np.array([np.cos(q[0]), np.cos(q[0] + q[1]), np.cos(q[0] + q[1] + q[2])])
        v = -16 * (q - np.array([1.0, 0.5, 0.3])) - 8 * qd
        u = inertia @ v + bias + gravity
        return np.concatenate([qd, np.linalg.solve(inertia, u - bias - gravity)])

    _, result, variables = simplified(fn, 6)
    tape = compile_tape(result.exprs, variables)
    assert tape.size <= 20
    assert RECIP not in tape.ops[:, 0]
    assert result.kinds == ["nonzero"]


def test_inverse_and_rotation() -> None:
    def inverse(x: Any, w: Any) -> Any:
        inertia, _ = two_link(1.0, x)
        return np.linalg.inv(inertia) @ (inertia @ (-9 * x[:2] - 6 * x[2:]))

    def rotation(x: Any, w: Any) -> Any:
        r = np.array([[np.cos(x[0]), -np.sin(x[0])], [np.sin(x[0]), np.cos(x[0])]])
        return np.linalg.solve(r, r @ (-x[:2])) + np.linalg.inv(r) @ x[2:]

    _, result, _ = simplified(inverse, 4)
    assert result.exprs[0].text() == "-9*x0 - 6*x2"
    _, result, variables = simplified(rotation, 4)
    assert RECIP not in compile_tape(result.exprs, variables).ops[:, 0]
    assert result.dropped == [], "the determinant is 1, so nothing is left to prove"


@pytest.mark.parametrize(
    ("fn", "text", "obligations"),
    [
        (lambda x, w: x[0] / x[0], "1", ["x0"]),
        (lambda x, w: (x[0] ** 2 - x[1] ** 2) / (x[0] - x[1]), "x0 + x1", ["x0 - x1"]),
        (lambda x, w: 1 / (1 / x[0]), "x0", ["x0", "1/x0"]),
        (lambda x, w: np.sin(x[0] * x[1] / x[1]), "sin(x0)", ["x1"]),
        (lambda x, w: np.sqrt(x[0]) ** 2, "x0", ["x0"]),
        (lambda x, w: np.linalg.norm(x) ** 2, "x0**2 + x1**2", []),
        (lambda x, w: np.log(x[0]) - np.log(x[0]), "0", ["x0"]),
        (lambda x, w: 0 * (1 / x[0]), "0", ["x0"]),
        (lambda x, w: np.cos(x[0]) ** 2 + np.sin(x[0]) ** 2, "1", []),
        (lambda x, w: x[0] * (1 / (1 + x[1] ** 2)) * (1 + x[1] ** 2), "x0", []),
    ],
)
def test_cancelled_poles_are_obligations(fn: Function, text: str, obligations: list[str]) -> None:
    _, result, _ = simplified(fn, 2)
    assert {result.exprs[0].text()} <= {text, "x1**2 + x0**2"}
    dropped = [e.text() for e in result.dropped]
    assert set(dropped) <= set(obligations)
    assert bool(dropped) == bool(obligations)
    assert len(result.kinds) == len(dropped)
    for kind, guard in zip(result.kinds, result.guards, strict=True):
        assert guard.graph.nodes[guard.index].op == (RECIP if kind == "nonzero" else LOG)


def test_where_conditions_are_obligations() -> None:
    def fn(x: Any, w: Any) -> Any:
        jump = np.where(x[0] > 1, 1.0, 2.0)
        return (jump + x[1]) ** 2 - jump**2 - 2 * jump * x[1]

    _, result, _ = simplified(fn, 2)
    assert result.exprs[0].text() == "x1**2"
    assert result.kinds == ["where"]
    assert result.dropped[0].text() == "x0 - 1"


def test_nothing_gets_more_expensive() -> None:
    exprs, result, variables = simplified(lambda x, w: (np.sum(x) + 1) ** 12 / (1 + np.prod(np.sin(x))), 4)
    assert result.exprs[0].same(exprs[0])
    assert compile_tape(result.exprs, variables).size == compile_tape(exprs, variables).size


def test_what_takes_too_much_work_keeps_its_values() -> None:
    g = Graph()
    x = TracedArray(g.variables([f"x{k}" for k in range(8)]))
    e = x[0]
    for k in range(40):
        e = (e * (x[k % 8] + k) + np.sin(x[(k + 1) % 8])) / (1 + x[(k + 3) % 8] ** 2 + e * e)
    result = simplify([e, e * x[0]], work=5e3)
    points = np.random.default_rng(0).uniform(-1, 1, (8, 20))
    before, after = (Evaluator(compile_tape(v, list(x)))(points) for v in ([e], result.exprs[:1]))
    np.testing.assert_allclose(after, before, rtol=1e-6)
    assert simplify([e], work=0.0).exprs[0].same(e)


def test_an_identically_zero_denominator_is_an_error() -> None:
    x, y = Graph().variables("xy")
    with pytest.raises(ModegraphError, match="identically 0"):
        simplify([1 / ((x + y) ** 2 - x * x - 2 * x * y - y * y)])


def test_empty() -> None:
    assert simplify([]).exprs == []


STEPS = st.lists(st.tuples(st.integers(0, 8), st.integers(0, 99), st.integers(0, 99)), min_size=3, max_size=16)


@given(STEPS)
@settings(max_examples=80, deadline=None)
def test_random_expressions_keep_their_values(steps: list[tuple[int, int, int]]) -> None:
    g = Graph()
    x, y = g.variables("xy")
    values: list[Expr] = [x, y, g.constant(2), x + y]
    for kind, i, j in steps:
        a, b = values[i % len(values)], values[j % len(values)]
        values.append(
            [
                lambda a, b: a + b,
                lambda a, b: a - b,
                lambda a, b: a * b,
                lambda a, b: a / (b * b + 1),
                lambda a, b: np.sin(a),
                lambda a, b: np.cos(a) * b,
                lambda a, b: np.maximum(a, b),
                lambda a, b: np.where(a > b, a, b * b),
                lambda a, b: np.sqrt(a * a + 1),
            ][kind](a, b)
        )
    roots = values[-3:]
    result = simplify(roots)
    points = np.random.default_rng(len(steps)).uniform(-1.5, 1.5, (2, 40))
    with np.errstate(all="ignore"):
        before = Evaluator(compile_tape(roots, [x, y]))(points)
        after = Evaluator(compile_tape(result.exprs, [x, y]))(points)
    good = np.isfinite(before) & (abs(before) < 1e6)
    np.testing.assert_allclose(after[good], before[good], rtol=1e-5, atol=1e-5)


@given(STEPS)
@settings(max_examples=150, deadline=None)
def test_undefined_points_stay_undefined(steps: list[tuple[int, int, int]]) -> None:
    """Wherever plain arithmetic divides by zero, the simplified expressions or their guards do as well."""
    operations: list[Callable[[Any, Any], Any]] = [
        lambda a, b: a + b,
        lambda a, b: a - b,
        lambda a, b: a * b,
        lambda a, b: a / b,
        lambda a, b: 1 / a,
        lambda a, b: np.maximum(a, b),
        lambda a, b: a * a - b * b,
        lambda a, b: np.sqrt(a) * b,
        lambda a, b: np.where(a > b, a * b, b * b),
    ]

    def program(x: Any, y: Any, two: Any) -> list[Any]:
        values = [x, y, two, x + y]
        for kind, i, j in steps:
            values.append(operations[kind](values[i % len(values)], values[j % len(values)]))
        return values

    g = Graph()
    x, y = g.variables("xy")
    try:
        traced = program(x, y, g.constant(2))
        used = _used(steps)
        result = simplify([traced[-1]])
    except ModegraphError:
        return
    grid = np.array([[a, b] for a in (-1.0, 0.0, 1.0, 2.0) for b in (-1.0, 0.0, 1.0)]).T
    with np.errstate(all="ignore"):
        floats = program(grid[0], grid[1], np.full(grid.shape[1], 2.0))
    undefined = np.any([~np.isfinite(np.broadcast_to(floats[k], grid.shape[1])) for k in used], axis=0)
    got = Evaluator(compile_tape([*result.exprs, *result.guards], [x, y]))(grid)
    assert np.all(np.isnan(got).any(axis=0)[undefined])


def _used(steps: list[tuple[int, int, int]]) -> set[int]:
    """The intermediate values that the last one is made of."""
    unary = (4,)
    needed = {3 + len(steps)}
    for k in range(3 + len(steps), 3, -1):
        if k in needed:
            kind, i, j = steps[k - 4]
            needed.add(i % k)
            if kind not in unary:
                needed.add(j % k)
    return needed
