"""A mode as a linear system: the members z of a state, in their order, obey z' = M (z_1, z_2, z_3, 1) within a phase.

The first of them is the integral of the second, and nothing depends on it; the others are the core (v_1, v_2, y), for
which (s - M)^-1 is adj(s - M)/P. y' = v_1 - v_2, or over a gear ratio v_1 - v_2. A mass that is held has a row of zeros.
"""

import sympy as sp

from ..ir import Quantity, Record, Step, Steps, function
from ..model.equations import Model
from ..model.quantities import *
from . import laplace

CORE = STATE.quantities[1:]
COLUMNS_OF_CORE = (*(quantity.name for quantity in CORE), "1")
POWERS = (2, 1, 0)


def _coefficient(row: Quantity, column: str, power: int) -> Quantity:
    seconds = power - 2 - (row.unit == "m/s") + (-1 if column == "1" else int(column != "y"))
    unit = f"{'m' if column == '1' else '1'}/s^{-seconds}" if seconds else "m" if column == "1" else "1"
    meaning = f"of s^{power} in the row of {row.name} for {column}"
    return Quantity(f"{row.name}_{column}_{power}", rf"N_{{{row.glyph},{column},{power}}}", unit, meaning)


TRANSFER = Record("Transfer", "adj(s - M) of the core and, in the last column, times the constant accelerations.").of(
    *(_coefficient(row, column, power) for row in CORE for column in COLUMNS_OF_CORE for power in POWERS)
)
SPEEDS = Record("Speeds", "z': the rates of the members of a state.").of(
    *(
        Quantity(f"{q.name}_rate", rf"\dot{{{q.glyph}}}", f"{q.unit}/s", f"rate of the {q.meaning}")
        for q in STATE.quantities
    )
)
entries = sp.symbols("A11 A12 A1y A21 A22 A2y D1 D2", real=True)
A11, A12, A1y, A21, A22, A2y, D1, D2 = entries
DR1, DR2, minor = sp.symbols("DR1 DR2 minor", real=True)


def _rows() -> Steps:
    """The rows of the masses, of zeros where one is held."""
    for symbol, value in zip(entries, (a1_v1, a1_v2, a1_y, a2_v1, a2_v2, a2_y, C_1, C_2), strict=True):
        side = side_1 if symbol.name[1] == "1" else side_2
        yield Step(symbol, value * side**2, "(3)" if side == side_1 else "(4)")


@function(takes=(RATES, DRIVE, SIDE_1, SIDE_2), returns=TRANSFER)
def transfer_of(model: Model) -> Steps:
    """The transfer functions of a mode over P(s): of the core's initial values, and of the constant accelerations."""
    s = sp.Symbol("s")
    core = sp.Matrix([[A11, A12, A1y], [A21, A22, A2y], [model.rate_of_gear, -1, 0]])
    adjugate = (s * sp.eye(3) - core).adjugate()
    table = adjugate.row_join(adjugate * sp.Matrix([D1, D2, 0])).applyfunc(sp.expand)
    yield from _rows()
    if model.is_geared:
        yield Step(DR1, drift_1 * side_1**2, "A11 + y_v1 A12, in which nothing cancels")
        yield Step(DR2, drift_2 * side_2**2, "A21 + y_v1 A22, in which nothing cancels")
    yield Step(minor, damping * side_1**2 * side_2**2, "A11 A22 - A12 A21, in which nothing cancels")
    values = (entry.coeff(s, power).subs(A11 * A22, minor + A12 * A21) for entry in table for power in POWERS)
    values = (laplace.without_cancelling(value, ((A11, A12, DR1), (A21, A22, DR2))) for value in values)
    yield from (Step(symbol, sp.expand(value), "(11)") for symbol, value in zip(TRANSFER.symbols, values, strict=True))


@function(takes=(RATES, DRIVE, SIDE_1, SIDE_2, STATE), returns=SPEEDS)
def speeds_of(model: Model) -> Steps:
    """z' of a state in a mode."""
    yield from _rows()
    values = (v1, A11 * v1 + A12 * v2 + A1y * y + D1, A21 * v1 + A22 * v2 + A2y * y + D2, model.rate_of_gear * v1 - v2)
    yield from (Step(symbol, value, "(3), (4)") for symbol, value in zip(SPEEDS.symbols, values, strict=True))
