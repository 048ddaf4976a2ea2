"""Plain NumPy code to an expression tape: tracing, exact derivatives, simplification, float evaluation."""

from modegraph.expression.array import TracedArray
from modegraph.expression.derivative import derivative
from modegraph.expression.evaluate import Evaluator
from modegraph.expression.piecewise import resolve, unresolved
from modegraph.expression.relation import Relation
from modegraph.expression.scalar import Expr, Graph
from modegraph.expression.simplify import Simplified, simplify
from modegraph.expression.tape import Tape, compile_tape
from modegraph.expression.trace import arguments, as_vector, call, required_arguments

__all__ = [
    "Evaluator", "Expr", "Graph", "Relation", "Simplified", "Tape", "TracedArray", "arguments", "as_vector",
    "call", "compile_tape", "derivative", "required_arguments", "resolve", "simplify", "unresolved",
]  # fmt: skip
