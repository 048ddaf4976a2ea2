"""Tracing of whole modes: what comes out, and every kind of bad input."""

import math
from fractions import Fraction

import numpy as np
import pytest

import modegraph as mg
from modegraph.errors import ModegraphError
from modegraph.expression.evaluate import Evaluator
from modegraph.expression.ops import RECIP
from modegraph.expression.tape import compile_tape
from modegraph.model.closed_loop import close_loop

PLANT = mg.System(lambda x, u: np.array([x[1], u[0]]), states="position speed", inputs="force")
UNIT = mg.Box([-1, -1], [1, 1])


def make(controller=lambda x: -x[:1], system=PLANT, reference=None, start=UNIT, name="gentle", **options):
    reference = mg.setpoint([0.0]) if reference is None else reference
    return mg.Mode(name, system, controller=controller, reference=reference, start=start, **options)


def texts(exprs):
    return [e.text() for e in exprs]


def evaluate(loop, exprs, state, t=0.0):
    tape = compile_tape(exprs, [*loop.states, loop.time, *loop.disturbance, *loop.unknowns.values()])
    values = [*state, t, *[0.0] * (len(loop.disturbance) + len(loop.unknowns))]
    return Evaluator(tape)(np.array(values))


def test_setpoint():
    mode = make(
        lambda x, r: -(x[:1] - r) - 2 * x[1:],
        reference=mg.setpoint([0.5]),
        constraints=lambda x, u: {"speed": abs(x[1]) <= 1.0, "force": u <= 5},
        output=lambda x: x[0],
    )
    loop = close_loop(mode)
    (segment,) = loop.segments
    assert (segment.start, segment.end) == (0.0, math.inf)
    assert loop.names == ["position", "speed"]
    assert texts(loop.states) == ["position", "speed"]
    assert loop.has_constraints
    assert [face.name for face in segment.constraints] == ["speed", "speed", "force[0]"]
    assert texts(face.expr for face in segment.constraints)[:2] == ["speed - 1", "-speed - 1"]
    assert evaluate(loop, segment.rhs, [0.1, 0.2]) == pytest.approx([0.2, 0.4 - 0.4])
    assert texts(segment.tracking) == ["position - 0.5"]
    assert loop.reset == []


def test_a_bare_mode():
    loop = close_loop(make())
    assert not loop.has_constraints
    assert loop.segments[0].constraints == []
    assert loop.segments[0].tracking == []
    assert loop.disturbance == []
    assert loop.unknowns == {}


def test_uncertainty():
    plant = mg.System(
        lambda x, u, w, d: np.array([x[1] + w[1], (u[0] + w[0]) / d["mass"]]),
        states="position speed",
        inputs=1,
        disturbance=mg.Box([-1, -2], [1, 2]),
        unknowns={"mass": (1, 2), "unused": (0, 1)},
    )
    loop = close_loop(make(system=plant, constraints=lambda w, d: {"odd": w[0] <= d["unused"]}))
    assert len(loop.disturbance) == 2
    assert list(loop.unknowns) == ["mass", "unused"]
    assert loop.segments[0].rhs[0].depends_on([loop.disturbance[1]])
    assert loop.segments[0].rhs[1].depends_on([loop.unknowns["mass"]])


def test_names_that_coincide_stay_apart():
    plant = mg.System(
        lambda x, u, d: np.array([d["t"] * x[0], x[1]]), states="t d['t']", inputs=0, unknowns={"t": (0, 1)}
    )
    loop = close_loop(make(lambda t: [], system=plant))
    everything = [*loop.states, loop.time, *loop.unknowns.values()]
    assert len({e.index for e in everything}) == 4


def test_references_of_a_class():
    mode = make(lambda x, r: r - x[:1], reference=mg.setpoint(mg.Points([[1.0], [2.0]])))
    assert texts(close_loop(mode, [2.0]).segments[0].inputs) == ["-position + 2"]
    with pytest.raises(ModegraphError, match=r"mode 'gentle': .*names no reference"):
        close_loop(mode, [3.0])


