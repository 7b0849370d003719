"""A force in pieces, each linear: that of a law which sets the current of one mass, within a limit:

    i = sat((K_p (u - x_1) - K_d v_1)/k_t, +-i_max),      u the target, which steps, k_t = -gamma_2

A switching function, linear in state and input, tells the pieces apart: the piece is 0 while it is between two levels,
-1 below the lower one, 1 above the upper one; of an infinite level there is no piece beyond. A mode has the piece as its
`limit`, with rates and an input of its own. What the engine knows of pieces is the functions here and the rows of
`mode_table`.

i is continuous in x_1 and v_1, so the force has no jump where the limit is reached or left. In between
the motion is that of `laplace.rates_under_law`, s^2 + p s + q with p = (b + K_d)/m and q = (k + K_p)/m; at a limit it is
that of `laplace.rates_of` under the current +-i_max. The gains are not negative, so Routh's conditions at a limit imply
those under the law.

The pull of the law, less what it starts with, is -K_p (x_1(t) - x_1) - K_d (v_1(t) - v_1): its rate is a motion of the
pair of poles alone. Pulls are counted to the side of a positive current.
"""

import sympy as sp

from ..ir import Quantity, Record, Step, Steps, function, scalar
from ..model.equations import Model
from ..model.quantities import *

SWITCHING = scalar("switching", "N", "the switching function: what the law asks of the motor")
LEVELS = Record("Levels", "Levels of the switching function: between them the law sets the input.").of(
    Quantity("lower", r"h_-", "N", "below it the input is at the lower limit; infinite where there is none"),
    Quantity("upper", r"h_+", "N", "above it the input is at the upper limit"),
)
ASKED = scalar("asked", "A", "the input of a mode without a limit: the current that a law asks for")
REACHED = scalar("reached", "A", "the input at a limit")


def limits(model: Model) -> tuple[int, ...]:
    """The limits that a mode may be at, by their signs, in the order of the numbers of modes."""
    return (-1, 0, 1) if model.has_law else (0,)


def rates_at(model: Model, limit: int) -> int:
    """Which rates of a plan hold at a limit: those under the law are the second ones."""
    return int(model.has_law and limit == 0)


def _pull(model: Model) -> sp.Expr:
    """The pull of the law, expanded into a product for each gain."""
    return sp.S.Zero if model.law is None else model.law.along * model.pull


@function(takes=(ROBOT, STATE, CURRENT), returns=SWITCHING)
def switching_of(model: Model) -> Steps:
    """The switching function at a state: what the law asks of the motor, to the side of a positive current."""
    yield Step(SWITCHING.symbol, _pull(model), "the law")


@function(takes=(ROBOT, STATE, CURRENT), returns=SWITCHING)
def switching_terms(model: Model) -> Steps:
    """Sum of the magnitudes of its terms: what it is rounded by is in proportion to them."""
    terms = sp.Add.make_args(sp.expand(_pull(model)))
    yield Step(SWITCHING.symbol, sp.Add(*map(sp.Abs, terms)), "the law, by magnitude")


@function(takes=(ROBOT,), returns=LEVELS)
def switching_levels(model: Model) -> Steps:
    """Its levels: what the motor pulls with at the limits of the current."""
    has_limit = model.law is not None and model.declares(u_max)
    largest = -model.law.along * gamma2 * u_max if model.law is not None and has_limit else sp.oo
    lower, upper = LEVELS.symbols
    yield Step(upper, largest, "the limit")
    yield Step(lower, -upper if has_limit else -sp.oo, "the limit")


@function(takes=(ROBOT, STATE, MOTION), returns=NUMERATOR)
def switching_numerator(model: Model) -> Steps:
    """Numerator of the switching function."""
    per_x, per_v = _pull(model).diff(x1), _pull(model).diff(v1)
    of_x, of_v = (v1, N2_1, N1_1), (H3_1, H2_1, H1_1)
    for name, displaced, faster in zip((H3, H2, H1), of_x, of_v, strict=True):
        yield Step(name, per_x * displaced + per_v * faster, "its rate is a motion of the pair")


@function(takes=(ROBOT, STATE, CURRENT), returns=ASKED)
def current_of_law(model: Model) -> Steps:
    """The current that the law asks for at a state, where it is within the limit; without a law the input."""
    yield Step(ASKED.symbol, u if model.law is None else -model.pull / gamma2, "the law")


@function(takes=(ROBOT, CURRENT, LIMIT_SIGN), returns=REACHED)
def input_at_limit(model: Model) -> Steps:
    """The input at a limit: the current there, in the place of a law's target."""
    yield Step(REACHED.symbol, u if model.law is None else limit_sign * u_max, "at the limit")
