r"""Both masses slipping from node to node: the transition matrix of (3), (4), as rows and columns of (y, v_1, v_2).

With z = (y, v_1, v_2), z' = M z + const within a phase, so the rates w = z' obey w' = M w. Over a time t

    w becomes E w,   z gains Phi w,   x_1 gains v_1 t and the row of v_1 in Phi_2 times w,
    E = exp(M t) = W'' + W' (M + s_1) + W N,   Phi = int E dt,   Phi_2 = int Phi dt,   N = M^2 + s_1 M + s_2,

because (s - M)^-1 = adj(s - M)/P(s), adj(s - M) = s^2 + s (M + s_1) + N, and W is the inverse transform of 1/P(s). W has
all its digits for any poles, so there is no case here for near-equal ones or those at 0, and the entries are sums of
products of rates. d of the certificate, w' + a w, is (M + a) w. Where s_3 > 0 what has faded gives the state:

    z = z_end + M^-1 w,   M^-1 = -N/s_3
"""

import sympy as sp

from ..ir import Quantity, Record, Step, Steps, function, scalar
from ..model.equations import Model
from ..model.quantities import *
from .laplace import CONSTANT, START, matrix_of, s, without_cancelling

ROWS = ("y", "1", "2")
"""Of the compression and of the velocities, in order of tie-break priority."""


def _unit(seconds: int) -> str:
    return {-1: "1/s", 0: "1", 1: "s", 2: "s^2", 3: "s^3"}[seconds]


def _entries(name: str, rows: tuple[str, ...], integrated: int, meaning: str) -> tuple[Quantity, ...]:
    return tuple(
        scalar(
            f"{name}_{row}{column}",
            _unit(integrated + (row == "y") - (column == "y")),
            f"{meaning}, per rate of {column}",
        )
        for row in rows
        for column in ROWS
    )


STAYS = _entries("stays", ROWS, 0, "of a rate")
GAINS = _entries("gains", ROWS, 1, "gain of a coordinate")
MOVES = _entries("moves", ("1",), 2, "gain of the position beyond v_1 t")
TRANSITION = Record("Passed", "What rates become, and what y, v_1, v_2 and the position gain by them, over a time.").of(
    *STAYS, *GAINS, *MOVES
)
RATE = Record("Rate", "Rates of y, v_1, v_2.").of(
    scalar("w_y", "m/s", "of the compression"),
    scalar("w_1", "m/s^2", "of the velocity of mass 1"),
    scalar("w_2", "m/s^2", "of the velocity of mass 2"),
)
BEND = Record("Bend", "Rates of rates, or with the real pole removed.").of(
    scalar("bend_y", "m/s^2", "of that of the compression"),
    scalar("bend_1", "m/s^3", "of that of the velocity of mass 1"),
    scalar("bend_2", "m/s^3", "of that of the velocity of mass 2"),
)
ABOVE = Record("Above", "The real pole beyond the rate of each mass alone.").of(
    scalar("above_1", "1/s", "a - p_1"), scalar("above_2", "1/s", "a - p_2")
)
CORE = Record("Core", "y, v_1 and v_2.").of(
    scalar("core_y", "m", "compression"), scalar("core_1", "m/s", "v_1"), scalar("core_2", "m/s", "v_2")
)
w = sp.Matrix(RATE.symbols)


ALONE = {0: (s_1, damping), 1: (p_2, q_2), 2: (p_1, q_1)}
"""Of adj(s - M), by row, the coefficients on the diagonal behind s^2: nothing cancels in these rates."""


def adjugate(model: Model) -> tuple[sp.Matrix, sp.Matrix]:
    """M + s_1 and N, of which adj(s - M) is s^2 + s (M + s_1) + N."""
    whole = (s * sp.eye(3) - matrix_of(model)).adjugate()
    powers = []
    for n in (0, 1):
        entry = lambda row, column, n=n: (  # noqa: E731
            ALONE[row][1 - n] if row == column else without_cancelling(sp.expand(whole[row, column]).coeff(s, n))
        )
        powers.append(sp.Matrix(3, 3, entry))
    return powers[1], powers[0]