def test_trajectory_segments_and_derivatives():
    signal = lambda t: np.where(t < 1.0, t**2, 2.0 * t - 1.0)
    mode = make(
        lambda x, r: r.ddot + (r.dot - x[1:]) + (r - x[:1]),
        reference=mg.trajectory(signal, 2.0, breakpoints=[1.0]),
        output=lambda x: x[:1],
        constraints=lambda r: {"room": r <= 10},
    )
    loop = close_loop(mode)
    assert [(s.start, s.end) for s in loop.segments] == [(0.0, 1.0), (1.0, 2.0), (2.0, math.inf)]
    assert texts(e for s in loop.segments for e in s.tracking) == [
        "position - t**2",
        "position - 2*t + 1",
        "position - 3",
    ]
    assert not loop.segments[2].rhs[1].depends_on([loop.time])
    for segment, t in zip(loop.segments, (0.5, 1.5, 9.0), strict=True):
        r = mode.reference.at(t)
        expected = r.ddot + (r.dot - 0.3) + (r - 0.2)
        assert evaluate(loop, segment.inputs, [0.2, 0.3], t) == pytest.approx(np.asarray(expected))


def test_parts_of_a_reference_keep_their_derivatives():
    mode = make(
        lambda x, r: r[1:].dot + r[:1].ddot,
        reference=mg.trajectory(lambda t: np.array([t**2, t**3]), 1.0),
    )
    assert evaluate(close_loop(mode), close_loop(mode).segments[0].inputs, [0, 0], 0.5) == pytest.approx([2.75])


def test_the_controller_may_switch_in_time_by_itself():
    mode = make(lambda t: np.where(t < 0.75, 1.0, -1.0))
    loop = close_loop(mode)
    assert [(s.start, s.end) for s in loop.segments] == [(0.0, 0.75), (0.75, math.inf)]
    assert [s.inputs[0].value for s in loop.segments] == [1, -1]


def test_a_switch_at_an_undetermined_time_is_refused():
    with pytest.raises(ModegraphError, match=r"mode 'gentle': .*breakpoints="):
        close_loop(make(lambda t: np.where(np.sin(t) < 0.5, 1.0, -1.0)))
    with pytest.raises(ModegraphError, match=r"mode 'gentle': .*breakpoints="):
        close_loop(make(lambda t: np.where(3.0 * t < 1.0, 1.0, -1.0)))
    kinked = mg.trajectory(lambda t: np.maximum(np.sin(t), 0.5), 3.0)
    with pytest.raises(ModegraphError, match=r"mode 'gentle': .*breakpoints="):
        close_loop(make(lambda r: r.dot, reference=kinked))
    assert close_loop(make(lambda r: r, reference=kinked))


def test_a_pole_that_a_time_switch_hides_stays_an_obligation():
    loop = close_loop(make(lambda x, t: np.maximum(t - 1.0, 0.0) / x[0], start=mg.Box([1, -1], [2, 1])))
    assert loop.segments[0].inputs[0].value == 0
    assert {loop.graph.nodes[k].op for k in loop.graph.dropped} == {RECIP}
    # A case distinction does not evaluate the branch it does not take.
    loop = close_loop(make(lambda x, t: np.where(t < 1.0, 1.0, 1.0 / x[0]), start=mg.Box([1, -1], [2, 1])))
    assert loop.graph.dropped == []


def test_memory():
    memory = mg.Memory("integral", lambda x, r, z: r - x[:1] - z, lambda x, r: [x[1] + r[0] + r.dot[0]])
    mode = make(
        lambda x, z: z - x[:1],
        memory=memory,
        reference=mg.trajectory(lambda t: 2.0 * t + 1.0, 1.0),
        constraints=lambda z: {"windup": abs(z) <= 3},
    )
    loop = close_loop(mode)
    assert loop.names == ["position", "speed", "integral"]
    assert len(loop.segments[0].rhs) == 3
    assert texts(loop.reset) == ["speed + 3"]
    assert [face.name for face in loop.segments[0].constraints] == ["windup[0]", "windup[0]"]


def test_constraints_without_variables():
    loop = close_loop(make(constraints=lambda r: {"low": r[0] >= 1.0, "high": r[0] <= 1.0}))
    values = [face.expr.value for face in loop.segments[0].constraints]
    assert values == [Fraction(1), Fraction(-1)]


