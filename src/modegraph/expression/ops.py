"""Operation codes shared by the expression graph and the tape."""

from __future__ import annotations

CONST = 0
VAR = 1
ADD = 2
SUB = 3
MUL = 4
SQR = 5
MULC = 6
ADDC = 7
SIN = 8
COS = 9
RECIP = 10
EXP = 11
LOG = 12
ATAN = 13
RELU = 14
STEP = 15
WHERE = 16

NAMES = (
    "const", "var", "add", "sub", "mul", "sqr", "mulc", "addc", "sin", "cos",
    "recip", "exp", "log", "atan", "relu", "step", "where",
)  # fmt: skip

BINARY = frozenset((ADD, SUB, MUL))
"""Codes with two operands a and b."""

LEAVES = frozenset((CONST, VAR))
"""Codes without operands."""
