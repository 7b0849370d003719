"""The states over time, (18)-(21), in terms of W: one form for every pole configuration.

From H(s) = h(0)/s + (H_3 s^2 + H_2 s + H_1)/(s P(s)) for h = y, v_1, v_2:

    h(t)  = h(0) + H_3 W' + H_2 W + H_1 W1            h'(t) = H_3 W'' + H_2 W' + H_1 W
    x_i(t) = x_i(0) + v_i(0) t + H_3 W + H_2 W1 + H_1 W2 = x_i(0) + v_i(0) W' + N_2 W + N_1 W1 + N_0 W2

With b_1 + b_2 > 0 and distinct poles these are A + B t + C exp(-a t) + D exp(-b t) + E exp(-c t) of (18)
and, for x_1, (20) without the hats F, G, whose poles d, e cancel.
"""

from collections.abc import Iterator

from ..ir import Quantity, Record, Step, Steps, function, scalar
from ..model.quantities import *

RESIDUAL = scalar("residual", "1", "the final value less the function")
residual = RESIDUAL.symbol


def _later(quantities: tuple[Quantity, ...]) -> Iterator[Quantity]:
    """The same at a later time t."""
    return (scalar(f"{each.name}_t", each.unit, each.meaning) for each in quantities)


AT = Record("At", "The state at time t of a phase.").of(*_later(STATE.quantities))
x1_t, v1_t, v2_t, y_t = AT.symbols


@function(takes=(POLES, NUMERATOR, BASIS, RESIDUAL_0), returns=RESIDUAL)
def residual_to_steady_state() -> Steps:
    """Residual of a function of time to its steady state.

    h(t) of (19), (21) less its final value, of terms that decay: it keeps its digits after the transients.
    """
    yield Step(
        residual,
        residual_0 * Wdd - (H3 - residual_0 * s_1) * Wd - (H2 - residual_0 * s_2) * W,
        "(19), (21) less their final value",
    )


@function(takes=(STATE, MOTION, BASIS), returns=AT)
def state_at() -> Steps:
    """The state at time t of a phase."""
    yield Step(x1_t, x1 + (v1 * Wd + N2_1 * W + N1_1 * W1 + N0_1 * W2), "(20), with t = W' + s_1 W + s_2 W1 + s_3 W2")
    yield Step(v1_t, v1 + (H3_1 * Wd + H2_1 * W + H1_1 * W1), "(21)")
    yield Step(v2_t, v2 + (H3_2 * Wd + H2_2 * W + H1_2 * W1), "(19)")
    yield Step(y_t, y + (H3_y * Wd + H2_y * W + H1_y * W1), "(18) of y")