def test_an_autonomous_plant():
    plant = mg.System(lambda x: -x, states=1, inputs=0)
    loop = close_loop(make(lambda t: [], system=plant, start=mg.Box([0], [1])))
    assert loop.segments[0].inputs == []


def two_link_arm(reference):
    a, b, d = 5 / 3, 0.5, 1 / 3

    def mass(q):
        c = np.cos(q[1])
        return np.array([[a + 2 * b * c, d + b * c], [d + b * c, d]])

    def coriolis(q, v):
        s = b * np.sin(q[1])
        return np.array([[-s * v[1], -s * (v[0] + v[1])], [s * v[0], 0]])

    def dynamics(x, u, w):
        q, v = x[:2], x[2:]
        return np.concatenate([v, np.linalg.solve(mass(q), u + w - coriolis(q, v) @ v)])

    def controller(x, r):
        q, v = x[:2], x[2:]
        return mass(q) @ (r.ddot - 4 * (v - r.dot) - 4 * (q - r)) + coriolis(q, v) @ v

    plant = mg.System(dynamics, states="q1 q2 v1 v2", inputs=2, disturbance=mg.Box([-0.2, -0.05], [0.2, 0.05]))
    return make(
        controller,
        system=plant,
        reference=reference,
        start=lambda r: mg.Ellipsoid(np.concatenate([r, [0, 0]]), np.diag([1e-4, 1e-4, 1e-2, 1e-2])),
        constraints=lambda x, u: {"speed": abs(x[2:]) <= 1.6, "u": abs(u) <= [13, 3.5]},
    )


def test_the_two_link_arm_is_traced_with_little_work():
    mode = two_link_arm(mg.minimum_time([0, 1.6], [1, 0.8], speed=1.25, acceleration=5.0))
    loop = close_loop(mode)
    # 12 ms on a quiet machine: what takes time is the nodes.
    assert len(loop.graph.nodes) < 400
    assert len(loop.segments) == 4
    assert [face.name for face in loop.segments[0].constraints[-2:]] == ["u[1]", "u[1]"]
    # Computed torque leaves the double integrator of the error.
    r = mode.reference.at(0.4)
    x = np.array([0.1, 1.2, 0.3, -0.4])
    expected = r.ddot - 4 * (x[2:] - r.dot) - 4 * (x[:2] - r)
    assert evaluate(loop, loop.segments[1].rhs, x, 0.4) == pytest.approx([0.3, -0.4, *expected])


def branch(x):
    if x[0] > 0:
        return 1.0
    return -1.0


def in_place(x):
    x[0] = x[0] - 1.0
    return x[:1]


def on_a_copy(x):
    x = x.copy()
    x[0] = x[0] - 1.0
    return x[:1]


def test_arguments_cannot_be_changed_in_place():
    assert texts(close_loop(make(on_a_copy)).segments[0].inputs) == ["position - 1"]
    with pytest.raises(ModegraphError, match=r"mode 'gentle', controller.*x = x.copy\(\)"):
        close_loop(make(in_place))


@pytest.mark.parametrize(
    "controller, words",
    [
        (lambda x: x, "controller returned 2 entries, expected 1"),
        (lambda x: [[x[0]]], "shape (1, 1)"),
        (lambda x: None, "None"),
        (lambda x: "push", "controller"),
        (lambda x, y: x[:1], "'y'; it may read x, r, t"),
        (lambda x, w: x[:1], "reads 'w', but a function in this role may read only x, r, t, z"),
        (lambda x, z: z, "memory=Memory"),
        (lambda *args: 0.0, "*args"),
        (lambda x: [float("nan")], "nan"),
        (lambda x: x[:1] * np.inf, "finite"),
        (branch, "np.where"),
        (lambda x: math.sin(x[0]), "np.sin"),
        (lambda x: x[7], "out of bounds"),
        (lambda x: 1 / 0, "ZeroDivisionError"),
        (lambda x: [1.0 / x[0]], "look for a division by zero"),
        (lambda x: [np.log(x[0])], "look for a division by zero, or a logarithm"),
    ],
)
def test_bad_controllers(controller, words):
    with pytest.raises(ModegraphError, match="mode 'gentle', controller") as error:
        close_loop(make(controller))
    assert words in str(error.value)


