"""A law that sets the current of one mass, within a limit:

    i = sat((K_p (u - x_1) - K_d v_1)/k_t, +-i_max),      u the target, which steps, k_t = -gamma_2

i is continuous in x_1 and v_1, so the force has no jump where the limit is reached or left. In between
the motion is that of `laplace.rates_under_law`, s^2 + p s + q with p = (b + K_d)/m and q = (k + K_p)/m; at a limit it is
that of `laplace.rates_of` under the current +-i_max. The gains are not negative, so Routh's conditions at a limit imply
those under the law.

The pull of the law, less what it starts with, is -K_p (x_1(t) - x_1) - K_d (v_1(t) - v_1): its rate is a motion of the
pair of poles alone. Pulls are counted to the side of a positive current.
"""

import sympy as sp

from ..ir import Step, Steps, function, scalar
from ..model.equations import Model
from ..model.quantities import *

PULL = scalar("pull", "N", "what the law asks of the motor, to the side of a positive current")
LARGEST = scalar("largest", "N", "what the motor pulls with at the limit of the current")
ASKED = scalar("asked", "A", "the current that the law asks for")


def _pull(model: Model) -> sp.Expr:
    """The pull of the law, expanded into a product for each gain."""
    return sp.S.Zero if model.law is None else model.law.along * model.pull


@function(takes=(ROBOT, STATE, CURRENT), returns=PULL)
def pull_of_law(model: Model) -> Steps:
    """What the law asks of the motor at a state, to the side of a positive current."""
    yield Step(PULL.symbol, _pull(model), "the law")


@function(takes=(ROBOT, STATE, CURRENT), returns=PULL)
def terms_of_pull(model: Model) -> Steps:
    """Sum of the magnitudes of its terms: what it is rounded by is in proportion to them."""
    terms = sp.Add.make_args(sp.expand(_pull(model)))
    yield Step(PULL.symbol, sp.Add(*map(sp.Abs, terms)), "the law, by magnitude")


@function(takes=(ROBOT,), returns=LARGEST)
def largest_pull(model: Model) -> Steps:
    """What the motor pulls with at the limit of the current."""
    value = sp.S.Zero if model.law is None else -model.law.along * gamma2 * u_max
    yield Step(LARGEST.symbol, value if model.law is None or model.declares(u_max) else sp.oo, "the limit")


@function(takes=(ROBOT, STATE, MOTION), returns=NUMERATOR)
def law_numerator(model: Model) -> Steps:
    """Numerator of the pull of the law."""
    per_x, per_v = _pull(model).diff(x1), _pull(model).diff(v1)
    of_x, of_v = (v1, N2_1, N1_1), (H3_1, H2_1, H1_1)
    for name, displaced, faster in zip((H3, H2, H1), of_x, of_v, strict=True):
        yield Step(name, per_x * displaced + per_v * faster, "its rate is a motion of the pair")


@function(takes=(ROBOT, STATE, CURRENT), returns=ASKED)
def current_of_law(model: Model) -> Steps:
    """The current that the law asks for at a state, where it is within the limit."""
    yield Step(ASKED.symbol, sp.S.Zero if model.law is None else -model.pull / gamma2, "the law")
