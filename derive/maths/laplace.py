"""Laplace transform of (3), (4), the elimination (6)-(11), and the poles by name.

With z = (y, v_1, v_2), z' = M z + const within a phase, so Z(s) = (s - M)^-1 (z(0) + const/s), and for
each coordinate h of z

    H(s) = h(0)/s + (H_3 s^2 + H_2 s + H_1) / (s P(s)),    P(s) = s^3 + s_1 s^2 + s_2 s + s_3.

x_i has one factor 1/s more, which is the s^2 of (11). H_3, H_2, H_1 are those of (13)-(15)
counted from x_2(0) and v_2(0): no large numbers are subtracted, and b_1 = b_2 = 0 is no exception.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import lru_cache

import sympy as sp

from ..ir import Record, Step, Steps, function, scalar
from ..model.equations import Model
from ..model.quantities import *

s = sp.Symbol("s")
X1, X2 = sp.symbols("X1 X2")
x1_0, v1_0, x2_0, v2_0 = sp.symbols("x1_0 v1_0 x2_0 v2_0", real=True)

# The system with named coefficients; `rates` gives the coefficients of a model, y_v1 but with a gear being 1.
MATRIX = sp.Matrix([[0, y_v1, -1], [a1_y, a1_v1, a1_v2], [a2_y, a2_v1, a2_v2]])
START = sp.Matrix([y, v1, v2])
CONSTANT = sp.Matrix([0, C_1, C_2])
REST = scalar("rest", "m", "compression of the spring where y is 0")


def rest_of_spring(model: Model) -> tuple[Steps, sp.Expr]:
    """`Model.rest` as a step, and what it is called behind that; no step and 0 where it is 0."""
    return ((Step(REST.symbol, model.rest, "N = 0"),), REST.symbol) if model.rest != 0 else ((), sp.S.Zero)


@function(takes=(ROBOT,), returns=RATES)
def rates_of(model: Model) -> Steps:
    """Coefficients of the equations of motion and of their characteristic polynomials."""
    return _rates(model, model.in_compression)


@function(takes=(ROBOT,), returns=RATES)
def rates_under_law(model: Model) -> Steps:
    """The same where a law sets the current, and u is its target.

    The mass is one on a spring K_p further, with a damper K_d, that K_p u drives.
    """
    if not model.has_law:
        return tuple(Step(symbol, sp.S.Zero, "no law") for symbol in rates_record(model).symbols)
    return _rates(model, model.following(sp.S.One))


def rates_by_limit(model: Model) -> Steps:
    """Those of both by the limit that the input of a law is at."""
    return rates_of(model) if not model.has_law else _rates(model, model.following(1 - limit_sign**2))


def matrix_of(model: Model) -> sp.Matrix:
    """The system of a model."""
    return MATRIX.subs(y_v1, model.rate_of_gear)


@lru_cache(maxsize=32)  # a solver asks some 25 times
def _rates(model: Model, accelerations: tuple[sp.Expr, sp.Expr]) -> Steps:
    smooth = [acc.subs({side_1: 0, side_2: 0}) for acc in accelerations]
    constant = [acc.subs({y: 0, v1: 0, v2: 0, u: 0}) for acc in smooth]
    steps = [
        Step(MATRIX[row, column], smooth[row - 1].diff(v), f"({row + 2}) per {v}")
        for row in (1, 2)
        for column, v in enumerate(START)
    ]
    steps += [Step(a1_u, smooth[0].diff(u), "(3) per u")]
    steps += [Step(a1_0, constant[0], "(3) constant"), Step(a2_0, constant[1], "(4) constant")]
    entries = {step.symbol: step.value for step in steps} | {y_v1: model.ratio}
    modes = (((s_1, s_2, s_3), (0, 1, 2), "(11)"), ((p_1, q_1), (0, 1), "(6)"), ((p_2, q_2), (0, 2), "(7)"))
    for symbols, rows, source in modes:
        polynomial = characteristic(MATRIX.extract(rows, rows).subs(entries))
        steps += [Step(name, value, f"{source} denominator") for name, value in zip(symbols, polynomial, strict=True)]
    without_spring = characteristic(MATRIX.extract((1, 2), (1, 2)).subs(entries))
    steps += [Step(damping, without_spring[1], "(11) denominator without the spring")]
    return (*steps, *(_rates_of_gear(model, entries) if model.is_geared else ()))


def _rates_of_gear(model: Model, rates: Mapping[sp.Symbol, sp.Expr]) -> Steps:
    yield Step(y_v1, model.ratio, "the gear")
    for per_v1, per_v2, drift in DRIFTS:
        yield Step(drift, sp.expand(rates[per_v1] + model.ratio * rates[per_v2]), "the gear")


DRIFTS = (a1_v1, a1_v2, drift_1), (a2_v1, a2_v2, drift_2)


def without_cancelling(value: sp.Expr, drifts: Iterable[tuple[sp.Symbol, ...]] = DRIFTS) -> sp.Expr:
    """A formula with what is left of per_v1 + y_v1 per_v2 of a mass in the place of that sum, in which dampers cancel."""
    products = {per_v2 * y_v1: drift - per_v1 for per_v1, per_v2, drift in drifts}
    return sp.expand(value.subs(products)) if y_v1 in value.free_symbols else value


def rates_record(model: Model) -> Record:
    """The rates of a model."""
    return RATES.of(*RATES.quantities, *RATES_OF_GEAR) if model.is_geared else RATES


def characteristic(matrix: sp.Matrix) -> list[sp.Expr]:
    """Coefficients behind the leading one of det(s - matrix), expanded, so that nothing cancels."""
    size = matrix.rows
    characteristic = sp.Poly((s * sp.eye(size) - matrix).det(method="berkowitz"), s)
    return [sp.expand(coefficient) for coefficient in characteristic.all_coeffs()[1:]]


@function(takes=(ROBOT, RATES, CURRENT, SIDE_1, SIDE_2), returns=DRIVE)
def drive_of(model: Model) -> Steps:
    """Constant accelerations of a phase."""
    yield Step(C_1, a1_0 + a1_u * u - model.levels[0] * side_1, "(3), in (10) lambda_2 measured from y = 0")
    yield Step(C_2, a2_0 - model.levels[1] * side_2, "(4), in (8) -gamma measured from y = 0")


MODES = {
    (1, 2): (s_3, "(11) of y", "(16), (17) over the cubic", "({}), counted from the start"),
    (1,): (q_1, "(6) of y, the other mass held", "(6), the other mass held"),
    (2,): (q_2, "(7) of y, the other mass held", "(7), the other mass held"),
}
"""By the masses that slip: the constant coefficient of the denominator; where the numerators of y and of each of these
masses stand in the paper, (13)-(15) for the body.
"""
NAMES = {0: (H3_y, H2_y, H1_y), 1: (H3_1, H2_1, H1_1), 2: (H3_2, H2_2, H1_2)}
WHOLE = (N2_1, N1_1, N0_1)


def numerators(moving: tuple[int, ...], rate_of_gear: sp.Expr = sp.S.One) -> Steps:
    """H_3, H_2, H_1 of y, v_1, v_2 in the mode where the masses `moving` slip and the others are held.

    H_3 is the initial rate M z(0) + d. With both masses moving H_2 = (M + s_1) H_3 and
    H_1 = adj(-M) d - s_3 z(0). With one mass held the denominator is s^2 + p s + q alone:
    H_2 = adj(-M) d - q z(0), H_1 = 0.

    N_2, N_1, N_0 of V_1 = (v_1 s^3 + N_2 s^2 + N_1 s + N_0)/(s P) are the row of adj(s - M) (s z(0) + d). They are
    H_3 + s_1 v_1(0), H_2 + s_2 v_1(0), H_1 + s_3 v_1(0), in which nothing cancels where v_1 fades.
    """
    rows = [0, *moving]
    lowest_coefficient, *sources = MODES[moving]
    system = MATRIX.subs(y_v1, rate_of_gear)
    matrix, constant, start = system.extract(rows, rows), CONSTANT.extract(rows, [0]), START.extract(rows, [0])
    adjugate = (s * sp.eye(len(rows)) - matrix).adjugate()
    columns = [matrix * start + constant, adjugate.subs(s, 0) * constant - lowest_coefficient * start]
    if len(moving) == 2:
        columns.insert(1, adjugate.diff(s).subs(s, 0) * sp.Matrix([NAMES[row][0] for row in rows]))
    steps = [
        Step(NAMES[row][n], sp.expand(value), source.format(13 + n))
        for n, values in enumerate(columns)
        for row, value, source in zip(rows, values, sources, strict=True)
    ]
    if 1 in moving:
        whole = sp.Poly(sp.expand((adjugate * (s * start + constant))[1]), s).all_coeffs()[1:]
        steps += [Step(name, sp.expand(value), sources[1]) for name, value in zip(WHOLE, whole, strict=False)]
    moved = {step.symbol for step in steps}
    return (*steps, *(Step(name, sp.S.Zero, "held") for name in MOTION.symbols if name not in moved))


def _motion(model: Model, moving: tuple[int, ...]) -> Steps:
    """The numerators of a model."""
    steps = numerators(moving, model.rate_of_gear)
    return tuple(replace(step, value=without_cancelling(step.value)) for step in steps)


@function(takes=(RATES, DRIVE, STATE), returns=MOTION)
def motion_of_both(model: Model) -> Steps:
    """Numerators of the motion with both slipping."""
    return _motion(model, (1, 2))


@function(takes=(RATES, DRIVE, STATE), returns=MOTION)
def motion_of_mass_1(model: Model) -> Steps:
    """Numerators of the motion with mass 1 slipping."""
    return _motion(model, (1,))


@function(takes=(RATES, DRIVE, STATE), returns=MOTION)
def motion_of_law() -> Steps:
    """Numerators of the motion with mass 1 slipping under the law, by the rates of that."""
    return numerators((1,))


@function(takes=(RATES, DRIVE, STATE), returns=MOTION)
def motion_of_mass_2() -> Steps:
    """Numerators of the motion with mass 2 slipping."""
    return numerators((2,))


def transforms(model: Model) -> tuple[sp.Expr, ...]:
    """The transforms (6), (7) of (3), (4): what is 0 in X_1(s), X_2(s) and the initial values."""
    steps = []
    for acc, X, x_0, v_0 in zip(model.accelerations, (X1, X2), (x1_0, x2_0), (v1_0, v2_0), strict=True):
        constant = acc.subs({v1: 0, v2: 0, x1: 0, x2: 0})
        moving = (acc - constant).subs({v1: s * X1 - x1_0, v2: s * X2 - x2_0, x1: X1, x2: X2})
        steps.append(s**2 * X - s * x_0 - v_0 - moving - constant / s)
    return tuple(steps)


def paper_frame(model: Model) -> tuple[sp.Poly, ...]:
    """The numerators of X_1(s), X_2(s) over s^2 P(s) as they follow from (3), (4), in the paper's frame.

    (6), (7) are solved for both; H_n of (12)-(15) is the coefficient of s^(n-1) of that of X_2(s).
    """
    solution = sp.solve(transforms(model), (X1, X2), dict=True)[0]
    entries = {step.symbol: step.value for step in rates_of(model) if step.symbol in MATRIX.free_symbols}
    entries[y_v1] = model.ratio
    denominator = s**2 * (s * sp.eye(3) - MATRIX.subs(entries)).det()
    return tuple(sp.Poly(sp.cancel(sp.together(solution[X] * denominator)), s) for X in (X1, X2))