@pytest.mark.parametrize(
    "dynamics, words",
    [
        (lambda x, u: x[:1], "dynamics returned 1 entry, expected 2"),
        (lambda x, t: x, "reads 't', but a function in this role may read only x, u, w, d"),
        (lambda x, w: x, "disturbance=Box"),
        (lambda x, d: x, "unknowns={name: (lo, hi)}"),
        (lambda x, u: [x[1], u[0] / 0.0], "division by zero"),
    ],
)
def test_bad_dynamics(dynamics, words):
    with pytest.raises(ModegraphError, match="mode 'gentle', dynamics") as error:
        close_loop(make(system=mg.System(dynamics, states=2, inputs=1)))
    assert words in str(error.value)


def test_an_unknown_that_was_not_declared():
    plant = mg.System(lambda x, u, d: x * d["m"], states=2, inputs=1, unknowns={"mass": (1, 2)})
    with pytest.raises(ModegraphError, match=r"mode 'gentle', dynamics.*d\['m'\].*it has 'mass'"):
        close_loop(make(system=plant))


@pytest.mark.parametrize(
    "options, words",
    [
        ({"output": lambda x: x}, "output returned 2 entries, expected 1"),
        ({"output": lambda r: r}, "output reads 'r', but a function in this role may read only x"),
        (
            {"memory": mg.Memory("a b", lambda x: x[:1], lambda: [0, 0])},
            "memory dynamics returned 1 entry, expected 2",
        ),
        (
            {"memory": mg.Memory("a", lambda x: x[:1], lambda x: x)},
            "memory reset returned 2 entries, expected 1",
        ),
        (
            {"memory": mg.Memory("a", lambda x: x[:1], lambda u: u)},
            "memory reset reads 'u', but a function in this role may read only x, r",
        ),
    ],
)
def test_other_bad_functions(options, words):
    with pytest.raises(ModegraphError, match="mode 'gentle'") as error:
        close_loop(make(**options))
    assert words in str(error.value)


def test_a_bad_signal_names_the_mode():
    mode = make(reference=mg.trajectory(lambda t, q: t, 1.0))
    with pytest.raises(ModegraphError, match=r"mode 'gentle', signal.*'q'"):
        close_loop(mode)


def test_a_continuous_class_has_its_parameters_as_variables():
    plant = mg.System(lambda x, u, d: np.array([x[1], d["p[0]"] * u[0]]), states="p[1] v", inputs="u",
                      unknowns={"p[0]": (0.9, 1.1)})  # fmt: skip
    mode = mg.Mode(
        "class",
        plant,
        controller=lambda x, r, z: r[0] - x[0] - z[0],
        reference=mg.setpoint(mg.Box([0.0, 1.0], [1.0, 2.0])),
        start=lambda r: mg.Ball([r[0], 0.0], r[1]),
        constraints=lambda x, r: {"near": abs(x[0] - r[0]) <= r[1]},
        memory=mg.Memory("z", lambda x, r: x[:1] - r[:1], lambda x, r: r[1:] * x[1]),
        output=lambda x: x,
    )
    loop = close_loop(mode)
    first, second = loop.parameters
    assert len({e.text() for e in [*loop.states, *loop.parameters, *loop.unknowns.values()]}) == 6
    (segment,) = loop.segments
    assert segment.inputs[0].depends_on([first])
    assert all(face.expr.depends_on([first]) and face.expr.depends_on([second]) for face in segment.constraints)
    assert segment.rhs[2].depends_on([first])
    assert loop.reset[0].depends_on([second])
    assert segment.tracking[1].depends_on([second])
    assert loop.typical.shape == (3 + 1 + 0 + 1 + 2, loop.typical.shape[1])
    alone = close_loop(mode, [0.5, 1.5])
    assert alone.parameters == []
    with pytest.raises(ModegraphError, match="names no reference"):
        close_loop(mode, [0.5, 2.5])


def test_a_class_is_tried_at_its_middle_reference():
    mode = make(
        name="hold", controller=lambda x, r: np.log(r - 1.0) - x[:1], reference=mg.setpoint(mg.Box([0.0], [1.0]))
    )
    with pytest.raises(ModegraphError, match="controller returned"):
        close_loop(mode)