def _integrated(model: Model, functions: tuple[sp.Symbol, sp.Symbol, sp.Symbol]) -> sp.Matrix:
    first, second = adjugate(model)
    return (functions[0] * sp.eye(3) + functions[1] * first + functions[2] * second).applyfunc(sp.expand)


@function(takes=(RATES, BASIS), returns=TRANSITION)
def transition_of_both(model: Model) -> Steps:
    """Both masses slipping: what rates become over a time, and what is gained by them."""
    for entries, rows, functions, source in (
        (STAYS, range(3), (Wdd, Wd, W), "(11) (s - M)^-1"),
        (GAINS, range(3), (Wd, W, W1), "(11) (s - M)^-1/s"),
        (MOVES, (1,), (W, W1, W2), "(11) (s - M)^-1/s^2"),
    ):
        matrix = _integrated(model, functions)
        values = (matrix[row, column] for row in rows for column in range(3))
        for entry, value in zip(entries, values, strict=True):
            yield Step(entry.symbol, value, source)


@function(takes=(RATES, DRIVE, STATE), returns=RATE)
def rates_of_both(model: Model) -> Steps:
    """Rates with which both masses begin to slip."""
    for name, value in zip(RATE.symbols, matrix_of(model) * START + CONSTANT, strict=True):
        yield Step(name, sp.expand(value), "(3), (4)")


@function(takes=(RATES, RATE), returns=BEND)
def bends_of_both(model: Model) -> Steps:
    """Rates of rates, both masses slipping."""
    for name, value in zip(BEND.symbols, matrix_of(model) * w, strict=True):
        yield Step(name, sp.expand(value), "(3), (4), differentiated")


@function(takes=(RATES, POLES, CHI), returns=ABOVE)
def above_of_both(model: Model) -> Steps:
    """How far the real pole is beyond p_i, with digits of its own: by one step of Newton's on the cubic.

    The residual det(M + a) is a sum of products with what is near 0 where a is far above the pair.
    """
    near = sp.symbols("near_1 near_2", real=True)
    residual = sp.Symbol("residual", real=True)
    for name, rate in zip(near, (p_1, p_2), strict=True):
        yield Step(name, a - rate, "(11) at s = -a")
    matrix = matrix_of(model)
    gear, (per_y_1, _, across_1), (per_y_2, across_2, _) = matrix[0, 1], *(matrix.row(n) for n in (1, 2))
    of_velocities = near[0] * near[1] - across_1 * across_2
    of_spring = per_y_2 * (near[0] + gear * across_1) - per_y_1 * (gear * near[1] + across_2)
    yield Step(residual, a * of_velocities + of_spring, "(11) at s = -a")
    for name, close in zip(ABOVE.symbols, near, strict=True):
        yield Step(name, close - residual / chi, "(11) at s = -a, polished")


@function(takes=(RATES, POLES, ABOVE, RATE), returns=BEND)
def deflated_of_both(model: Model) -> Steps:
    """Deflated derivatives (M + a) w, both masses slipping: a motion of the pair."""
    diagonal = (a, *ABOVE.symbols)
    matrix = matrix_of(model)
    for row, name in enumerate(BEND.symbols):
        value = sum(((diagonal[row] if row == n else matrix[row, n]) * w[n] for n in range(3)), sp.S.Zero)
        yield Step(name, value, "(19) pole a removed")


@function(takes=(RATES, DRIVE), returns=CORE)
def settled_of_both(model: Model) -> Steps:
    """Where both masses end while they slip; s_3 > 0."""
    _, lowest = adjugate(model)
    for name, value in zip(CORE.symbols, lowest * CONSTANT, strict=True):
        yield Step(name, sp.expand(value) / s_3, "(18), (19), (21) terms in 1/s")


@function(takes=(RATES, RATE), returns=CORE)
def unsettled_of_both(model: Model) -> Steps:
    """How far both masses are from there, by what has not faded of their rates."""
    _, lowest = adjugate(model)
    for name, value in zip(CORE.symbols, lowest * w, strict=True):
        yield Step(name, -sp.expand(value) / s_3, "(18), (19), (21) without the terms in 1/s")
